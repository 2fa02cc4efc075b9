"""Trackers of many targets that run as programs on detections: `program_many` and the peers of `make peers`."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from irsim.types import Frame
from irtrack.detectors import parse_detector
from irtrack.external import DetectionSession, command, required
from irtrack.trackers.base import Footage, TrackerPart, footage
from irtrack.trackers.external import as_written, words_of
from irtrack.trackers.multi_target import strongest
from irtrack.tracks import TrackFrame
from irtrack.types import Detections, Detector


@dataclass(frozen=True, slots=True, eq=False)
class ManyExternalState:
    """State: the session with the program, which keeps its own memory, so that no step can be repeated; and the memory
    of the detector."""

    footage: Footage
    session: DetectionSession
    memory: Any


class ManyExternalTracker(TrackerPart):
    """Tracker of many that runs as a program on detections. TrackerError where the program raises, dies or hangs."""

    task: ClassVar[str] = "many"
    resumable: ClassVar[bool] = False
    name: ClassVar[str]

    detector: str = "lcm"
    """Detector, as `irtrack bench --detectors` takes it: NAME or NAME:KEY=VALUE."""
    most_detections: Annotated[int, Field(ge=1, le=10_000)] = 200
    """Largest number of detections of a frame that are used, those of the highest scores."""
    merge_px: Annotated[float, Field(ge=0, le=1000)] = 4.0
    """Detections within so many px of a stronger one are left out, as in irtrack's own trackers."""
    box_px: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """Least side of the boxes passed to the program, px: small boxes that move have little overlap."""
    timeout_s: Annotated[float, Field(ge=0.01, le=3600)] = 60.0
    """Longest time of a step, s, after which the program counts as hanging."""

    @abstractmethod
    def runs(self) -> tuple[str, ...]:
        """Return the command that starts the program; InputError where it is missing or invalid."""

    @cached_property
    def detector_used(self) -> Detector:
        """Detector of the frames, as the parameter `detector` names it."""
        return parse_detector(self.detector)

    def init(self, frame: Frame, rng: np.random.Generator) -> ManyExternalState:
        """Start the program on the detections of the first frame; InputError where it cannot be started."""
        size = footage(frame)
        memory, found = self.detector_used.step(None, frame)
        session = DetectionSession(self.name, self.runs(), self.timeout_s)
        session.init(frame, self.passed(found), int(rng.integers(2**31)))
        return ManyExternalState(size, session, memory)

    def step(
        self, state: ManyExternalState, frame: Frame, rng: np.random.Generator
    ) -> tuple[ManyExternalState, TrackFrame]:
        """Return the tracks that the program answers."""
        state.footage.check(frame)
        memory, found = self.detector_used.step(state.memory, frame)
        return replace(state, memory=memory), state.session.step(frame, self.passed(found))

    def passed(self, found: Detections) -> Detections:
        """Return the detections that the program gets."""
        kept = strongest(found, self.most_detections, self.merge_px)
        return replace(kept, sizes=np.maximum(kept.sizes, self.box_px))


class ManyCommand(ManyExternalTracker):
    """Any program that speaks the protocol of docs/trackers.md for many targets, on detections."""

    name: ClassVar[str] = "program_many"
    source: ClassVar[str] = "your own"

    command: Annotated[str, BeforeValidator(as_written)]
    """Command that starts it, in the syntax of a shell."""

    def runs(self) -> tuple[str, ...]:
        return words_of(self.name, self.command)


class ManyPeer(ManyExternalTracker):
    """A tracker of many of another library in the environment of `make peers`."""

    def runs(self) -> tuple[str, ...]:
        return command(self.name, required(self.name))


class BoxPeer(ManyPeer):
    """Peer that associates by the overlap of boxes."""

    box_px: Annotated[float, Field(ge=0, le=1000)] = 12.0
    """As in `ManyExternalTracker`. The boxes of a detector of points are 2 px wide: those of a target that moves by
    1.5 px a frame overlap by less than these trackers require."""


class RoboflowSort(BoxPeer):
    """SORT of Roboflow's `trackers`: Kalman filters of boxes, assigned by their overlap."""

    name: ClassVar[str] = "rf_sort"
    source: ClassVar[str] = "Bewley, Ge, Ott, Ramos, Upcroft 2016"


class RoboflowByteTrack(BoxPeer):
    """ByteTrack of Roboflow's `trackers`: SORT that assigns detections of high and of low score in turn."""

    name: ClassVar[str] = "rf_bytetrack"
    source: ClassVar[str] = "Zhang, Sun, Jiang, Yu, Weng, Yuan, Luo, Liu, Wang 2022"


class RoboflowOcSort(BoxPeer):
    """OC-SORT of Roboflow's `trackers`: SORT with the direction and the last observation of a track."""

    name: ClassVar[str] = "rf_ocsort"
    source: ClassVar[str] = "Cao, Pang, Weng, Khirodkar, Kitani 2023"


class Norfair(ManyPeer):
    """Norfair: Kalman filters of centres, assigned by their distance."""

    name: ClassVar[str] = "norfair"
    source: ClassVar[str] = "Tryolabs, norfair"


class Motpy(BoxPeer):
    """motpy: Kalman filters of boxes, assigned by their overlap."""

    name: ClassVar[str] = "motpy"
    source: ClassVar[str] = "Muron, motpy"


class StoneSoupGnn(ManyPeer):
    """Global nearest neighbours of Stone Soup, with a Kalman filter and tracks started from several detections."""

    name: ClassVar[str] = "ss_gnn"
    source: ClassVar[str] = "Dstl, Stone Soup"


class StoneSoupJpda(ManyPeer):
    """Joint probabilities of Stone Soup, by loopy belief propagation, with a Kalman filter."""

    name: ClassVar[str] = "ss_jpda"
    source: ClassVar[str] = "Williams, Lau 2014; Dstl, Stone Soup"


MANY_EXTERNAL: dict[str, type[ManyExternalTracker]] = {
    cls.name: cls
    for cls in (
        ManyCommand,
        RoboflowSort,
        RoboflowByteTrack,
        RoboflowOcSort,
        Norfair,
        Motpy,
        StoneSoupGnn,
        StoneSoupJpda,
    )
}
"""Trackers of many that run as programs, by name."""
