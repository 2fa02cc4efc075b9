"""`likelihood_pf`: particles drawn from the likelihood, weighed by the motion model, with variants of resampling."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.filters.motion import random_walk_density
from irtrack.filters.particle import Likelihood, mean, normalise, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices
from irtrack.trackers.appearance import RandomWalkParticles
from irtrack.trackers.base import Deviation, VisibilityMonitor
from irtrack.trackers.match_map import MatchMap
from irtrack.trackers.mean_shift import MeanShiftPFState
from irtrack.types import Estimate

MOST_REACH = 25
"""Largest half side of the map, px: beyond it no place is proposed, whatever the radius."""

PENALTY = 10.0
"""Penalty C of the regression's errors; weights are scaled to a maximum of 1."""


class LikelihoodPF(RandomWalkParticles):
    """Particle filter whose particles are drawn from the likelihood and weighed by the motion model.

    Jiang, Yi, Zeng 2011, as named by Li and Li 2014 (reference 3), who say that it degenerates more; only its title is
    available ("likelihood particle filter based on support vector machines resampling"). The filter is that of S.
    Arulampalam, S. Maskell, N. Gordon, T. Clapp, IEEE Trans. Signal Processing 50(2), 2002, section V-C:

        q(x) ~ p(y | x),   w ~ sum_j W_j p(x | x_j)

    Here q is the map of exp((rho - 1) / (2 sigma^2)) over the places within `radius` of the last particles' mean, a
    lattice of 1 px, 25 px at most. The prior is the mixture over all resampled particles, as a draw has no ancestor of
    its own.

    `sampling`: two draws first from a lattice of `coarse` px, then within its cells, where weights take the local
    likelihood over that of the cell (Q. Cheng, P. Bondon, "An efficient two-stage sampling method in particle filter",
    IEEE TAES 48(3), 2012, of which only the title was available): fewer windows, the same target distribution.
    `regressed` resamples from weights regressed over place by a support vector machine, at scattered places, so that
    copies of one particle part; it smooths the posterior. Chosen here: least squares (J. Suykens, J. Vandewalle, Neural
    Processing Letters 9, 1999, eq. 9), a normal kernel as wide as the particles, the penalty.
    """

    source: ClassVar[str] = "Jiang, Yi, Zeng 2011; Arulampalam, Maskell, Gordon, Clapp 2002"

    particles: int = Field(default=100, ge=2, le=1000)
    """N."""
    sampling: Literal["one", "two"] = "one"
    """Stages in which places are drawn: from a lattice of 1 px; or from a coarse one, then within its cells."""
    coarse: Annotated[float, Field(ge=1, le=20)] = 3.0
    """two: side of the coarse lattice, px."""
    regressed: bool = False
    """True: resampling from weights regressed by a support vector machine."""
    scatter: Deviation = 0.5
    """regressed: standard deviation of the scatter of copies, px."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftPFState:
        """Return the initial state: the reference histogram, and a single particle at the box's centre, of weight 1."""
        appearance, reference = self.appearance(frame, box)
        center = np.array([box.cx, box.cy])
        return MeanShiftPFState(appearance, reference, center[None], np.ones(1), center, VisibilityMonitor())

    def step(
        self, state: MeanShiftPFState, frame: Frame, rng: np.random.Generator
    ) -> tuple[MeanShiftPFState, Estimate]:
        """Resample, draw from the map of the likelihood, weigh by the prior, estimate, update the reference."""
        appearance, reference = state.appearance, state.reference
        picture, scale = appearance.view(frame), 1 / (2 * self.sigma_grey**2)
        middle = mean(state.weights, state.positions)
        side = min(self.coarse, self.radius) if self.sampling == "two" else 1.0
        reach = min(max(self.radius, side), MOST_REACH)
        found = MatchMap.of(appearance, picture, middle, reach, side, reference)
        chances = found.softmax(scale)
        origins = state.positions
        cells = np.zeros(self.particles, np.intp)

        def move(ancestors: Indices | None) -> Floats:
            nonlocal origins, cells
            origins = state.positions.take(ancestors, axis=0) if ancestors is not None else state.positions
            if self.regressed and len(state.positions) > 2:
                origins = self.regressed_places(state.positions, state.weights, origins, rng)
            cells = RESAMPLERS["multinomial"](chances, rng, self.particles)
            places: Floats = found.places[cells] + side * (rng.random((self.particles, 2)) - 0.5)
            return places

        def likelihood(places: Floats) -> Likelihood:
            prior = random_walk_density(places, origins, self.radius, self.propagation)
            with np.errstate(divide="ignore"):
                lw = np.log(prior)
            if self.sampling == "one":
                return Likelihood(lw, 1.0, found.rho[cells])
            local = appearance.likelihood(picture, places, reference, scale)
            return Likelihood(lw + scale * (local.lw - found.rho[cells]), 1.0, local.visible)

        step = smc_step(state.weights, lambda W: RESAMPLERS[self.resampling](W, rng, self.particles), move, likelihood)
        center = mean(step.W, step.particles)
        in_view = bool(found.rho.any())
        match = appearance.match(picture, center, reference)
        monitor = self.monitor_after(state.monitor, match, in_view)
        after = MeanShiftPFState(
            appearance=appearance,
            reference=self.updated(reference, match, monitor),
            positions=step.particles,
            weights=step.W,
            center=center,
            monitor=monitor,
        )
        status, velocity = self.status(monitor, in_view), center - state.center
        return after, particle_estimate(step.particles, step.W, center, velocity, appearance.size, status, match.score)

    def regressed_places(self, positions: Floats, W: Floats, copies: Floats, rng: np.random.Generator) -> Floats:
        """Return places (N, 2) px drawn from scattered copies (N, 2) by the weights regressed over place.

        positions (N, 2) px with weights W (N,) are the examples.
        """
        spread = max(float(positions.std(axis=0).max()), 1e-3)

        def kernel(places: Floats) -> Floats:
            squares = ((places[:, None] - positions[None]) ** 2).sum(axis=2)
            values: Floats = np.exp(-squares / (2 * spread**2))
            return values

        n = len(W)
        system = np.ones((n + 1, n + 1))
        system[0, 0] = 0
        system[1:, 1:] = kernel(positions) + np.eye(n) / PENALTY
        solved = np.linalg.solve(system, np.concatenate([[0.0], W / W.max()]))
        scattered = copies + self.scatter * rng.standard_normal(copies.shape)
        smooth = np.maximum(kernel(scattered) @ solved[1:] + solved[0], 0)
        if smooth.sum() <= 0:
            return scattered
        chosen: Floats = scattered[RESAMPLERS["systematic"](normalise(smooth), rng)]
        return chosen
