"""Tracks of many targets: those of one frame, those of a whole run, and the protocol of trackers of many.

Coordinates follow `irsim.types`: px, x right, y down, the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from typing import Any, Protocol, get_args

import numpy as np
import numpy.typing as npt

from irsim.errors import counted
from irsim.types import Box, Floats, Frame, Input
from irtrack.types import Estimate, Status, Track

STATUSES: tuple[Status, ...] = get_args(Status)


@dataclass(frozen=True, slots=True, eq=False)
class TrackFrame:
    """Tracks of one frame as arrays, n rows.

    ids          (n,) numbers of the tracks, none twice
    centers      (n, 2) px;  sizes (n, 2) px, width and height
    scores       (n,) confidence of any scale, nan where there is none
    statuses     n statuses: "tracking" after a detection, "occluded" where the position is predicted
    confirmed    (n,) True where the track counts as a target; False for a candidate
    velocities   (n, 2) px/frame;  covariances (n, 2, 2) px^2 of the centres; None where unknown
    classes      n classes, each None where unknown; None where nothing is classified
    """

    ids: npt.NDArray[np.int64]
    centers: Floats
    sizes: Floats
    scores: Floats
    statuses: tuple[Status, ...]
    confirmed: npt.NDArray[np.bool_]
    velocities: Floats | None = None
    covariances: Floats | None = None
    classes: tuple[str | None, ...] | None = None

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def of(cls, rows: Iterable[tuple[int, Box, float]]) -> TrackFrame:
        """Return confirmed tracks of (id, box, score)."""
        given = list(rows)
        count = len(given)
        return cls(
            np.array([id for id, _, _ in given], dtype=np.int64),
            np.array([(box.cx, box.cy) for _, box, _ in given], dtype=np.float64).reshape(-1, 2),
            np.array([(box.w, box.h) for _, box, _ in given], dtype=np.float64).reshape(-1, 2),
            np.array([score for _, _, score in given], dtype=np.float64),
            STATUSES[:1] * count,
            np.ones(count, bool),
        )

    def estimates(self) -> Iterator[tuple[int, Estimate]]:
        """Yield each track's id and estimate."""
        for k, id in enumerate(self.ids.tolist()):
            score = float(self.scores[k])
            yield (
                id,
                Estimate(
                    center=(float(self.centers[k, 0]), float(self.centers[k, 1])),
                    size=(float(self.sizes[k, 0]), float(self.sizes[k, 1])),
                    status=self.statuses[k],
                    score=None if np.isnan(score) else score,
                    velocity=None if self.velocities is None else tuple(self.velocities[k].tolist()),
                    covariance=None if self.covariances is None else self.covariances[k],
                    id=id,
                    cls=None if self.classes is None else self.classes[k],
                ),
            )


class MultiTracker(Protocol):
    """Tracker of many targets: frozen parameters with two pure functions; no box is given.

    States are immutable values, as for `irtrack.types.Tracker`. The generator of frame k is `irsim.rng.stream(seed,
    name, "many", k)`.
    """

    def init(self, frame: Frame, rng: np.random.Generator) -> Any:
        """Return the state after the first frame."""
        ...

    def step(self, state: Any, frame: Frame, rng: np.random.Generator) -> tuple[Any, TrackFrame]:
        """Return the state and the tracks after the next frame."""
        ...


@dataclass(frozen=True, eq=False)
class TrackSet:
    """Tracks of many targets over a source, one row for each track and frame, in order of frames.

    source, source_hash, tracker, config, input, scene_seed, tracker_seed   as in `irtrack.types.Track`
    frames       (k,) indices of the frames passed to the tracker;  times (k,) s;  step_ms, cpu_ms (k,)
    frame, id    (n,) index of the frame and id of the track, of each row
    cx, cy, w, h (n,) px
    score        (n,) nan where there is none
    status       (n,) index in `STATUSES`;  confirmed (n,) bool
    classes      n classes or None
    """

    source: str
    source_hash: str
    tracker: str
    config: dict[str, Any]
    input: Input
    scene_seed: int | None
    tracker_seed: int
    frames: npt.NDArray[np.int64]
    times: Floats
    step_ms: Floats
    cpu_ms: Floats
    frame: npt.NDArray[np.int64]
    id: npt.NDArray[np.int64]
    cx: Floats
    cy: Floats
    w: Floats
    h: Floats
    score: Floats
    status: npt.NDArray[np.int8]
    confirmed: npt.NDArray[np.bool_]
    classes: tuple[str | None, ...] | None = None

    @classmethod
    def of(cls, track: Track) -> TrackSet:
        """Return the track of one target as a set, in which its id is 0."""
        count = len(track.indices)
        scores = [np.nan if each.score is None else each.score for each in track.estimates]
        return cls(
            **{name: getattr(track, name) for name in _RUN},
            frames=track.indices,
            frame=track.indices.astype(np.int64),
            id=np.zeros(count, np.int64),
            cx=track.centers[:, 0],
            cy=track.centers[:, 1],
            w=track.sizes[:, 0],
            h=track.sizes[:, 1],
            score=np.array(scores, dtype=np.float64),
            status=np.array([STATUSES.index(status) for status in track.statuses], dtype=np.int8),
            confirmed=np.ones(count, bool),
        )

    def __len__(self) -> int:
        return len(self.frame)

    def __repr__(self) -> str:
        tracks = counted(len(np.unique(self.id[self.confirmed])), "confirmed track")
        return f"TrackSet({self.tracker} on {self.source}: {tracks}, {counted(len(self.frames), 'frame')})"

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all columns by name, for a results file."""
        return _arrays(self)


_RUN = (
    "source",
    "source_hash",
    "tracker",
    "config",
    "input",
    "scene_seed",
    "tracker_seed",
    "times",
    "step_ms",
    "cpu_ms",
)
"""Fields that a `Track` and a `TrackSet` share."""


def stacked(tracks: Iterable[tuple[int, TrackFrame]]) -> dict[str, Any]:
    """Return the columns of a `TrackSet` from pairs of a frame index and the tracks of that frame."""
    given = [(index, each) for index, each in tracks if len(each)]
    if not given:
        empty = np.zeros(0)
        whole = empty.astype(np.int64)
        columns: dict[str, Any] = {"frame": whole, "id": whole, **dict.fromkeys(("cx", "cy", "w", "h", "score"), empty)}
        return {**columns, "status": empty.astype(np.int8), "confirmed": empty.astype(bool), "classes": None}
    frames = [each for _, each in given]
    centers, sizes = np.concatenate([each.centers for each in frames]), np.concatenate([each.sizes for each in frames])
    classified = any(each.classes is not None for each in frames)
    return {
        "frame": np.repeat([index for index, _ in given], [len(each) for each in frames]).astype(np.int64),
        "id": np.concatenate([each.ids for each in frames]).astype(np.int64),
        "cx": centers[:, 0],
        "cy": centers[:, 1],
        "w": sizes[:, 0],
        "h": sizes[:, 1],
        "score": np.concatenate([each.scores for each in frames]).astype(np.float64),
        "status": np.array([STATUSES.index(s) for each in frames for s in each.statuses], dtype=np.int8),
        "confirmed": np.concatenate([each.confirmed for each in frames]).astype(bool),
        "classes": tuple(c for each in frames for c in (each.classes or (None,) * len(each))) if classified else None,
    }


@dataclass(frozen=True, eq=False)
class DetectionSet:
    """Detections of a detector over a source, one a row, in order of frames.

    source, source_hash, detector, config, input, scene_seed   as in `irtrack.types.Track`
    frames, times, step_ms, cpu_ms   of the frames passed to the detector, (k,)
    frame        (n,) index of the frame of each row;  cx, cy, w, h (n,) px;  score (n,)
    classes      n classes or None
    """

    source: str
    source_hash: str
    detector: str
    config: dict[str, Any]
    input: Input
    scene_seed: int | None
    frames: npt.NDArray[np.int64]
    times: Floats
    step_ms: Floats
    cpu_ms: Floats
    frame: npt.NDArray[np.int64]
    cx: Floats
    cy: Floats
    w: Floats
    h: Floats
    score: Floats
    classes: tuple[str | None, ...] | None = None

    def __len__(self) -> int:
        return len(self.frame)

    def __repr__(self) -> str:
        found = counted(len(self), "detection")
        return f"DetectionSet({self.detector} on {self.source}: {found}, {counted(len(self.frames), 'frame')})"

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all columns by name, for a results file."""
        return _arrays(self)


def _arrays(found: TrackSet | DetectionSet) -> dict[str, np.ndarray]:
    columns = {each.name: getattr(found, each.name) for each in fields(found)}
    classes = {"classes": np.array([each or "" for each in found.classes], dtype=np.str_)} if found.classes else {}
    return {name: value for name, value in columns.items() if isinstance(value, np.ndarray)} | classes
