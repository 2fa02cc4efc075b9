"""Trackers of many and detectors behind the interface of a tracker of one target, so that one check tests all three."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from irsim.types import Box, Frame
from irtrack.bench.plan import task_of
from irtrack.metrics.tasks import Task
from irtrack.trackers.many_adapters import PlainMany
from irtrack.trackers.multi_target import MultiTargetTracker
from irtrack.tracks import TrackFrame
from irtrack.types import Detections, resumable
from irtrack.validity import fault, fault_of_detections, fault_of_tracks

FAULTS: Mapping[Task, Callable[[object], str | None]] = {
    "single": fault,
    "many": fault_of_tracks,
    "detect": fault_of_detections,
}
"""Function of each task that describes the error in an answer of a step."""


@dataclass(frozen=True, eq=False)
class ManySubject:
    """Tracker of many; the start box is not used."""

    tracker: Any
    task: ClassVar[Task] = "many"

    @property
    def resumable(self) -> bool:
        return resumable(self.tracker)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        return self.tracker.init(frame, rng)

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, TrackFrame]:
        answer: tuple[Any, TrackFrame] = self.tracker.step(state, frame, rng)
        return answer

    def on(self, plots: Sequence[Detections]) -> ManySubject | None:
        """Return the tracker on given detections of each frame; None where it does not use those of a detector."""
        if not isinstance(self.tracker, MultiTargetTracker | PlainMany) or self.tracker.detector_used is None:
            return None
        fed = copy(self.tracker)
        fed.__dict__["detector_used"] = Given(tuple(plots))  # in place of its cached property
        return replace(self, tracker=fed)


@dataclass(frozen=True, eq=False)
class Given:
    """Detector whose detections are given, by the index of the frame."""

    plots: tuple[Detections, ...]

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        return None, self.plots[frame.index]


@dataclass(frozen=True, eq=False)
class DetectorSubject:
    """Detector; start box and generator are not used, and its detections in the first frame are left out."""

    tracker: Any
    task: ClassVar[Task] = "detect"

    @property
    def scale_invariant(self) -> bool:
        """True: the detector declares that counts times a factor give the same detections."""
        return bool(getattr(getattr(self.tracker, "kind", self.tracker), "scale_invariant", False))

    @property
    def resumable(self) -> bool:
        """True: the detector's memory is a value; a user's own function or class may keep its memory in itself."""
        return bool(getattr(self.tracker, "resumable", True))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> Any:
        return self.tracker.step(None, frame)[0]

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, Detections]:
        answer: tuple[Any, Detections] = self.tracker.step(state, frame)
        return answer


def subject(tracker: Any) -> Any:
    """Return a tracker of one target, of many, or a detector with the interface of a tracker of one target."""
    wrap = {"many": ManySubject, "detect": DetectorSubject}.get(task_of(tracker))
    return tracker if wrap is None else wrap(tracker)
