"""Reference, the ground truth of one target as arrays, and trace, a track beside its reference."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from irsim.types import SHOWN, Floats, Truth
from irtrack.metrics.attributes import marks
from irtrack.metrics.centre_error import centre_errors
from irtrack.metrics.longterm import LongTerm, long_term
from irtrack.metrics.lost import loss, off_frames
from irtrack.metrics.overlap import overlaps, widened
from irtrack.metrics.status import Return, returns
from irtrack.types import Track


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Ground truth of one target, frame by frame.

    indices   (n,) frame indices, rising
    centers   (n, 2) px and sizes (n, 2) px; nan in frames where the target is absent
    visible   (n,) visible fraction 0..1, nan where unknown
    accuracy  (n,) px: accuracy of the true centre, 0 for rendered truth
    marks     (n, len(ATTRIBUTES)) bool, see `irtrack.metrics.attributes`

    A target is absent where it has no truth or its centre is out of the frame; frames without the target enter no
    error, no overlap and no count towards the loss.
    """

    indices: np.ndarray
    centers: Floats
    sizes: Floats
    visible: Floats
    accuracy: Floats
    marks: np.ndarray

    @classmethod
    def of(cls, truths: Iterable[Truth], target: str | None) -> Reference:
        """Return the reference of a target by id; with `target` None the target is absent in all frames."""
        truths = list(truths)
        rows = []
        for truth in truths:
            seen = None if target is None else truth.target(target)
            if seen is None or seen.in_view is False:
                rows.append((truth.index, np.nan, np.nan, np.nan, np.nan, np.nan, 0.0))
            else:
                visible = np.nan if seen.visible is None else seen.visible
                rows.append((truth.index, *seen.center, seen.box.w, seen.box.h, visible, seen.accuracy_px))
        table = np.array(rows, dtype=np.float64).reshape(-1, 7)
        indices = table[:, 0].astype(np.int64)
        return cls(indices, table[:, 1:3], table[:, 3:5], table[:, 5], table[:, 6], marks(truths, target))

    def at(self, indices: np.ndarray) -> Reference:
        """Return the reference at these frame indices; the target is absent in frames that this reference lacks."""
        indices = np.asarray(indices, dtype=np.int64)
        if np.array_equal(indices, self.indices):
            return self
        known = np.isin(indices, self.indices)
        place = np.searchsorted(self.indices, indices[known])

        def taken(values: np.ndarray, unknown: float) -> np.ndarray:
            rows = np.full((len(indices), *values.shape[1:]), unknown, dtype=values.dtype)
            rows[known] = values[place]
            return rows

        centers, sizes, visible = (taken(each, np.nan) for each in (self.centers, self.sizes, self.visible))
        return Reference(indices, centers, sizes, visible, taken(self.accuracy, 0.0), taken(self.marks, False))

    @property
    def present(self) -> np.ndarray:
        """True in each frame in which the target is present, (n,) bool."""
        return np.asarray(np.isfinite(self.centers).all(axis=1))

    @property
    def shown(self) -> np.ndarray:
        """True where at least `SHOWN` of the target is visible in a frame, (n,) bool; unknown counts as visible."""
        return np.asarray(self.present & ~(self.visible < SHOWN))

    @property
    def diagonals(self) -> Floats:
        """Diagonals of the true boxes, (n,) px."""
        return np.asarray(np.hypot(self.sizes[:, 0], self.sizes[:, 1]))


@dataclass(frozen=True, eq=False)
class Trace:
    """Track and ground truth of its target at the same n frames, of which the first is the start frame.

    indices        (n,) frame indices
    centers, sizes (n, 2) px, estimates of the tracker;  statuses (n,), see `irtrack.types.Status`
    scores         (n,) of any scale;  neffs (n,);  covariances (n, 2, 2) px^2; nan where the tracker gives none
    truth_centers, truth_sizes   (n, 2) px; nan where the target is absent (see `Reference`)
    visible        (n,) fraction 0..1, nan where unknown
    accuracy       (n,) px, see `irsim.types.TargetTruth`
    marks          (n, len(ATTRIBUTES)) bool, see `irtrack.metrics.attributes`
    step_ms, cpu_ms  (n,) wall time, and CPU time of the process, of each step
    """

    indices: np.ndarray
    centers: Floats
    sizes: Floats
    statuses: np.ndarray
    scores: Floats
    neffs: Floats
    covariances: Floats
    truth_centers: Floats
    truth_sizes: Floats
    visible: Floats
    accuracy: Floats
    marks: np.ndarray
    step_ms: Floats
    cpu_ms: Floats

    @classmethod
    def of(cls, track: Track, reference: Reference) -> Trace:
        """Return the trace of a track; `reference` may hold other frames too."""
        truth = reference.at(track.indices)
        unsaid = np.full((2, 2), np.nan)
        estimates = track.estimates
        return cls(
            indices=track.indices,
            centers=track.centers,
            sizes=track.sizes,
            statuses=np.array(track.statuses, dtype=np.str_),
            scores=np.array([np.nan if each.score is None else each.score for each in estimates], dtype=np.float64),
            neffs=np.array([np.nan if each.neff is None else each.neff for each in estimates], dtype=np.float64),
            covariances=np.array(
                [unsaid if each.covariance is None else each.covariance for each in estimates], dtype=np.float64
            ),
            truth_centers=truth.centers,
            truth_sizes=truth.sizes,
            visible=truth.visible,
            accuracy=truth.accuracy,
            marks=truth.marks,
            step_ms=np.asarray(track.step_ms),
            cpu_ms=np.asarray(track.cpu_ms),
        )

    def first(self, n: int) -> Trace:
        """Return the trace of the first n frames, as if the source had ended there."""
        return replace(self, **{name: getattr(self, name)[:n] for name in _ARRAYS})

    def same_as(self, other: object) -> bool:
        """Return True if all values of two traces except times are equal, bit for bit."""
        return isinstance(other, Trace) and self.digest == other.digest

    @cached_property
    def truth(self) -> Reference:
        """Ground truth of the trace as a reference."""
        return Reference(self.indices, self.truth_centers, self.truth_sizes, self.visible, self.accuracy, self.marks)

    @cached_property
    def offsets(self) -> Floats:
        """Centre minus true centre, (n, 2) px."""
        return np.asarray(self.centers - self.truth_centers)

    @cached_property
    def errors(self) -> Floats:
        """Centre errors, (n,) px; nan where the target is absent."""
        return centre_errors(self.centers, self.truth_centers)

    @cached_property
    def overlaps(self) -> Floats:
        """Overlaps of the boxes, each at least `irtrack.types.LEAST_PX` wide and high, (n,); nan where the target is
        absent."""
        return overlaps(self.centers, widened(self.sizes), self.truth_centers, widened(self.truth_sizes))

    @cached_property
    def scored(self) -> np.ndarray:
        """True in each frame that is scored: after the start, with the target present, (n,) bool."""
        present = self.truth.present
        present[:1] = False
        return present

    @cached_property
    def counted(self) -> np.ndarray:
        """True in each frame that is scored, and at least `irsim.types.SHOWN` of the target visible, (n,) bool."""
        return np.asarray(self.scored & self.truth.shown)

    @cached_property
    def off(self) -> np.ndarray:
        """True in each frame in which the track is off target, (n,) bool; see `irtrack.metrics.lost.LOSS_RULE`."""
        return off_frames(self.errors, self.truth.diagonals, self.accuracy)

    @cached_property
    def lost_position(self) -> int | None:
        """Position of the frame that the loss is dated to; None without a loss."""
        return loss(self.off, self.counted)

    @cached_property
    def held(self) -> np.ndarray:
        """True in each frame that is scored and before the loss, (n,) bool; all scored frames without a loss."""
        held = self.scored.copy()
        if self.lost_position is not None:
            held[self.lost_position :] = False
        return held

    @cached_property
    def returns(self) -> list[Return]:
        """Reappearances of the target."""
        return returns(self.off, self.truth.shown)

    @cached_property
    def long_term(self) -> LongTerm:
        """Precision, recall and F of all frames but the start, with the score as confidence.

        The target is present where part of it is visible; the tracker reports a position unless its status is "lost".
        A tracker without scores has one threshold.
        """
        confidence = np.where(self.statuses == "lost", np.nan, np.where(np.isnan(self.scores), 0.0, self.scores))
        present = self.truth.present & ~(self.visible == 0)
        return long_term(self.overlaps[1:], confidence[1:], present[1:])

    @property
    def digest(self) -> str:
        """Hex digest of the track and its truth without times, equal for two equal runs."""
        digest = hashlib.blake2b(digest_size=16)
        for name in _ARRAYS:
            if name not in ("step_ms", "cpu_ms"):
                array = getattr(self, name)
                digest.update(f"{name} {_dtype_name(array.dtype)} {array.shape}\0".encode() + array.tobytes())
        return digest.hexdigest()


_ARRAYS = tuple(field.name for field in fields(Trace))


@cache
def _dtype_name(dtype: np.dtype[Any]) -> str:
    """Return the name of a dtype, cached, since numpy takes half the time of a digest to build it."""
    return str(dtype)
