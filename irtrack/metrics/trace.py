"""What a track is scored against: the truth of one target as arrays."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import Any

import numpy as np

from irsim.types import SHOWN, Floats, Truth
from irtrack.metrics.attributes import ATTRIBUTES, marks
from irtrack.metrics.centre_error import centre_errors
from irtrack.metrics.longterm import LongTerm, long_term
from irtrack.metrics.lost import loss, off_frames
from irtrack.metrics.overlap import overlaps, widened
from irtrack.metrics.status import Return, returns
from irtrack.types import Track


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """The truth of one target, frame by frame.

    indices   (n,) frame indices, rising
    centers   (n, 2) px and sizes (n, 2) px; nan in frames where the target is absent
    visible   (n,) fraction 0..1, nan where it is not known
    accuracy  (n,) px: how far a centre may be off
    marks     (n, len(ATTRIBUTES)) bool, see `irtrack.metrics.attributes`

    Rule for absent frames: where a target has no truth, or its centre is out of the frame, there is
    nothing to point at; such frames enter no error, no overlap and no count towards the loss.
    """

    indices: np.ndarray
    centers: Floats
    sizes: Floats
    visible: Floats
    accuracy: Floats
    marks: np.ndarray

    @classmethod
    def of(cls, truths: Iterable[Truth], target: str | None) -> Reference:
        """The truth of the target of that id; nothing is present where `target` is None."""
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
        """The reference at these frame indices; frames that it does not know count as absent."""
        indices = np.asarray(indices, dtype=np.int64)
        if np.array_equal(indices, self.indices):
            return self
        known = np.isin(indices, self.indices)
        place = np.searchsorted(self.indices, indices[known])
        unknown = np.full(len(indices), np.nan)
        centers, sizes = np.column_stack([unknown, unknown]), np.column_stack([unknown, unknown])
        visible, accuracy = unknown.copy(), np.zeros(len(indices))
        centers[known], sizes[known] = self.centers[place], self.sizes[place]
        visible[known], accuracy[known] = self.visible[place], self.accuracy[place]
        marked = np.zeros((len(indices), len(ATTRIBUTES)), dtype=bool)
        marked[known] = self.marks[place]
        return Reference(indices, centers, sizes, visible, accuracy, marked)

    @property
    def present(self) -> np.ndarray:
        """(n,) bool: is there something to point at?"""
        return np.asarray(np.isfinite(self.centers).all(axis=1))

    @property
    def shown(self) -> np.ndarray:
        """(n,) bool: present and at least `SHOWN` of it visible; unknown visibility counts as visible."""
        return np.asarray(self.present & ~(self.visible < SHOWN))

    @property
    def diagonals(self) -> Floats:
        """(n,) px: the diagonal of the truth's box."""
        return np.asarray(np.hypot(self.sizes[:, 0], self.sizes[:, 1]))


@dataclass(frozen=True, eq=False)
class Trace:
    """A track and the truth of its target at the same n frames; the first is the start, given to the tracker.

    indices        (n,) frame indices
    centers, sizes (n, 2) px of the tracker;  statuses (n,) its words
    scores         (n,) of the tracker's own scale;  neffs (n,);  covariances (n, 2, 2) px^2; nan where it says none
    truth_centers, truth_sizes   (n, 2) px; nan where there is nothing to point at (see `Reference`)
    visible        (n,) fraction 0..1, nan where unknown
    accuracy       (n,) px, see `irsim.types.TargetTruth`
    marks          (n, len(ATTRIBUTES)) bool: what makes each frame hard, see `irtrack.metrics.attributes`
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
        """`reference` may hold any frames; those that the track has not seen are left out."""
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
        """Its first n frames: what the trace would be, had the source ended there."""
        return replace(self, **{name: getattr(self, name)[:n] for name in _ARRAYS})

    def same_as(self, other: Trace) -> bool:
        """Is every number of the two the same, bit for bit, times aside?"""
        return self.digest == other.digest

    @cached_property
    def truth(self) -> Reference:
        """What is true at these frames."""
        return Reference(self.indices, self.truth_centers, self.truth_sizes, self.visible, self.accuracy, self.marks)

    @cached_property
    def offsets(self) -> Floats:
        """(n, 2) px: centre less true centre."""
        return np.asarray(self.centers - self.truth_centers)

    @cached_property
    def errors(self) -> Floats:
        """(n,) px: centre error, nan where there is nothing to point at."""
        return centre_errors(self.centers, self.truth_centers)

    @cached_property
    def overlaps(self) -> Floats:
        """(n,) overlap of the boxes, each at least `irtrack.types.LEAST_PX` wide and high; nan as above."""
        return overlaps(self.centers, widened(self.sizes), self.truth_centers, widened(self.truth_sizes))

    @cached_property
    def scored(self) -> np.ndarray:
        """(n,) bool: frames after the start in which the target is present."""
        present = self.truth.present
        present[:1] = False
        return present

    @cached_property
    def counted(self) -> np.ndarray:
        """(n,) bool: scored frames in which it is visible, as `irsim.types.SHOWN` says."""
        return np.asarray(self.scored & self.truth.shown)

    @cached_property
    def off(self) -> np.ndarray:
        """(n,) bool: frames that are off (see `irtrack.metrics.lost.LOSS_RULE`)."""
        return off_frames(self.errors, self.truth.diagonals, self.accuracy)

    @cached_property
    def lost_position(self) -> int | None:
        """Position of the frame that the loss is dated to; None where the track is not lost."""
        return loss(self.off, self.counted)

    @cached_property
    def held(self) -> np.ndarray:
        """(n,) bool: the scored frames before the loss; all of them where there is none."""
        held = self.scored.copy()
        if self.lost_position is not None:
            held[self.lost_position :] = False
        return held

    @cached_property
    def returns(self) -> list[Return]:
        """Every time that the target comes back into sight."""
        return returns(self.off, self.truth.shown)

    @cached_property
    def long_term(self) -> LongTerm:
        """Precision, recall and F of all frames but the start, the score being the confidence.

        The target is present where something of it is to be seen; the tracker points at something unless it
        says "lost". A tracker without scores has one threshold.
        """
        confidence = np.where(self.statuses == "lost", np.nan, np.where(np.isnan(self.scores), 0.0, self.scores))
        present = self.truth.present & ~(self.visible == 0)
        return long_term(self.overlaps[1:], confidence[1:], present[1:])

    @property
    def digest(self) -> str:
        """Hex digest of the track and its truth, times aside: two runs that have it in common did the same."""
        digest = hashlib.blake2b(digest_size=16)
        for name in _ARRAYS:
            if name not in ("step_ms", "cpu_ms"):
                array = getattr(self, name)
                digest.update(f"{name} {_words(array.dtype)} {array.shape}\0".encode() + array.tobytes())
        return digest.hexdigest()


_ARRAYS = tuple(field.name for field in fields(Trace))


@cache
def _words(dtype: np.dtype[Any]) -> str:
    """A dtype's name, which numpy puts together anew each time: half of what a short track's digest would take."""
    return str(dtype)
