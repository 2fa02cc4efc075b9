"""Adapter of plain trackers, classes with ``start(image, box)`` and ``step(image)``."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.types import Estimate, plain_view

ALLOWED = "a Box, cx, cy, w, h in px, an Estimate, or None for a target that is not seen"


def is_plain(kind: type) -> bool:
    """Return whether a class is a plain tracker: `start` and `step`, no `init`."""
    return hasattr(kind, "start") and hasattr(kind, "step") and not hasattr(kind, "init")


@dataclass(frozen=True, slots=True, eq=False)
class PlainState:
    """State of a plain tracker: the tracker object, which changes in each step, so that no step can be repeated."""

    tracker: Any
    last: Estimate


@dataclass(frozen=True, eq=False)
class Plain:
    """Adapter of a plain tracker to `irtrack.Tracker`; every run gets a new object of the plain class.

    kind        plain class;  parameters  arguments of the class, or attributes of an object
    again       function that returns a new object before its start

    `start` gets a writable copy of the image (rows, cols) or a `Frame` (`irtrack.types.plain_view`) and the start
    `Box`, and a random generator where it has a parameter `rng`. `step` gets the image or the `Frame`, and returns a
    value of `ALLOWED`. A class with ``needs = ("pose",)`` gets a `Frame` with the camera's pose.
    """

    kind: type
    parameters: Mapping[str, Any]
    again: Callable[[], Any] = field(repr=False)
    resumable: ClassVar[bool] = False

    @classmethod
    def made(cls, kind: type, parameters: Mapping[str, Any]) -> Plain:
        """Return the adapter of a class and its arguments."""
        return cls(kind, dict(parameters), partial(kind, **parameters))

    @classmethod
    def of(cls, tracker: object) -> Plain:
        """Return the adapter of an object, which is copied for each run."""
        return cls(type(tracker), dict(getattr(tracker, "__dict__", {})), partial(copy.deepcopy, tracker))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> PlainState:
        tracker = self.again()
        wanted = {"rng": rng} if _takes_rng(self.kind) else {}
        tracker.start(plain_view(tracker.start, frame), box, **wanted)
        return PlainState(tracker, Estimate((box.cx, box.cy), (box.w, box.h)))

    def step(self, state: PlainState, frame: Frame, rng: np.random.Generator) -> tuple[PlainState, Estimate]:
        answer = state.tracker.step(plain_view(state.tracker.step, frame))
        estimate = state.last if answer is None else _estimate(answer)
        if estimate is None:
            place = f"{self.kind.__module__}:{self.kind.__qualname__}: frame {frame.index}"
            raise TrackerError(f"{place}: step gave {' '.join(repr(answer).split())[:80]}; allowed: {ALLOWED}")
        if answer is None:
            estimate = replace(estimate, status="lost")
        return PlainState(state.tracker, estimate), estimate


@cache
def _takes_rng(kind: type) -> bool:
    """Return whether `start` has a parameter `rng`; cached, since inspection takes .1 ms."""
    return "rng" in inspect.signature(kind.start).parameters  # type: ignore[attr-defined]  # called only for classes with a start


def _estimate(answer: Any) -> Estimate | None:
    """Return the answer of a plain tracker as an estimate; None where the answer is not allowed."""
    if isinstance(answer, Estimate):
        return answer
    if isinstance(answer, str | bytes):
        return None
    try:
        cx, cy, w, h = (answer.cx, answer.cy, answer.w, answer.h) if isinstance(answer, Box) else answer
        return Estimate((float(cx), float(cy)), (float(w), float(h)))
    except (TypeError, ValueError):
        return None
