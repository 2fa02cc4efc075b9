"""Adapter of a user's plain tracker of many targets.

Allowed are a class with ``start(frame)`` and ``step(frame)``, or one with ``step(detections)`` alone, which is run on
a detector. Both answer with a list of (id, box, score), the box as `irsim.Box` or (cx, cy, w, h), or with a
`irtrack.tracks.TrackFrame`.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.detectors import detected, parse_detector
from irtrack.errors import TrackerError
from irtrack.tracks import TrackFrame
from irtrack.types import Detector, plain_view

ALLOWED = "a list of (id, box, score), id an int64, the box a Box or (cx, cy, w, h) in px, or a TrackFrame"


def is_plain_many(kind: type) -> bool:
    """Return whether a class is a plain tracker of many: `start(frame)` without a box, or `step(detections)` alone."""
    if not hasattr(kind, "step") or hasattr(kind, "init"):
        return False
    if hasattr(kind, "start"):
        return len(_parameters(kind.start)) == 1
    return takes_detections(kind)


def takes_detections(kind: type) -> bool:
    """Return whether the only argument of `step` is named `detections`."""
    return [each.name for each in _parameters(kind.step)] == ["detections"]  # type: ignore[attr-defined]  # it has one


def _parameters(function: Any) -> list[inspect.Parameter]:
    """Return the required parameters of a method, without `self` and a generator `rng`."""
    given = list(inspect.signature(function).parameters.values())[1:]
    return [each for each in given if each.default is each.empty and each.name != "rng"]


@dataclass(frozen=True, slots=True, eq=False)
class PlainManyState:
    """Plain tracker of many in a run, and the memory of its detector. No step can be repeated."""

    tracker: Any
    memory: Any


@dataclass(frozen=True, eq=False)
class PlainMany:
    """Plain tracker of many as a `irtrack.tracks.MultiTracker`; every run has an object of its own.

    kind        the class;  parameters  the class' arguments, or an object's attributes
    again       returns a new object, not yet started
    detector    detector of a tracker that takes detections
    """

    kind: type
    parameters: Mapping[str, Any]
    again: Callable[[], Any] = field(repr=False)
    detector: str = "lcm"
    resumable: ClassVar[bool] = False
    task: ClassVar[str] = "many"

    @classmethod
    def made(cls, kind: type, parameters: Mapping[str, Any]) -> PlainMany:
        """Return the adapter of a class and its arguments; the adapter takes `detector` unless the class has that
        argument."""
        own = dict(parameters)
        chosen = {}
        if "detector" in own and "detector" not in inspect.signature(kind).parameters:
            chosen["detector"] = own.pop("detector")
        return cls(kind, own, partial(kind, **own), **chosen)

    @classmethod
    def of(cls, tracker: object) -> PlainMany:
        """Return the adapter of an object, which is copied for each run."""
        return cls(type(tracker), dict(getattr(tracker, "__dict__", {})), partial(copy.deepcopy, tracker))

    @cached_property
    def detector_used(self) -> Detector | None:
        """Detector of a tracker that takes detections."""
        return parse_detector(self.detector) if takes_detections(self.kind) else None

    def init(self, frame: Frame, rng: np.random.Generator) -> PlainManyState:
        tracker, detector = self.again(), self.detector_used
        if detector is not None:
            memory, found = detected(detector, None, frame)
            tracker.step(found)
            return PlainManyState(tracker, memory)
        tracker.start(plain_view(tracker.start, frame))
        return PlainManyState(tracker, None)

    def step(self, state: PlainManyState, frame: Frame, rng: np.random.Generator) -> tuple[PlainManyState, TrackFrame]:
        detector, memory = self.detector_used, None
        if detector is not None:
            memory, found = detected(detector, state.memory, frame)
            answer = state.tracker.step(found)
        else:
            answer = state.tracker.step(plain_view(state.tracker.step, frame))
        tracks = _tracks(answer)
        if tracks is None:
            place = f"{self.kind.__module__}:{self.kind.__qualname__}: frame {frame.index}"
            raise TrackerError(f"{place}: step gave {' '.join(repr(answer).split())[:80]}; allowed: {ALLOWED}")
        return PlainManyState(state.tracker, memory), tracks


def _tracks(answer: Any) -> TrackFrame | None:
    """Return the tracks of a plain tracker's answer; None for any other answer."""
    if isinstance(answer, TrackFrame):
        return answer
    if answer is None or (isinstance(answer, str | bytes | np.ndarray) and np.ndim(answer) != 2):
        return None
    rows: list[tuple[int, Box, float]] = []
    try:
        for id, box, *score in answer:
            if isinstance(id, bool) or int(id) != id or abs(int(id)) > np.iinfo(np.int64).max:
                return None
            cx, cy, w, h = (box.cx, box.cy, box.w, box.h) if isinstance(box, Box) else box
            rows.append((int(id), Box(float(cx), float(cy), float(w), float(h)), float(score[0]) if score else np.nan))
    except (TypeError, ValueError):
        return None
    return TrackFrame.of(rows)
