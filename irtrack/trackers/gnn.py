"""`gnn`: global nearest neighbours, one assignment of detections to tracks a frame."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.filters.data_association import nearest_neighbours
from irtrack.filters.multiple_model import States, update
from irtrack.trackers.multi_target import OneHypothesisTracker, TrackTable, updated_table
from irtrack.types import Detections


class GNN(OneHypothesisTracker):
    """Global nearest neighbours: each detection is assigned to at most one track, with the largest joint likelihood.

    S. Blackman, R. Popoli 1999, section 6.4; assignment by scipy's `linear_sum_assignment`.
    """

    source: ClassVar[str] = "Blackman, Popoli 1999"

    def associate(
        self, tracks: TrackTable, found: Detections, ratios: Floats
    ) -> tuple[TrackTable, npt.NDArray[np.int64]]:
        pairs = nearest_neighbours(ratios)
        rows, columns = pairs[:, 0], pairs[:, 1]
        after = update(tracks.states.take(rows), found.centers[columns], self.noise)
        mean, covariance, probability = (
            np.array(getattr(tracks.states, name)) for name in ("mean", "covariance", "probability")
        )
        mean[rows], covariance[rows], probability[rows] = after.mean, after.covariance, after.probability
        hit = np.zeros(len(tracks), bool)
        hit[rows] = True
        level, size = tracks.level.copy(), tracks.size.copy()
        level[rows], size[rows] = found.scores[columns], found.sizes[columns]
        free = np.ones(len(found), bool)
        free[columns] = False
        table = updated_table(tracks, States(mean, covariance, probability), hit, level, size)
        return table, np.flatnonzero(free)
