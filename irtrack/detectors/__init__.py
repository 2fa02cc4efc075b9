"""Detectors: frames to detections. `make_detector` gives one by its name, `module:function` or `module:Class`.

A new detector is a frozen `DetectorPart` and a line in `DETECTORS`; the contract tests run over the table.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from typing import Any, cast

import irsim
from irsim.config.base import suggestion
from irsim.types import Frame
from irtrack.detectors.bandpass import Butterworth, DoG, Ring
from irtrack.detectors.base import DetectorPart, FilterDetector
from irtrack.detectors.frame_difference import FrameDifference
from irtrack.detectors.from_file import FileDetector
from irtrack.detectors.local_contrast import LCM, MPCM
from irtrack.detectors.matched_filter import MatchedFilter
from irtrack.detectors.morphology import MaxMean, MaxMedian, Threshold, TopHat
from irtrack.detectors.onnx import Onnx
from irtrack.detectors.plain import PlainDetector, is_plain
from irtrack.detectors.svd import SVD
from irtrack.errors import InputError, TrackerError, error_line
from irtrack.types import Detections, Detector
from irtrack.validity import fault_of_detections

__all__ = [
    "DETECTORS",
    "DETECTOR_KINDS",
    "DetectorPart",
    "FilterDetector",
    "PlainDetector",
    "detected",
    "make_detector",
    "parse_detector",
]

DETECTORS: dict[str, type[DetectorPart]] = {
    "threshold": Threshold,
    "tophat": TopHat,
    "max_mean": MaxMean,
    "max_median": MaxMedian,
    "dog": DoG,
    "lcm": LCM,
    "mpcm": MPCM,
    "ring": Ring,
    "svd": SVD,
    "butterworth": Butterworth,
    "matched_filter": MatchedFilter,
    "frame_difference": FrameDifference,
    "onnx": Onnx,
}

DETECTOR_KINDS: dict[str, type[DetectorPart]] = {**DETECTORS, "file": FileDetector}
"""The detectors of frames, and the one that reads detections from a file."""

CONTRACTS = "a function of an image, a class with detect(image), or one with step(state, frame)"

_PAIR = re.compile(r"\w+=")


def make_detector(name: str | Callable[..., Any], parameters: Mapping[str, object] | None = None) -> Detector:
    """Return the detector of a name from the table or ``module:name``, or of a function, class or object.

    InputError, a line for each error: an unknown name or parameter, a wrong type, a value out of range, a module that
    cannot be imported.
    """
    given = dict(parameters or {})
    if not isinstance(name, str):
        return _own(name, f"{getattr(name, '__module__', '')}:{getattr(name, '__qualname__', repr(name))}", given)
    if name in DETECTOR_KINDS:
        return cast(Detector, irsim.build(DETECTOR_KINDS[name], given, name))
    return _own(find_detector(name), name, given)


def find_detector(name: str) -> Any:
    """Return the class of a name from the table, or the object of ``module:name``, which need not be a detector.

    InputError for an unknown name and for a module that cannot be imported.
    """
    if name in DETECTOR_KINDS:
        return DETECTOR_KINDS[name]
    module, colon, attribute = name.partition(":")
    if not colon or not all(part.isidentifier() for part in (*module.split("."), *attribute.split("."))):
        raise InputError(
            f"unknown detector '{name}'; allowed: {', '.join(DETECTOR_KINDS)} or module:name"
            + suggestion(name, DETECTOR_KINDS)
        )
    here = os.getcwd()
    if here not in sys.path:
        sys.path.append(here)  # a module may lie in the current folder, as with `python -m`
    try:
        importlib.invalidate_caches()
        with redirect_stdout(sys.stderr):
            found: Any = importlib.import_module(module)
            for part in attribute.split("."):
                found = getattr(found, part)
    except (Exception, SystemExit) as error:  # a user's module may raise anything
        raise InputError(f"cannot import detector '{name}': {error_line(error)}") from None
    return found


def parse_detector(text: str) -> Detector:
    """Return the detector of a spec such as ``tophat:threshold=6`` or ``mine:Class:reach=3``; a value is read as YAML.

    A part without ``KEY=`` continues the value of the part before it.
    """
    name, *rest = text.strip().split(":")
    pairs: list[str] = []
    for part in rest:
        if _PAIR.match(part):
            pairs.append(part)
        elif pairs:
            pairs[-1] += f":{part}"
        else:
            name += f":{part}"
    parameters: dict[str, object] = {}
    for pair in pairs:
        key, _, value = pair.partition("=")
        if key in parameters:
            raise InputError(f"detector '{text}': the parameter '{key}' is given twice")
        try:
            parameters[key] = irsim.scalar(value)
        except irsim.InputError as error:
            raise InputError(f"detector '{text}': {key}: {error}") from None
    return make_detector(name, parameters)


def detected(detector: Detector, memory: Any, frame: Frame) -> tuple[Any, Detections]:
    """Return the memory and the detections of a detector after a frame; TrackerError, one line, for any other
    answer."""
    answer: Any = detector.step(memory, frame)
    if not (isinstance(answer, tuple) and len(answer) == 2):
        wrong: str | None = f"step gave {type(answer).__name__}; allowed: (memory, Detections)"
    elif (wrong := fault_of_detections(answer[1])) is None:
        return answer[0], answer[1]
    kind = type(detector)
    name = next((name for name, known in DETECTORS.items() if known is kind), f"{kind.__module__}:{kind.__qualname__}")
    raise TrackerError(f"{name}: frame {frame.index}: {wrong}")


def _own(found: Any, name: str, parameters: dict[str, object]) -> Detector:
    """Return the detector of a user's function, class or object."""
    if isinstance(found, type) and issubclass(found, DetectorPart):
        return cast(Detector, irsim.build(found, parameters, name))
    if not (is_plain(found) or hasattr(found, "step")):
        raise InputError(f"'{name}' is no detector; allowed: {CONTRACTS}")
    if parameters and not (isinstance(found, type) or callable(found)):
        raise InputError(f"{name}: an object takes no parameters; allowed: {CONTRACTS}")
    try:
        if is_plain(found):
            plain = PlainDetector.of(found, parameters)
            with redirect_stdout(sys.stderr):
                plain.again()  # raises for wrong arguments here, not at the first frame
            return plain
        return cast(Detector, found(**parameters) if isinstance(found, type) else found)
    except (Exception, SystemExit) as error:  # a user's class may raise anything
        plainly = " ".join(str(error).split()) if isinstance(error, TypeError | ValueError) else error_line(error)
        raise InputError(f"{name}: {plainly}") from None
