"""`background_restrained_pf`: a particle filter that keeps to its particles of large weight."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from irsim.config.quantities import Fraction
from irsim.types import Floats
from irtrack.trackers.grey_pf import GreyPF


class BackgroundRestrainedPF(GreyPF):
    """`grey_pf` that estimates from, and draws among, its particles of large weight only.

    G. An, J. Gao, X. Chen, Z. Wu, "Particle filter face tracking algorithm with background
    restraint", J. Southeast University 37(5), 2007, of which a fragment is left. It shows that the mean
    over all particles (its eq. 10b, MMSE) is drawn towards a false target of like appearance: with
    clouds about both of mass W and 1 - W, by W_false (X_false - X_true). The heaviest particle (eq.
    10a, MAP) is good where there are many particles and little noise. Its remedy is the mean over "a
    suitable number" of the heaviest, within which particles are drawn as well. The share kept, and the
    filter around it, are open: here that of Cheng et al. 2006. With keep = 1 it is that filter. Two
    modes equally good both stay among the heaviest.
    """

    source: ClassVar[str] = "An, Gao, Chen, Wu 2007"

    keep: Fraction = 0.3
    """Share of the particles that is kept, the heaviest first; one at least. Not printed."""
    keep_by: Literal["count", "mass"] = "count"
    """Whether the share is of their number (the source's) or of their weight."""
    estimate: Literal["restrained", "mean", "map"] = "restrained"
    """The mean over the particles kept; over all (eq. 10b); or the heaviest (eq. 10a)."""

    def restrained(self, weights: Floats) -> Floats:
        """Weights (N,) of the particles kept, summing to one; 0 for the others."""
        if self.keep == 1:
            return weights
        order = np.argsort(-weights, kind="stable")
        if self.keep_by == "count":
            kept = max(round(self.keep * len(weights)), 1)
        else:
            kept = int(np.searchsorted(weights[order].cumsum(), self.keep)) + 1
        restrained: Floats = np.zeros(len(weights))
        restrained[order[:kept]] = weights[order[:kept]]
        restrained /= restrained.sum()
        return restrained

    def pointing(self, weights: Floats, restrained: Floats) -> Floats:
        """(N,) what each particle's place counts in the estimate."""
        if self.estimate == "restrained":
            return restrained
        if self.estimate == "mean":
            return weights
        heaviest: Floats = np.zeros(len(weights))
        heaviest[weights.argmax()] = 1.0
        return heaviest
