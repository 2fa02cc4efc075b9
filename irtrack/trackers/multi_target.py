"""Base of trackers of many targets on detections.

Each frame: predict (each track by a Kalman filter or an interacting multiple model), gate, associate, update or coast,
start, confirm, delete (S. Blackman, R. Popoli, "Design and Analysis of Modern Tracking Systems", 1999, chapter 6). The
methods differ in how they associate; everything else is `MultiTargetTracker`.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from math import log
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.types import Floats, Frame
from irtrack.detectors import detected, parse_detector
from irtrack.filters.data_association import amplitude_ratios
from irtrack.filters.multiple_model import (
    MultipleModel,
    States,
    constant_acceleration_model,
    constant_velocity_model,
    coordinated_turn_model,
    densities,
    moved,
)
from irtrack.trackers.base import Deviation, Spread, TrackerPart
from irtrack.trackers.ego_motion import EgoMotion, View, ego_view, scene_motion
from irtrack.tracks import STATUSES, TrackFrame
from irtrack.types import Detections, Detector

Probability = Annotated[float, Field(gt=0, lt=1)]

UNRESOLVED_PX = 8.0
"""Distance of two tracks, px, within which they may have one detection. Chosen here: twice `merge_px`."""
LEVEL_RATE = 0.1
"""Share of a new score or size that enters a track's running value."""
SIZE_RATE = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class TrackTable:
    """n tracks: filters, and the values of track management, (n,) each; `size` (n, 2) px.

    id         number;  level: running mean of its detections' scores
    hits       bits of the last frames, the newest lowest: 1 where it had a detection
    age        frames since its first detection;  misses: frames in a row without one
    confirmed  True: the track counts as a target
    """

    states: States
    id: npt.NDArray[np.int64]
    size: Floats
    level: Floats
    hits: npt.NDArray[np.int64]
    age: npt.NDArray[np.int64]
    misses: npt.NDArray[np.int64]
    confirmed: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.id)

    def take(self, rows: np.ndarray) -> TrackTable:
        """Return the tracks selected by a mask or by indices."""
        return TrackTable(self.states.take(rows), *(getattr(self, name)[rows] for name in _COLUMNS))

    def moved(self, homography: Floats) -> TrackTable:
        """Return the tracks after the camera moved the whole scene by a homography (3, 3) of pixels."""
        return replace(self, states=moved(self.states, homography))

    def joined(self, others: TrackTable) -> TrackTable:
        """Return these tracks followed by others."""
        joined = (np.concatenate([getattr(self, name), getattr(others, name)]) for name in _COLUMNS)
        return TrackTable(self.states.joined(others.states), *joined)

    def existence(self, survival: float) -> Floats:
        """Return the probability (n,) that each track's target is still there, after the misses of its last frames.

        Bayes' rule over the frame in which it vanished; it lasts a frame with the probability `survival`, and is
        detected as often as it has been (D. Musicki, R. Evans, S. Stankovic, "Integrated probabilistic data
        association", IEEE Trans. Automatic Control 39(6), 1994, for a target without false detections). The misses of
        an unresolved track do not count.
        """
        seen = np.minimum(self.age + 1, _KEPT) - self.misses
        missed = survival * (1 - (_bits(self.hits) + 1) / (np.maximum(seen, 0) + 2))
        there = missed**self.misses
        gone = (1 - survival) * (1 - there) / (1 - missed)
        gone[self.unresolved()] = 0.0
        return np.asarray(there / (there + gone))

    def unresolved(self) -> npt.NDArray[np.bool_]:
        """Return a mask (n,) of missed tracks within `UNRESOLVED_PX` of a confirmed track that has a detection.

        One detection may be of both targets, so the miss says nothing.
        """
        missed = self.misses > 0
        rows, centers = np.flatnonzero(missed), self.states.moments()[0][:, :2]
        apart = ((centers[rows, None] - centers[None, ~missed & self.confirmed]) ** 2).sum(axis=-1)
        found = np.zeros(len(self), bool)
        found[rows[(apart < UNRESOLVED_PX**2).any(axis=1)]] = True
        return found

    def frame(self, survival: float | None = None) -> TrackFrame:
        """Return the tracks as the answer of a step: confirmed ones count as targets while their target is more
        likely there than gone; all of them where `survival` is None."""
        mean, covariance = self.states.moments()
        confirmed = self.confirmed if survival is None else self.confirmed & (self.existence(survival) > 0.5)
        return TrackFrame(
            ids=self.id,
            centers=mean[:, :2],
            sizes=self.size,
            scores=self.level,
            statuses=tuple(STATUSES[0] if miss == 0 else STATUSES[1] for miss in self.misses.tolist()),
            confirmed=confirmed,
            velocities=mean[:, 2:4],
            covariances=covariance[:, :2, :2],
        )


_COLUMNS = tuple(name for name in TrackTable.__slots__ if name != "states")


@dataclass(frozen=True, slots=True, eq=False)
class ManyState:
    """State: tracks, number of the next one, mean score of false detections, memory of the detector, frame size, and
    the frame's view for the compensation of the camera's motion."""

    tracks: TrackTable
    next_id: int
    clutter_score: float
    memory: Any
    size: tuple[int, int]
    view: View | None = None

    def moved(self, homography: Floats) -> ManyState:
        """Return the state after the camera moved the whole scene by a homography (3, 3) of pixels."""
        return replace(self, tracks=self.tracks.moved(homography))


class MultiTargetTracker(TrackerPart):
    """Base of trackers of many: predict, gate, associate, update or coast, start, confirm, delete.

    A new track starts at each detection that no track has. It is confirmed by `confirm_hits` detections in its last
    `confirm_frames` frames, and deleted as soon as that is impossible. A confirmed track without a detection coasts; it
    is deleted after `delete_misses` successive misses, when its centre leaves the picture, or when the standard
    deviation of its centre passes `delete_px`.
    """

    task: ClassVar[str] = "many"

    detector: str = "lcm"
    """Detector, as `irtrack bench --detectors` takes it: NAME or NAME:KEY=VALUE."""
    motion: Literal["cv", "imm"] = "cv"
    """cv: constant velocity. imm: constant velocity, constant acceleration, and turns to both sides, mixed."""
    acceleration: Deviation = 0.1
    """Standard deviation of the acceleration, px/frame^2."""
    turn_rate: Annotated[float, Field(gt=0, le=1)] = 0.15
    """Turn rate of the two turns of `imm`, rad/frame."""
    stay: Probability = 0.95
    """Probability that the motion model of `imm` stays the same in the next frame."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of a detection's centre on each axis, px."""
    start_speed: Deviation = 2.0
    """Standard deviation of the first speed on each axis, px/frame."""
    detection_probability: Probability = 0.9
    """Probability that a target gives a detection."""
    clutter: Annotated[float, Field(gt=0, le=1)] = 3e-5
    """False and new detections per px^2 and frame: 2.3 in a frame of 320 x 240 px."""
    gate: Annotated[float, Field(gt=0, le=1000)] = 13.8
    """Gate: largest squared Mahalanobis distance of a detection from a track to which it may be assigned; 99.9 % of
    chi-square with 2 degrees of freedom."""
    most_detections: Annotated[int, Field(ge=1, le=10_000)] = 200
    """Largest number of detections used in a frame; those of the highest scores are used."""
    merge_px: Annotated[float, Field(ge=0, le=1000)] = 4.0
    """Distance from a stronger detection within which a detection is left out as part of the same object, px."""
    amplitude: bool = True
    """True: scores enter the association, since the scores of a target are near its level."""
    confirm_hits: Annotated[int, Field(ge=1, le=60)] = 3
    confirm_frames: Annotated[int, Field(ge=1, le=60)] = 4
    survival: Probability = 0.99
    """Probability that a target lasts another frame: a track without detections counts as a target no longer than it
    is likely there. It is kept, and counts again after its next detection."""
    delete_misses: Annotated[int, Field(ge=1, le=10_000)] = 20
    delete_px: Spread = 20.0
    """Standard deviation of a predicted centre, px, at which a track is deleted."""
    ego_motion: EgoMotion = "none"
    """Compensation of the camera's motion before the prediction: none, by its pose (marked in tables), or by the
    registration of pictures (image), a shift only. Velocities are then relative to the distant background."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Inputs besides pictures: the camera's pose where it compensates ego-motion."""
        return ("pose",) if self.ego_motion == "pose" else ()

    @cached_property
    def detector_used(self) -> Detector:
        """Detector of the frames, as the parameter `detector` names it."""
        return parse_detector(self.detector)

    @cached_property
    def bank(self) -> MultipleModel:
        """Motion models."""
        if self.motion == "cv":
            return MultipleModel.of([constant_velocity_model(self.acceleration, 4)], 1.0)
        straight = constant_velocity_model(self.acceleration)
        turns = [coordinated_turn_model(sign * self.turn_rate, self.acceleration) for sign in (1, -1)]
        return MultipleModel.of([straight, constant_acceleration_model(self.acceleration), *turns], self.stay)

    @cached_property
    def noise(self) -> Floats:
        """Covariance of a detection's centre (2, 2) px^2."""
        return self.measurement_sd**2 * np.eye(2)

    def init(self, frame: Frame, rng: np.random.Generator) -> Any:
        """Return the state after the first frame, each of whose detections starts a track."""
        memory, found = detected(self.detector_used, None, frame)
        begun = self.begin(self.strongest(found), (frame.image.shape[1], frame.image.shape[0]), memory)
        return replace(begun, view=ego_view(self.ego_motion, frame))

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, TrackFrame]:
        """Return the state and the tracks after the next frame."""
        state = self._compensated(state, frame)
        memory, found = detected(self.detector_used, state.memory, frame)
        after = replace(self.advance(state, self.strongest(found)), memory=memory)
        return after, after.tracks.frame(self.survival)

    def _compensated(self, state: Any, frame: Frame) -> Any:
        """Return the state with its tracks where the camera's motion since the last frame has moved them."""
        view = ego_view(self.ego_motion, frame)
        if view is None:
            return state
        return replace(state.moved(scene_motion(state.view, view, state.size)), view=view)

    @abstractmethod
    def begin(self, found: Detections, size: tuple[int, int], memory: Any = None) -> Any:
        """Return the state after the first detections, in pictures of `size` (columns, rows) px."""

    @abstractmethod
    def advance(self, state: Any, found: Detections) -> Any:
        """Return the state after the detections of the next frame."""

    def strongest(self, found: Detections) -> Detections:
        """Return the `most_detections` detections of the highest scores, without those near a stronger one."""
        return strongest(found, self.most_detections, self.merge_px)

    def log_ratios(self, tracks: TrackTable, found: Detections, clutter_score: float) -> Floats:
        """Return the log-likelihood ratios (n, m) of `irtrack.filters.data_association`."""
        distance, density = densities(tracks.states, self.noise, found.centers)
        P = self.detection_probability
        ratios = density + (log(P) - log(1 - P) - log(self.clutter))
        if self.amplitude and len(found) and found.scores.min() > 0 and clutter_score > 0:
            ratios = ratios + amplitude_ratios(tracks.level, found.scores, clutter_score)
        return np.where(distance <= self.gate, ratios, -np.inf)

    def _in_reach(self, tracks: TrackTable, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
        """Return a mask: tracks with a detection, or inside the picture and within `delete_misses` and `delete_px`.

        An unresolved track is deleted by `delete_px` alone.
        """
        mean, covariance = tracks.states.moments()
        unsure = np.sqrt(np.maximum(covariance[:, 0, 0], covariance[:, 1, 1])) > self.delete_px
        inside = ((mean[:, :2] > -0.5) & (mean[:, :2] < np.array(size) - 0.5)).all(axis=1)
        few = tracks.misses < self.delete_misses
        if not few.all():
            few |= tracks.unresolved()
        return np.asarray((tracks.misses == 0) | (inside & ~unsure & few))

    def _started(self, found: Detections, free: npt.NDArray[np.int64], next_id: int) -> TrackTable:
        count = len(free)
        variance = np.full((count, 2), self.measurement_sd**2)
        return TrackTable(
            states=self.bank.started(found.centers[free], variance, self.start_speed),
            id=np.arange(next_id, next_id + count),
            size=found.sizes[free],
            level=found.scores[free],
            hits=np.ones(count, np.int64),
            age=np.zeros(count, np.int64),
            misses=np.zeros(count, np.int64),
            confirmed=np.zeros(count, bool),
        )


class OneHypothesisTracker(MultiTargetTracker):
    """Tracker that associates each frame's detections in that frame and never revises the choice."""

    def begin(self, found: Detections, size: tuple[int, int], memory: Any = None) -> ManyState:
        """Return the state after the first detections, in pictures of `size` (columns, rows) px."""
        empty = self._started(found, np.zeros(0, np.int64), 0)
        state = ManyState(empty, 0, 0.0, memory, size)
        return self._grown(state, empty, found, np.arange(len(found)))

    def advance(self, state: ManyState, found: Detections) -> ManyState:
        """Return the state after the detections of the next frame."""
        tracks = replace(state.tracks, states=self.bank.predict(state.tracks.states), age=state.tracks.age + 1)
        ratios = self.log_ratios(tracks, found, state.clutter_score)
        tracks, free = self.associate(tracks, found, ratios)
        return self._grown(state, tracks.take(self._alive(tracks, state.size)), found, free)

    @abstractmethod
    def associate(
        self, tracks: TrackTable, found: Detections, ratios: Floats
    ) -> tuple[TrackTable, npt.NDArray[np.int64]]:
        """Return the tracks after their detections, and the detections that start new ones."""

    def _alive(self, tracks: TrackTable, size: tuple[int, int]) -> npt.NDArray[np.bool_]:
        """Return a mask of the tracks to keep: candidates that can still be confirmed, and confirmed tracks within
        reach."""
        recent = tracks.hits & ((1 << np.minimum(tracks.age + 1, self.confirm_frames)) - 1)
        possible = _bits(recent) + np.maximum(self.confirm_frames - 1 - tracks.age, 0) >= self.confirm_hits
        return np.asarray(self._in_reach(tracks, size) & (tracks.confirmed | possible))

    def _grown(self, state: ManyState, tracks: TrackTable, found: Detections, free: npt.NDArray[np.int64]) -> ManyState:
        """Return the state with new tracks at the free detections, and with tracks confirmed that have enough hits."""
        everyone = tracks.joined(self._started(found, free, state.next_id)) if len(free) else tracks
        earned = _bits(everyone.hits & ((1 << self.confirm_frames) - 1)) >= self.confirm_hits
        scores = found.scores[free]
        score = state.clutter_score
        if len(scores):
            mean = float(scores.mean())
            score = mean if score == 0 else score + LEVEL_RATE * (mean - score)
        confirmed = replace(everyone, confirmed=everyone.confirmed | earned)
        return replace(state, tracks=confirmed, next_id=state.next_id + len(free), clutter_score=score)


def strongest(found: Detections, count: int, merge_px: float) -> Detections:
    """Return the `count` detections of the highest scores, without those within `merge_px` of a stronger one."""
    order = np.argsort(-found.scores, kind="stable")[:count]
    apart = found.centers[order, None] - found.centers[None, order]
    near = np.triu((apart**2).sum(axis=-1) < merge_px**2, 1)
    kept = np.ones(len(order), bool)
    for row in np.flatnonzero(near.any(axis=1)).tolist():
        if kept[row]:
            kept &= ~near[row]
    return found.take(np.sort(order[kept]))


def updated_table(
    tracks: TrackTable, states: States, hit: npt.NDArray[np.bool_], level: Floats, size: Floats
) -> TrackTable:
    """Return the tracks with new states; tracks with a hit take a share of the new level (n,) and size (n, 2)."""
    rate = np.where(hit, np.maximum(LEVEL_RATE, 1 / (tracks.age + 1.0)), 0.0)
    return replace(
        tracks,
        states=states,
        level=tracks.level + rate * (level - tracks.level),
        size=tracks.size + np.where(hit, SIZE_RATE, 0.0)[:, None] * (size - tracks.size),
        hits=(tracks.hits << 1 | hit) & _HISTORY,
        misses=np.where(hit, 0, tracks.misses + 1),
    )


_KEPT = 60
"""Number of last frames whose hits are kept, as bits."""
_HISTORY = (1 << _KEPT) - 1


def _bits(values: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    return np.bitwise_count(values).astype(np.int64)
