"""What tells one tracker from another: its name, its parameters, its source code."""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import importlib.util
import inspect
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from irsim.kinds import Part
from irtrack.types import Tracker


def tracker_name(tracker: Tracker) -> str:
    """Its name in irtrack's table, or module:Class."""
    from irtrack.trackers import TRACKERS

    kind: type[object] = type(tracker)
    return next((name for name, known in TRACKERS.items() if known is kind), f"{kind.__module__}:{kind.__qualname__}")


def tracker_config(tracker: Tracker) -> dict[str, Any]:
    """{"tracker": name, "parameters": {...}}, plain values that JSON can hold.

    Parameters are a Part's or a dataclass' fields, else the object's attributes; a value that JSON
    cannot hold is given by its repr.
    """
    value: Any = tracker
    if isinstance(value, Part):
        parameters = value.model_dump(mode="json")
    elif dataclasses.is_dataclass(value):
        parameters = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    else:
        parameters = getattr(value, "__dict__", {})
    plain = json.loads(json.dumps(parameters, default=repr))
    return {"tracker": tracker_name(tracker), "parameters": plain}


def code_hash(tracker: Tracker) -> str:
    """Hex digest of the source code that decides what the tracker does.

    That is the file of its class and every irtrack module that this file imports, one through the
    other; of a tracker that is not irtrack's, its own file counts and no other foreign one. A class
    that has no file (typed into a prompt) is told by its name alone.
    """
    digest = hashlib.blake2b(digest_size=16)
    try:
        file = inspect.getsourcefile(type(tracker))
    except TypeError:
        file = None
    if file is None:
        digest.update(tracker_name(tracker).encode())
        return digest.hexdigest()
    for path in sorted(_with_imports(Path(file), type(tracker).__module__)):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _with_imports(path: Path, module: str) -> set[Path]:
    """The file and the files of all irtrack modules that it imports, directly or not."""
    found = {path}
    waiting = [(path, module)]
    while waiting:
        path, module = waiting.pop()
        for name in _imported(path, module):
            spec = importlib.util.find_spec(name)
            if spec is not None and spec.origin is not None and Path(spec.origin) not in found:
                found.add(Path(spec.origin))
                waiting.append((Path(spec.origin), name))
    return found


def _imported(path: Path, module: str) -> Iterator[str]:
    """Names of the irtrack modules that a file imports."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if _is_ours(alias.name))
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module and _is_ours(node.module):
            yield node.module
            for alias in node.names:
                below = f"{node.module}.{alias.name}"
                if _is_package(node.module) and importlib.util.find_spec(below) is not None:
                    yield below


def _is_ours(module: str) -> bool:
    return module.split(".")[0] == "irtrack"


def _is_package(module: str) -> bool:
    spec = importlib.util.find_spec(module)
    return spec is not None and spec.submodule_search_locations is not None
