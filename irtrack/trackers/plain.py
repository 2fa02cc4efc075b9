"""Plain trackers: a class with ``start(frame, box)`` and ``step(frame)``, wrapped as it is."""

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
from irtrack.types import Estimate

ALLOWED = "a Box, cx, cy, w, h in px, an Estimate, or None for a target that is not seen"


def is_plain(kind: type) -> bool:
    """Whether a class is a plain tracker: `start` and `step`, no `init`."""
    return hasattr(kind, "start") and hasattr(kind, "step") and not hasattr(kind, "init")


@dataclass(frozen=True, slots=True, eq=False)
class Following:
    """A plain tracker at work. It keeps its own account of the past, so no step can be done again."""

    tracker: Any
    last: Estimate


@dataclass(frozen=True, eq=False)
class Plain:
    """A plain tracker as an `irtrack.Tracker`; every run has an object of its own.

    kind        the class;  parameters  what it is made from, or an object's attributes
    again       gives a new object, not yet started

    `start` is called with the image (rows, cols), a copy that may be written on, and the start `Box`; where it has
    a parameter `rng`, with a generator too. `step` is called with the image, and answers with `ALLOWED`.
    """

    kind: type
    parameters: Mapping[str, Any]
    again: Callable[[], Any] = field(repr=False)
    resumable: ClassVar[bool] = False

    @classmethod
    def made(cls, kind: type, parameters: Mapping[str, Any]) -> Plain:
        """Of a class and what it is made from."""
        return cls(kind, dict(parameters), partial(kind, **parameters))

    @classmethod
    def of(cls, tracker: object) -> Plain:
        """Of an object, which is copied for each run."""
        return cls(type(tracker), dict(getattr(tracker, "__dict__", {})), partial(copy.deepcopy, tracker))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Following:
        tracker = self.again()
        wanted = {"rng": rng} if _takes_rng(self.kind) else {}
        tracker.start(frame.image.copy(), box, **wanted)
        return Following(tracker, Estimate((box.cx, box.cy), (box.w, box.h)))

    def step(self, state: Following, frame: Frame, rng: np.random.Generator) -> tuple[Following, Estimate]:
        answer = state.tracker.step(frame.image.copy())
        estimate = state.last if answer is None else _estimate(answer)
        if estimate is None:
            place = f"{self.kind.__module__}:{self.kind.__qualname__}: frame {frame.index}"
            raise TrackerError(f"{place}: step gave {' '.join(repr(answer).split())[:80]}; allowed: {ALLOWED}")
        if answer is None:
            estimate = replace(estimate, status="lost")
        return Following(state.tracker, estimate), estimate


@cache
def _takes_rng(kind: type) -> bool:
    """Whether a class wants a generator at its start; asked once, as an answer takes .1 ms."""
    return "rng" in inspect.signature(kind.start).parameters  # type: ignore[attr-defined]  # asked only of classes with a start


def _estimate(answer: Any) -> Estimate | None:
    """What a plain tracker's answer says; None where it cannot be told."""
    if isinstance(answer, Estimate):
        return answer
    if isinstance(answer, str | bytes):
        return None
    try:
        cx, cy, w, h = (answer.cx, answer.cy, answer.w, answer.h) if isinstance(answer, Box) else answer
        return Estimate((float(cx), float(cy)), (float(w), float(h)))
    except (TypeError, ValueError):
        return None
