"""What a track is scored against: the truth of one target as arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from irsim.types import SHOWN, Floats, Truth
from irtrack.metrics.attributes import ATTRIBUTES, marks


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
