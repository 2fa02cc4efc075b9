"""`grey_pf`: the particle filter on grey distributions of Cheng, Zhou, Cai and Yang 2006."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.histogram import Judged
from irtrack.filters import particle as cloud
from irtrack.filters.adaptive import kld_count, neff_count
from irtrack.filters.motion import ar2_drawn
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.trackers.base import Deviation, Ratio, Sight, Spread
from irtrack.trackers.grey import Appearance, GreyPart, Seen, blend, weigh
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class GreyPFState:
    """positions, previous (N, 2) px of this frame and the one before; weights, distances D (N,)."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    previous: Floats
    weights: Floats
    distances: Floats
    sight: Sight


class GreyPF(GreyPart):
    """Particle filter on the kernel-weighted grey histogram, second-order motion, adaptive noise.

    J. Cheng, Y. Zhou, N. Cai, J. Yang, "Infrared object tracking based on particle filters",
    J. Infrared Millim. Waves 25(2), 2006. A step is the paper's section 2.3: resample, move by
    eq. 4, weigh by eq. 10, estimate by eq. 3; then the reference is updated by eq. 13.

    What the paper leaves open, and what is chosen here: the values of R0, Rmin, Rmax, w_T, alpha;
    the first cloud (normal in place and speed); the scale of the kernel (eq. 6 says "size of the
    target's area", section 3 calls (14, 10) the sizes; here half sizes); the grey range (fitted to
    the first frame). None of these is tuned to a scene. On the shipped examples sky and ground a
    narrower kernel and a slower update (kernel_scale 0.25, alpha 0.02) were seen to point better:
    with half sizes the kernel is still .61 at the window's corner, with quarters .14. That is a
    variant, and no measurement of it elsewhere stands behind it. w_T stands on rho of eq. 8, and
    without a value follows the same calibrated threshold as the status (see
    `irtrack.trackers.base.Sight`). The text calls R a variance, but U = R U0 with U0 standard normal
    makes it a standard deviation, px. A histogram is taken at the whole pixel nearest to a particle.
    The size stays that of the start box.
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
    """Rmax of eq. 12, px; without a value half the mean side of the start box, sqrt(w h) / 2."""
    damping: Fraction = 1.0
    """Factor of the last displacement in eq. 4; the paper's is 1."""
    resampling: Resampling = "multinomial"
    """How particles are drawn (section 2.3, step 2: multinomial by cumulative weights)."""
    update: bool = True
    """Whether the reference follows the target (eq. 13)."""
    alpha: Fraction = 0.05
    """alpha of eq. 13; the paper says only: small."""
    w_t: Fraction | None = None
    """w_T, the rho at the estimate from which on the reference is updated; see above."""
    start_sd: Spread = 1.0
    """Spread of the first cloud on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Spread of the first cloud's speed on each axis, px per frame."""
    adapt: Literal["none", "kld", "neff"] = "none"
    """Number of particles in a frame, N at most: N; by KLD-sampling; or so that Neff stays at `neff_wanted`. The
    paper calls for it (sections 3, 4) and gives none."""
    n_min: int = Field(default=20, ge=2, le=1_000_000)
    """kld, neff: least number of particles."""
    kld_cell: Ratio = 2.0
    """kld: side of the cells in which particles are counted, px."""
    kld_epsilon: Ratio = 0.15
    """kld: bound of the Kullback-Leibler distance."""
    kld_z: Annotated[float, Field(ge=0, le=6)] = 2.326
    """kld: normal quantile of the probability of keeping the bound; 2.326: 99 %."""
    neff_wanted: Ratio = 50.0
    """neff: the effective number of particles asked for."""

    @model_validator(mode="after")
    def _ordered(self) -> GreyPF:
        if self.r_max is not None and self.r_max < self.r_min:
            raise ValueError(f"r_max {self.r_max} is below r_min {self.r_min}")
        return self

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> GreyPFState:
        """The reference histogram and a cloud of equal weights about the box's centre."""
        appearance, reference = self.look(frame, box)
        positions = np.array([box.cx, box.cy]) + self.start_sd * rng.standard_normal((self.particles, 2))
        return GreyPFState(
            appearance=appearance,
            reference=reference,
            positions=positions,
            previous=positions - self.start_speed_sd * rng.standard_normal((self.particles, 2)),
            weights=np.full(self.particles, 1 / self.particles),
            distances=np.zeros(self.particles),
            sight=Sight(),
        )

    def step(self, state: GreyPFState, frame: Frame, rng: np.random.Generator) -> tuple[GreyPFState, Estimate]:
        """Resample, move, weigh, estimate, update the reference."""
        appearance = state.appearance
        picture = appearance.view(frame)
        positions, previous = self._moved(state, rng)
        rho, visible = appearance.likeness(picture, positions, state.reference)
        weights, in_view = weigh(rho, visible, self.lam / 2)
        restrained = self.restrained(weights)
        share = self.pointing(weights, restrained)
        center, velocity = cloud.mean(share, positions), cloud.mean(share, positions - previous)
        judged = appearance.judge(picture, (float(center[0]), float(center[1])), state.reference)
        sight = self.sight_after(state.sight, judged, in_view)
        after = GreyPFState(
            appearance=appearance,
            reference=self._updated(state.reference, judged, sight),
            positions=positions,
            previous=previous,
            weights=restrained,
            distances=np.sqrt(1 - rho),
            sight=sight,
        )
        return after, self.of_cloud(Seen(appearance, judged, sight, in_view), positions, restrained, center, velocity)

    def restrained(self, weights: Floats) -> Floats:
        """Weights (N,) that estimate and are drawn from; here all."""
        return weights

    def pointing(self, weights: Floats, restrained: Floats) -> Floats:
        """(N,) what each particle's place counts in the estimate; here all their weights (eq. 3)."""
        return weights

    def _moved(self, state: GreyPFState, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """The particles drawn and moved by eq. 4 (n, 2), and where they come from."""
        count = self.particles
        if self.adapt == "neff":
            neff = float(cloud.neff(state.weights))
            count = neff_count(len(state.weights), neff, self.neff_wanted, self.n_min, count)
        chosen = RESAMPLERS[self.resampling](state.weights, rng, count)
        if self.adapt == "kld":
            chosen = rng.permutation(chosen)  # so that the first n are a fair sample, too
        deviation = self.deviation(state.distances.take(chosen), state.appearance.size)
        positions, previous = ar2_drawn(state.positions, state.previous, chosen, self.damping, deviation, rng)
        if self.adapt == "kld":
            count = kld_count(positions, self.n_min, self.kld_cell, self.kld_epsilon, self.kld_z)
        return positions[:count], previous[:count]

    def deviation(self, distances: Floats, size: tuple[float, float]) -> Floats:
        """(N,) R of each particle, px: max(min(R0 D, Rmax), Rmin) (eq. 12), or r0 for all."""
        if self.noise == "fixed":
            return np.full(len(distances), self.r0)
        r_max = sqrt(size[0] * size[1]) / 2 if self.r_max is None else self.r_max
        clipped: Floats = np.maximum(np.minimum(self.r0 * distances, r_max), self.r_min)
        return clipped

    def _updated(self, reference: Floats, judged: Judged, sight: Sight) -> Floats:
        """q <- (1 - alpha) q + alpha p(estimate) where the estimate is trusted (eq. 13)."""
        trusted = sight.missed == 0 if self.w_t is None else judged.score > self.w_t
        return blend(reference, judged, self.alpha) if self.update and trusted else reference
