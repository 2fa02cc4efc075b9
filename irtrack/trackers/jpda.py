"""`jpda`: joint probabilistic data association, each track updated by all detections in its gate."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.filters.data_association import joint_probabilities
from irtrack.filters.multiple_model import update_mixture
from irtrack.trackers.multi_target import OneHypothesisTracker, TrackTable, updated_table
from irtrack.types import Detections


class JPDA(OneHypothesisTracker):
    """Joint probabilistic data association: each track is updated by all detections in its gate, by probability.

    T. Fortmann, Y. Bar-Shalom, M. Scheffe 1983; exact in clusters of up to 10,000 joint events, above that R.
    Fitzgerald's weights (1986). A frame counts as a hit where the detections' probabilities for the track sum to more
    than one half.
    """

    source: ClassVar[str] = "Fortmann, Bar-Shalom, Scheffe 1983"

    def associate(
        self, tracks: TrackTable, found: Detections, ratios: Floats
    ) -> tuple[TrackTable, npt.NDArray[np.int64]]:
        beta = joint_probabilities(ratios)
        own = beta.sum(axis=1)
        states = update_mixture(tracks.states, found.centers, self.noise, beta)
        share = beta / np.maximum(own, 1e-300)[:, None]
        table = updated_table(tracks, states, own > 0.5, share @ found.scores, share @ found.sizes)
        return table, np.flatnonzero(beta.sum(axis=0) < 0.5)
