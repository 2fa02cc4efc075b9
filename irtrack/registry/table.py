"""Table of trackers by name, and `make`, which turns a name and parameters into a tracker.

A new tracker is a module with a frozen `TrackerPart` and a line in `TRACKERS`; the contract tests run over the table.
A tracker of another package is named as ``module:Class``, or by an entry point of the group ``irtrack.trackers``. It
has `init` and `step`, or `start` and `step` (a plain tracker, `irtrack.trackers.adapters`).
"""

from __future__ import annotations

import importlib
import inspect
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import UnionType
from typing import Any, Literal, NamedTuple, Union, cast, get_args, get_origin, get_type_hints

from pydantic import create_model

from irsim import build
from irsim.config.base import Part, suggestion
from irsim.errors import exits_refused
from irtrack.detectors import DETECTOR_KINDS, DETECTORS, make_detector
from irtrack.detectors.from_file import file_spec
from irtrack.detectors.plain import is_plain as is_plain_detector
from irtrack.errors import InputError, error_line
from irtrack.external import ALL_PEERS, HINT, offered, required
from irtrack.trackers.adaboost_pf import AdaBoostPF
from irtrack.trackers.adapters import Plain, is_plain
from irtrack.trackers.apf_tbd import APFTBD
from irtrack.trackers.base import TrackerPart
from irtrack.trackers.camshift import CamShiftKalman
from irtrack.trackers.cascade_pf import CascadePF, CoastingPF, ProductPF
from irtrack.trackers.change_kalman import ChangeKalman
from irtrack.trackers.ensemble import EnsembleTracker
from irtrack.trackers.external import EXTERNAL, Command
from irtrack.trackers.fusion_pf import FusionWSPF
from irtrack.trackers.gnn import GNN
from irtrack.trackers.grey_pf import BackgroundRestrainedPF, GreyPF
from irtrack.trackers.h_infinity import HInfinity
from irtrack.trackers.histogram_moments import HistogramMoments
from irtrack.trackers.hog_pf import HogPF
from irtrack.trackers.identity import IdentityTracker
from irtrack.trackers.imm_mf import ImmMF
from irtrack.trackers.jpda import JPDA
from irtrack.trackers.kalman import EKF, Kalman
from irtrack.trackers.lbp_mean_shift import LBPMeanShift
from irtrack.trackers.likelihood_pf import LikelihoodPF
from irtrack.trackers.many_adapters import PlainMany, is_plain_many, takes_detections
from irtrack.trackers.many_external import MANY_EXTERNAL, ManyCommand
from irtrack.trackers.mean_shift import MeanShift, MeanShiftKalman, MeanShiftPF
from irtrack.trackers.mht import MHT
from irtrack.trackers.optical_flow import OpticalFlow
from irtrack.trackers.pdaf import PDAF
from irtrack.trackers.svd_pf import SVDPF
from irtrack.trackers.template import Template
from irtrack.trackers.upf import UPF
from irtrack.types import Tracker

TRACKERS: dict[str, type[TrackerPart]] = {
    "grey_pf": GreyPF,
    "cascade_pf": CascadePF,
    "product_pf": ProductPF,
    "coasting_pf": CoastingPF,
    "mean_shift": MeanShift,
    "mean_shift_kalman": MeanShiftKalman,
    "mean_shift_pf": MeanShiftPF,
    "background_restrained_pf": BackgroundRestrainedPF,
    "template": Template,
    "kalman": Kalman,
    "ekf": EKF,
    "optical_flow": OpticalFlow,
    "camshift_kalman": CamShiftKalman,
    "change_kalman": ChangeKalman,
    "imm_mf": ImmMF,
    "fusion_wspf": FusionWSPF,
    "svd_pf": SVDPF,
    "apf_tbd": APFTBD,
    "pdaf": PDAF,
    "h_infinity": HInfinity,
    "lbp_mean_shift": LBPMeanShift,
    "hog_pf": HogPF,
    "adaboost_pf": AdaBoostPF,
    "upf": UPF,
    "likelihood_pf": LikelihoodPF,
    "histogram_moments": HistogramMoments,
    "ensemble": EnsembleTracker,
}

MULTI_TRACKERS: dict[str, type[TrackerPart]] = {"gnn": GNN, "jpda": JPDA, "mht": MHT, "identity": IdentityTracker}
"""Trackers of many targets, which start by themselves."""

NAMED: dict[str, type[TrackerPart]] = {**TRACKERS, **MULTI_TRACKERS, **EXTERNAL, **MANY_EXTERNAL}
"""The tables and the trackers that run as programs."""

ALL_KINDS: dict[str, type[Part]] = {**NAMED, **DETECTOR_KINDS}
"""Trackers and detectors by name."""

ENTRY_POINTS = "irtrack.trackers"

CONTRACTS = (
    "a class with start(frame, box) and step(frame), or with init(frame, box, rng) and step(state, frame, rng); of "
    "many targets: start(frame) and step(frame), or step(detections), or init(frame, rng) and step(state, frame, rng)"
)
"""The forms of a tracker: with its state inside (plain), or passed to and returned by `step`
(`irtrack.types.Tracker`)."""


class Row(NamedTuple):
    """Line of `irtrack list`."""

    name: str
    summary: str
    source: str


def make(name: str, parameters: Mapping[str, object] | None = None) -> Tracker:
    """Return the tracker of a name from the table, an entry point, ``module:Class``, or ``trax:COMMAND``.

    InputError, a line for each error: an unknown name or parameter, a wrong type, a value out of range, a module that
    cannot be imported. Parameters of a user's own class are checked where annotated as numbers, texts, true or false.
    Output of the class goes to standard error.
    """
    cls = find(name)
    given = _command(name) | dict(parameters or {})
    if "detections" in given and takes_detector(cls):
        if "detector" in given:
            raise InputError(f"{name}: detector and detections; allowed: one of them")
        given["detector"] = file_spec(given.pop("detections"))
    if issubclass(cls, Part):
        return cast(Tracker, build(cls, given, name))
    plain = {key: (hint, ...) for key, hint in _hints(cls).items() if key in given and _is_plain(hint)}
    plain = {key: field for key, field in plain.items() if not key.startswith("_") and not hasattr(Part, key)}
    checked = build(create_model(cls.__name__, __base__=Part, **cast(Any, plain)), {k: given[k] for k in plain}, name)
    given |= {key: getattr(checked, key) for key in plain}
    try:
        with redirect_stdout(sys.stderr):
            adapted = _adapted(cls, given)
            made = (
                cls(**given) if adapted is None else adapted.again()
            )  # raises for wrong arguments here, not at the first frame
    except (Exception, SystemExit) as error:  # a user's class may raise anything
        if isinstance(error, TypeError) and (missing := _missing(cls, given)):
            raise InputError(f"{name}: no value of {', '.join(missing)}; allowed: {name}:{missing[0]}=VALUE") from None
        plainly = " ".join(str(error).split()) if isinstance(error, TypeError | ValueError) else error_line(error)
        raise InputError(f"{name}: {plainly}") from None
    return cast(Tracker, made if adapted is None else adapted)


def _missing(cls: type[Any], given: Mapping[str, object]) -> list[str]:
    """Return the parameters of a class that have neither a value nor a default."""
    try:
        parameters = inspect.signature(cls).parameters.values()
    except (TypeError, ValueError):  # builtins have no signature
        return []
    single = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    needed = [each.name for each in parameters if each.kind in single and each.default is each.empty]
    return [name for name in needed if name not in given]


def takes_detector(cls: type[Any]) -> bool:
    """Return whether a tracker runs on a detector, so that `detections=FILE` stands for the detector of a file."""
    if issubclass(cls, Part):
        return "detector" in cls.model_fields and "detections" not in cls.model_fields
    return is_plain_many(cls) and takes_detections(cls)


def of(tracker: object) -> Tracker:
    """Return the tracker of an object: a tracker, a plain tracker, or a class of either; InputError for others."""
    kind = tracker if isinstance(tracker, type) else type(tracker)
    _checked(f"{kind.__module__}:{kind.__qualname__}", kind)
    if isinstance(tracker, type):
        return cast(Tracker, _adapted(tracker, {}) or tracker())
    if is_plain_many(kind):
        return cast(Tracker, PlainMany.of(tracker))
    return Plain.of(tracker) if is_plain(kind) else cast(Tracker, tracker)


def _adapted(kind: type[Any], parameters: Mapping[str, Any]) -> Plain | PlainMany | None:
    """Return the adapter of a plain class; None for any other class."""
    if is_plain_many(kind):
        return PlainMany.made(kind, parameters)
    return Plain.made(kind, parameters) if is_plain(kind) else None


def runnable(tracker: object, parameters: Mapping[str, object] | None = None) -> Any:
    """Return the tracker or detector of a name with parameters, or of a function, class or object.

    A user's own detector is recognised by its methods (`is_detector`). InputError as for `make`, `of` and
    `make_detector`.
    """
    if not isinstance(tracker, str):
        if getattr(tracker, "task", "") == "detect" and not isinstance(tracker, type):
            return tracker
        return make_detector(tracker) if is_detector(tracker) else of(tracker)  # type: ignore[arg-type]  # its methods tell
    module, colon, name = tracker.partition(":")
    own = bool(colon) and module not in NAMED and all(map(str.isidentifier, (*module.split("."), *name.split("."))))
    if tracker in DETECTORS or (own and is_detector(_imported(tracker))):
        return make_detector(tracker, parameters)
    return make(tracker, parameters)


def is_detector(found: object) -> bool:
    """Return whether an object or class is a detector: a function, or with `detect`, or with `step(state, frame)`; the
    last two without `init` and `start`."""
    if hasattr(found, "init") or hasattr(found, "start"):
        return False
    kind: Any = found if isinstance(found, type) else type(found)
    two = hasattr(kind, "step") and len(inspect.signature(kind.step).parameters) == 3
    return two or is_plain_detector(found)


def _imported(name: str) -> object:
    """Return what ``module:name`` names. As with `python -m`, the module may be in the current folder; it must not
    shadow others."""
    here = os.getcwd()
    if here not in sys.path:
        sys.path.append(here)
    return _load(name, EntryPoint(name, name, ENTRY_POINTS))


def find(name: str) -> type[Any]:
    """Return the class of a tracker's name; InputError where there is none."""
    if not isinstance(name, str):
        raise InputError(f"tracker {name!r}: is no name; allowed: text, such as 'kalman'")
    if name in ALL_PEERS and name not in offered(name):
        raise InputError(f"{name}: is not in {required(name)}'s environment; allowed: after {HINT}")
    if name in NAMED:
        return NAMED[name]
    installed = _installed()
    if name in installed:
        return _checked(name, _load(name, installed[name]))
    known = [*NAMED, *installed]
    module, colon, cls = name.partition(":")
    if _command(name):
        return NAMED[module]
    if module in known:
        raise InputError(
            f"'{name}': {module} is a tracker's name, not a module; allowed: {module}, or {module}:KEY=VALUE"
        )
    if colon:
        file = Path(module)
        if file.suffix == ".py" or not all(part.isidentifier() for part in (*module.split("."), *cls.split("."))):
            hint = f"; did you mean '{file.stem}:{cls}'?" if file.suffix == ".py" and cls.isidentifier() else ""
            raise InputError(f"'{name}': this is no module:Class; allowed: e.g. brightest:Brightest{hint}")
        return _checked(name, _imported(name))
    module, dot, last = name.rpartition(".")
    if dot and all(map(str.isidentifier, name.split("."))):
        hint = f"; did you mean '{module}:{'Class' if last == 'py' else last}'?"
    else:
        hint = suggestion(name, known)
    raise InputError(f"unknown tracker '{name}'; allowed: {', '.join(known)} or module:Class{hint}")


def _command(name: str) -> dict[str, object]:
    """Return {"command": COMMAND} for a name such as ``trax:COMMAND``; {} for any other name."""
    kind, colon, command = name.partition(":")
    return {"command": command} if colon and issubclass(NAMED.get(kind, object), (Command, ManyCommand)) else {}


def check_trusted(name: str, parameters: Mapping[str, object], trust: bool) -> None:
    """Raise InputError where a file names a tracker that runs a command (`program`, `trax`), and `trust` is False."""
    kind = name.partition(":")[0]
    if not trust and issubclass(NAMED.get(kind, object), (Command, ManyCommand)):
        command = {**_command(name), **parameters}.get("command", "")
        raise InputError(f"{kind}: runs the command {str(command)!r}; allowed: trackers without one, or trust=True")


def describe(peers: Sequence[str] = ()) -> list[Row]:
    """Return the rows of `irtrack list`: one for every named tracker, of the peers only those given."""
    present = [
        *TRACKERS,
        *MULTI_TRACKERS,
        *(name for name, cls in {**EXTERNAL, **MANY_EXTERNAL}.items() if issubclass(cls, (Command, ManyCommand))),
        *peers,
    ]
    rows = [Row(name, _summary(NAMED[name]), NAMED[name].source) for name in present]
    for name, entry in _installed().items():
        try:
            cls = _checked(name, _load(name, entry))
        except InputError as error:
            rows.append(Row(name, str(error), entry.value))
        else:
            rows.append(Row(name, _summary(cls), str(getattr(cls, "source", entry.value))))
    return rows


def _installed() -> dict[str, EntryPoint]:
    """Return entry points of trackers in installed packages, without those that would replace a name of the table."""
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINTS) if entry.name not in NAMED}


def _load(name: str, entry: EntryPoint) -> object:
    try:
        importlib.invalidate_caches()
        with redirect_stdout(sys.stderr), exits_refused():
            return entry.load()
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        module = sys.modules.get(entry.module)
        classes = [key for key, value in vars(module or object).items() if isinstance(value, type)]
        hint = suggestion(entry.attr, classes) if isinstance(error, AttributeError) else ""
        raise InputError(f"cannot import tracker '{name}': {error_line(error)}{hint}") from None


def _checked(name: str, found: object) -> type[Any]:
    if not isinstance(found, type):
        raise InputError(f"'{name}' is not a tracker; allowed: {CONTRACTS}")
    if hasattr(found, "step") and (hasattr(found, "init") or hasattr(found, "start") or takes_detections(found)):
        return found
    has = " and ".join(part for part in ("init", "start", "step") if hasattr(found, part))
    lacks = "start" if has == "step" else "step" if has else "start and no step"
    raise InputError(f"'{name}' is not a tracker: it has {f'{has} but ' * bool(has)}no {lacks}; allowed: {CONTRACTS}")


def _summary(cls: type[Any]) -> str:
    return (cls.__doc__ or "").strip().partition("\n")[0]


def _hints(cls: type[Any]) -> dict[str, Any]:
    """Return the annotations of a class' arguments; empty where they cannot be evaluated."""
    try:
        return get_type_hints(cls.__init__)
    except Exception:  # annotations may be any text
        return {}


def _is_plain(hint: Any) -> bool:
    """Return whether a parameter takes only numbers, texts, true or false, or one of several words."""
    if get_origin(hint) in (Union, UnionType):
        return all(_is_plain(choice) for choice in get_args(hint))
    return get_origin(hint) is Literal or hint in (int, float, bool, str, type(None))
