"""Identity of a tracker: its name, its parameters, and a hash (fingerprint) of its code."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import importlib.util
import inspect
import math
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, Literal, get_origin

import numpy as np

from irsim.config.base import Part
from irtrack.errors import InputError, IrtrackError
from irtrack.registry.imports import counted_file, with_imports
from irtrack.tracks import MultiTracker
from irtrack.types import Detector, Tracker

Runnable = Tracker | MultiTracker | Detector
"""Subject of a bench: a tracker of one target, a tracker of many targets, or a detector."""

_AMBIGUOUS = re.compile(r" at 0x[0-9a-fA-F]+|\.\.\.")
"""Parts of a repr that do not identify a value: an address, which differs from run to run, or numpy's ellipsis."""

_LOCATION = {"__module__", "__qualname__", "__doc__", "__firstlineno__", "__static_attributes__"}
"""Attributes of a class that hold its position in a file, or its documentation, and do not enter the hash."""


def tracker_name(tracker: Runnable) -> str:
    """Return its name in the table, or module:Class."""
    from irtrack.registry.table import ALL_KINDS

    kind = _kind(tracker)
    return next((name for name, known in ALL_KINDS.items() if known is kind), f"{kind.__module__}:{kind.__qualname__}")


def tracker_config(tracker: Runnable) -> dict[str, Any]:
    """Return {"tracker": name, "parameters": {...}} as JSON holds it, and "needs" where it needs more than pictures.

    Parameters are the fields of a Part or dataclass, else the object's attributes. An array is written as dtype, shape
    and a digest of its bytes, an infinity as in YAML, any other object as its repr. InputError where a repr does not
    identify the value.
    """
    name, parameters, needs = tracker_name(tracker), _fields(tracker), tracker_needs(tracker)
    plain = {key: _plain(value, f"{name}: {key}") for key, value in parameters.items()}
    return {"tracker": name, "parameters": plain} | ({"needs": list(needs)} if needs else {})


NEEDS = ("pose",)
"""Allowed values of the attribute `needs` of a tracker or detector: inputs besides pictures, the pose of each frame."""


def tracker_needs(tracker: Any) -> tuple[str, ...]:
    """Return what a tracker needs besides pictures, its detector (`detector_used`) included; InputError for others."""
    kind = _kind(tracker)
    given = getattr(tracker if kind is type(tracker) else kind, "needs", ())
    if not isinstance(given, tuple | list) or not set(given) <= set(NEEDS):
        raise InputError(f"{tracker_name(tracker)}: needs {given!r}; allowed: {NEEDS}, or ()")
    used = getattr(tracker, "detector_used", None)
    return tuple(dict.fromkeys((*given, *(() if used is None else tracker_needs(used)))))


def tracker_of_config(config: Mapping[str, Any]) -> Any:
    """Return the tracker or detector of a configuration (`tracker_config`); None where it cannot be made here.

    A configuration may come from an untrusted results file: no module is imported for it.
    """
    from irtrack.detectors import DETECTORS, make_detector
    from irtrack.registry.table import make

    module, colon, _ = config["tracker"].partition(":")
    if colon and module not in sys.modules:
        return None
    try:
        return (make_detector if config["tracker"] in DETECTORS else make)(config["tracker"], config["parameters"])
    except IrtrackError:
        return None


def changed_parameters(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a configuration that are not the tracker's defaults; all where defaults are unknown."""
    usual = tracker_of_config({"tracker": config["tracker"], "parameters": {}})
    defaults = {} if usual is None else tracker_config(usual)["parameters"]
    return {key: value for key, value in config["parameters"].items() if defaults.get(key, ...) != value}


def _kind(tracker: Runnable) -> type[object]:
    """Return the tracker's class, without its adapter."""
    return tracker.kind if isinstance(tracker, _adapters()) else type(tracker)


def _adapters() -> tuple[type[Any], ...]:
    from irtrack.detectors.plain import PlainDetector
    from irtrack.trackers.adapters import Plain
    from irtrack.trackers.many_adapters import PlainMany

    return Plain, PlainMany, PlainDetector


def _fields(value: Any) -> dict[str, Any]:
    if isinstance(value, _adapters()):
        return dict(value.parameters)
    if isinstance(value, Part):
        return {field: getattr(value, field) for field in type(value).model_fields}
    if dataclasses.is_dataclass(value):
        return {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    return dict(getattr(value, "__dict__", {}))


def _plain(value: Any, place: str) -> Any:
    """Return the value as strict JSON can hold it."""
    if isinstance(value, np.ndarray) and value.dtype != object:
        digest = hashlib.blake2b(value.tobytes(), digest_size=16).hexdigest()
        return {"array": digest, "dtype": str(value.dtype), "shape": list(value.shape)}
    if isinstance(value, np.generic | np.ndarray):
        return _plain(value.tolist(), place)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(item, place) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, place) for item in value]
    if isinstance(value, set | frozenset):
        return sorted((_plain(item, place) for item in value), key=repr)
    if isinstance(value, Part) or (dataclasses.is_dataclass(value) and not isinstance(value, type)):
        return {"type": type(value).__qualname__, **{k: _plain(v, f"{place}.{k}") for k, v in _fields(value).items()}}
    text = repr(value)
    if _AMBIGUOUS.search(text):
        raise InputError(
            f"{place}: {type(value).__name__} has no repr that identifies it, so results could be confused; allowed: "
            "numbers, texts, arrays, lists, mappings, dataclasses of these, or a __repr__ with its parameters"
        )
    return text


def weights_digest(tracker: Any) -> str:
    """Return a hex digest of all files that decide a run besides parameters and code; '' where there are none.

    It covers the files that a tracker or detector declares by `weights` (attribute or property: one path or several; a
    parameter with a fixed set of words names no file); for a tracker on a detector (`detector_used`) also that
    detector's code and files. InputError where a file is missing.
    """
    parts: list[str] = []
    used = getattr(tracker, "detector_used", None)
    if used is not None:
        parts += [code_hash(used), weights_digest(used)]
    kind = _kind(tracker)
    declared = getattr(tracker if kind is type(tracker) else kind, "weights", ())
    parameter = getattr(kind, "model_fields", {}).get("weights")
    if parameter is not None and get_origin(parameter.annotation) is Literal:
        declared = ()
    for path in (declared,) if isinstance(declared, str | Path) else declared:
        if not Path(path).is_file():
            raise InputError(f"{tracker_name(tracker)}: weights {path}: there is no such file; allowed: a file")
        parts.append(hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest())
    return hashlib.blake2b("".join(parts).encode(), digest_size=16).hexdigest() if parts else ""


def code_hash(tracker: Runnable) -> str:
    """Return a hex digest of the tracker's source code.

    It covers the file of the tracker's class and all modules that the file imports, directly or not, if they are part
    of irtrack, of the same package, or not installed. Installed packages and files opened at run time (libraries by
    ctypes, weights) do not enter the hash. A class without a file (typed at a prompt or in a notebook) is identified by
    its compiled methods and by the functions and classes that they name.
    """
    kind = _kind(tracker)
    file = source_file(kind)
    if file is None:
        digest = hashlib.blake2b(digest_size=16)
        for part in sorted(set(_compiled(kind, kind.__module__, {}))):
            digest.update(part.encode() + b"\0")
        return digest.hexdigest()
    return _files_hash(with_imports(file, kind.__module__))


def module_code_hash(module: str) -> str:
    """Return a hex digest of the source of an irtrack module and of its imports, as in `code_hash`."""
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return _files_hash(with_imports(Path(spec.origin), module))


def _files_hash(paths: set[Path]) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for path in sorted(paths):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def source_file(kind: type[object]) -> Path | None:
    """Return the source file of a class; None where it was typed at a prompt or in a notebook, or read from a pipe."""
    try:
        file = inspect.getsourcefile(kind)
    except (TypeError, OSError):
        file = None
    return Path(file) if file is not None and Path(file).is_file() else None


def _compiled(value: object, module: str, seen: dict[int, object]) -> Iterator[str]:
    """Yield the bytecode of a class or function, and of all that it names, as texts for the hash of a tracker."""
    if id(value) in seen:
        return
    seen[id(value)] = value
    if isinstance(value, type) and value.__module__ == module:
        for base in value.__bases__:
            yield from _compiled(base, module, seen)
        for name, member in vars(value).items():
            if name not in _LOCATION:
                yield from _named(f"{value.__qualname__}.{name}", member, module, seen)
    elif isinstance(value, staticmethod | classmethod):
        yield from _compiled(value.__func__, module, seen)
    elif isinstance(value, property):
        for part in (value.fget, value.fset):
            yield from _compiled(part, module, seen)
    elif isinstance(value, FunctionType) and value.__module__ == module:
        yield f"{value.__qualname__}{value.__defaults__}{value.__kwdefaults__}{_instructions(value.__code__)}"
        for name in _names(value.__code__):
            yield from _named(name, value.__globals__.get(name), module, seen)
    elif isinstance(value, type | FunctionType):
        yield from _imported_module(value.__module__)
    elif isinstance(value, ModuleType):
        yield from _imported_module(value.__name__)


def _imported_module(module: str) -> Iterator[str]:
    """Yield the hash of a module and its imports, as a text for the hash of a tracker typed at a prompt."""
    file = counted_file(module, "")
    if file is not None:
        yield f"{module} {_files_hash(with_imports(file, module))}"


def _named(name: str, value: object, module: str, seen: dict[int, object]) -> Iterator[str]:
    """Yield the texts for the hash of a named value: a plain value itself, or the bytecode of a class or function."""
    if isinstance(value, bool | int | float | str | tuple):
        yield f"{name} = {value!r}"
    else:
        yield from _compiled(value, module, seen)


def _instructions(code: CodeType) -> tuple[object, ...]:
    """Return the instructions of a code object without line numbers; sets are sorted, since their repr has no order."""
    constants: list[object] = []
    for each in code.co_consts:
        constants.append(_instructions(each) if isinstance(each, CodeType) else each)
        if isinstance(each, frozenset):
            constants[-1] = sorted(map(repr, each))
    return code.co_code, code.co_names, code.co_varnames, code.co_exceptiontable, constants


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _names(each)
