"""`grey_pf`: the particle filter on grey histograms of Cheng, Zhou, Cai and Yang 2006; `background_restrained_pf`."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.filters.motion import ar2
from irtrack.filters.particle import (
    equal_weights,
    ess,
    ess_count,
    kld_count,
    mean,
    normalise,
    particle_estimate,
    smc_step,
)
from irtrack.filters.resampling import RESAMPLERS, Indices, Resampling
from irtrack.trackers.appearance import Appearance, GreyTracker, blend
from irtrack.trackers.base import Deviation, Ratio, Spread, VisibilityMonitor
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class GreyPFState:
    """State: `positions` and `previous` (N, 2) px, in this and the previous frame; weights and distances D (N,).

    wide   share of the particles that the second group has in the next frame
    """

    appearance: Appearance
    reference: Floats
    positions: Floats
    previous: Floats
    weights: Floats
    distances: Floats
    monitor: VisibilityMonitor
    wide: float = 0.5


class GreyPF(GreyTracker):
    """Particle filter on the kernel-weighted grey histogram, second-order motion, adaptive noise.

    J. Cheng, Y. Zhou, N. Cai, J. Yang, "Infrared object tracking based on particle filters",
    J. Infrared Millim. Waves 25(2), 2006. A step is the paper's section 2.3: resample, move by
    eq. 4, weigh by eq. 10, estimate by eq. 3; then the reference is updated by eq. 13.

    The text leaves further choices: the pair (x_t, x_{t-1}) is resampled by one index; before the first distances are
    known R is Rmin; R is computed for each particle, though eq. 11 and 12 print one R_t.

    Chosen here, as the paper leaves them open, and not tuned to a scene: R0, Rmin, Rmax, w_T, alpha; the first
    particles (normal in place and speed); the grey range (fitted to the first frame). The scale of the kernel (eq. 6
    says "size of the target's area", section 3 gives sizes of (14, 10)), lambda (20 or 40 would fit) and alpha come
    from a search on development seeds. `w_t` is a threshold on rho of eq. 8; without a value the
    reference is updated while the status is tracking (see `irtrack.trackers.base.VisibilityMonitor`). The text calls R
    a variance, but U = R U0 with U0 standard normal makes it a standard deviation, px. A histogram is taken at the
    nearest whole pixel. The size stays that of the start box.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006"

    particles: int = Field(default=100, ge=2, le=1_000_000)
    """N, number of particles (section 3: 100)."""
    lam: Ratio = 20.0
    """lambda of eq. 10 (section 2.2.2: 20)."""
    noise: Literal["adaptive", "fixed"] = "adaptive"
    """R of each particle by eq. 12, or R = r0 for all."""
    r0: Deviation = 10.0
    """R0 of eq. 12, px per unit of Bhattacharyya distance; with fixed noise R itself, px."""
    r_min: Spread = 0.5
    """Rmin of eq. 12, px."""
    r_max: Deviation | None = None
    """Rmax of eq. 12, px; by default half the mean side of the start box, sqrt(w h) / 2."""
    damping: Fraction = 1.0
    """Factor of the last displacement in eq. 4; 1 in the paper."""
    resampling: Resampling = "multinomial"
    """Resampling scheme (section 2.3, step 2: multinomial by cumulative weights)."""
    update: bool = True
    """True: the reference is updated (eq. 13)."""
    alpha: Fraction = 0.1
    """alpha of eq. 13; the paper says only: small. Found by search on development seeds."""
    w_t: Fraction | None = None
    """w_T, least rho at the estimate for an update of the reference; by default the status decides."""
    start_sd: Spread = 1.0
    """Standard deviation of the first particles on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    groups: Literal["one", "two"] = "one"
    """two: the last particles form a second group, whose places walk by `wide_sd` and whose speed is unknown; the share
    of each group follows its mean likelihood (An et al. 2007, reference 3, of which only "two groups of particles" is
    known)."""
    wide_sd: Deviation = 6.0
    """two: standard deviation of the second group's walk on each axis, px."""
    wide_least: Annotated[float, Field(ge=0.01, le=0.49)] = 0.1
    """two: least share of either group."""
    adapt: Literal["none", "kld", "neff"] = "none"
    """Number of particles in a frame: always N; by KLD-sampling; or so that the effective sample size stays at
    `neff_wanted`; N at most. The paper calls for an adaptive number (sections 3, 4) and gives no method."""
    n_min: int = Field(default=20, ge=2, le=1_000_000)
    """kld, neff: least number of particles."""
    kld_cell: Ratio = 2.0
    """kld: side of the cells in which particles are counted, px."""
    kld_epsilon: Ratio = 0.15
    """kld: bound of the Kullback-Leibler distance."""
    kld_z: Annotated[float, Field(ge=0, le=6)] = 2.326
    """kld: normal quantile of the probability of keeping the bound; 2.326: 99 %."""
    neff_wanted: Ratio = 50.0
    """neff: effective sample size to hold."""

    @model_validator(mode="after")
    def _ordered(self) -> GreyPF:
        if self.r_max is not None and self.r_max < self.r_min:
            raise ValueError(f"r_max {self.r_max} is below r_min {self.r_min}")
        if self.groups == "two" and self.adapt == "kld":
            raise ValueError("groups two and adapt kld: kld counts particles of one group")
        return self

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> GreyPFState:
        """Return the reference histogram and particles of equal weights about the box's centre."""
        appearance, reference = self.appearance(frame, box)
        positions = np.array([box.cx, box.cy]) + self.start_sd * rng.standard_normal((self.particles, 2))
        return GreyPFState(
            appearance=appearance,
            reference=reference,
            positions=positions,
            previous=positions - self.start_speed_sd * rng.standard_normal((self.particles, 2)),
            weights=equal_weights(self.particles),
            distances=np.zeros(self.particles),
            monitor=VisibilityMonitor(),
        )

    def step(self, state: GreyPFState, frame: Frame, rng: np.random.Generator) -> tuple[GreyPFState, Estimate]:
        """Resample, move, weigh, estimate, update the reference."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.view(frame)
        previous: Floats = state.positions

        def move(ancestors: Indices | None) -> Floats:
            nonlocal previous
            assert ancestors is not None
            if self.adapt == "kld" or self.groups == "two":
                ancestors = rng.permutation(ancestors)  # random order, so that the first n are a random sample
            deviation = self.deviation(state.distances.take(ancestors), appearance.size)
            positions, previous = ar2(state.positions, state.previous, ancestors, self.damping, deviation, rng)
            if self.groups == "two":
                wide = slice(self._narrow(len(positions), state.wide), None)
                previous = previous.copy()
                positions[wide] = previous[wide] + self.wide_sd * rng.standard_normal(positions[wide].shape)
                previous[wide] = positions[wide] - self.start_speed_sd * rng.standard_normal(positions[wide].shape)
            if self.adapt == "kld":
                count = kld_count(positions, self.n_min, self.kld_cell, self.kld_epsilon, self.kld_z)
                positions, previous = positions[:count], previous[:count]
            return positions

        step = smc_step(
            state.weights,
            lambda W: RESAMPLERS[self.resampling](W, rng, self._count(W)),
            move,
            lambda positions: appearance.likelihood(picture, positions, reference, self.lam / 2),
        )
        W = self.truncated_weights(step.W)
        estimator = self.estimator_weights(step.W, W)
        center, velocity = mean(estimator, step.particles), mean(estimator, step.particles - previous)
        match = appearance.match(picture, center, reference)
        monitor = self.monitor_after(state.monitor, match, step.in_view)
        trusted = monitor.misses == 0 if self.w_t is None else match.score > self.w_t
        after = GreyPFState(
            appearance=appearance,
            reference=blend(reference, match, self.alpha) if self.update and trusted else reference,
            positions=step.particles,
            previous=previous,
            weights=W,
            distances=np.sqrt(1 - step.likelihood.lw),
            monitor=monitor,
            wide=self.wide_share(step.W, state.wide) if self.groups == "two" else state.wide,
        )
        status = self.status(monitor, step.in_view)
        stated = self.spread_weights(step.W, W)
        return after, particle_estimate(step.particles, stated, center, velocity, appearance.size, status, match.score)

    def truncated_weights(self, W: Floats) -> Floats:
        """Return the weights (N,) for estimation and resampling, in this class those of all particles."""
        return W

    def estimator_weights(self, W: Floats, truncated: Floats) -> Floats:
        """Return the weights (N,) of positions in the estimate, in this class those of all particles (eq. 3)."""
        return W

    def spread_weights(self, W: Floats, truncated: Floats) -> Floats:
        """Return the weights (N,) of the estimate's covariance and Neff, in this class those of all particles."""
        return W

    def deviation(self, distances: Floats, size: tuple[float, float]) -> Floats:
        """Return R of each particle (N,), px: max(min(R0 D, Rmax), Rmin) (eq. 12), or r0 for all."""
        if self.noise == "fixed":
            return np.full(len(distances), self.r0)
        r_max = sqrt(size[0] * size[1]) / 2 if self.r_max is None else self.r_max
        clipped: Floats = np.maximum(np.minimum(self.r0 * distances, r_max), self.r_min)
        return clipped

    def _narrow(self, count: int, share: float) -> int:
        """Return the number of particles of the first group."""
        return min(max(count - round(share * count), 1), count - 1)

    def wide_share(self, W: Floats, share: float) -> float:
        """Return the share of the second group after a frame: its mean weight over the sum of both means."""
        narrow = self._narrow(len(W), share)
        means = float(W[:narrow].mean()), float(W[narrow:].mean())
        return min(max(means[1] / (means[0] + means[1]), self.wide_least), 1 - self.wide_least)

    def _count(self, W: Floats) -> int:
        if self.adapt != "neff":
            return self.particles
        return ess_count(len(W), float(ess(W)), self.neff_wanted, self.n_min, self.particles)


class BackgroundRestrainedPF(GreyPF):
    """`grey_pf` with estimate and resampling restricted to its particles of largest weight.

    G. An, J. Gao, X. Chen, Z. Wu, "Particle filter face tracking algorithm with background
    restraint", J. Southeast University 37(5), 2007, of which a fragment is available. The paper shows that the mean
    over all particles (eq. 10b, MMSE) is biased towards a false target of similar appearance, by W_false (X_false -
    X_true), where W_false is the total weight of the particles about the false target. The particle of largest weight
    (eq. 10a, MAP) is good with many particles and little noise. The remedy is to estimate from, and to resample, "a
    suitable number" of the particles of largest weight. The share kept and the filter are open: here the filter is that
    of Cheng et al. 2006. `keep` = 1 gives this filter without restraint; `estimate` = mean does not, since it still
    resamples only the particles kept. Two equally good modes are both kept.
    """

    source: ClassVar[str] = "An, Gao, Chen, Wu 2007"

    keep: Fraction = 0.3
    """Share of the particles that is kept, those of largest weight first; at least one particle. The paper prints no
    value."""
    keep_by: Literal["count", "mass"] = "count"
    """Meaning of `keep`: a share of the number of particles (as in the paper) or of their total weight."""
    estimate: Literal["restrained", "mean", "map"] = "restrained"
    """Estimate: the mean over the particles kept; the mean over all (eq. 10b); or the particle of largest weight (eq.
    10a)."""

    def truncated_weights(self, W: Floats) -> Floats:
        """Return the weights (N,) of the particles kept, summing to one; 0 for the others."""
        if self.keep == 1:
            return W
        order = np.argsort(-W, kind="stable")
        if self.keep_by == "count":
            kept = max(round(self.keep * len(W)), 1)
        else:
            kept = int(np.searchsorted(W[order].cumsum(), self.keep)) + 1
        truncated: Floats = np.zeros(len(W))
        truncated[order[:kept]] = W[order[:kept]]
        return normalise(truncated)

    def estimator_weights(self, W: Floats, truncated: Floats) -> Floats:
        """Return the weights (N,) of particle positions in the estimate, by `estimate`."""
        if self.estimate != "map":
            return truncated if self.estimate == "restrained" else W
        heaviest: Floats = np.zeros(len(W))
        heaviest[W.argmax()] = 1.0
        return heaviest

    def spread_weights(self, W: Floats, truncated: Floats) -> Floats:
        """Return the weights (N,) of the covariance and Neff: of the particles kept for the restrained mean, else of
        all."""
        return truncated if self.estimate == "restrained" else W
