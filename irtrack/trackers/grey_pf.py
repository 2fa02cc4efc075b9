"""`grey_pf`: the particle filter on grey distributions of Cheng, Zhou, Cai and Yang 2006."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot, sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from irsim.kinds import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.histogram import Surround, bhattacharyya, gaussian_kernel, histogram, likeness
from irtrack.features.quantise import BinsRange, Quantiser, quantiser
from irtrack.features.window import Window
from irtrack.filters import particles as cloud
from irtrack.filters.motion import ar2
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.trackers.base import Deviation, Footage, Ratio, Sight, Spread, TrackerPart, footage, start_window
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What the first frame sets for good: the frame's kind, the target's size, windows, grey range."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    kernel: Floats
    surround: Surround
    quantiser: Quantiser


@dataclass(frozen=True, slots=True, eq=False)
class GreyPFState:
    """positions, previous (N, 2) px of this frame and the one before; weights, distances D (N,)."""

    start: Start
    reference: Floats
    positions: Floats
    previous: Floats
    weights: Floats
    distances: Floats
    sight: Sight


class GreyPF(TrackerPart):
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
    bins: int = Field(default=32, ge=2, le=256)
    """B, grey levels of the histogram (section 3: 32; section 2.2.1 names 16 as well)."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame, kept; or the full range of the bits."""
    kernel_scale: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    """Multiplies h = sqrt(hx^2 + hy^2) of eq. 6; 1: hx, hy are full sizes, 0.5: half ones."""
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
    ring: Annotated[float, Field(ge=0.1, le=10)] = 0.5
    """Width of the ring around the target that its likeness is judged against, in sides of the window;
    at 0.5 the ring has three times the window's area, enough pixels for a steady histogram."""
    seen: Fraction = 0.5
    """Share of the way from the surrounding ring's rho to the target's usual one that counts as seen."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without sight after which the status is lost."""

    @model_validator(mode="after")
    def _ordered(self) -> GreyPF:
        if self.r_max is not None and self.r_max < self.r_min:
            raise ValueError(f"r_max {self.r_max} is below r_min {self.r_min}")
        return self

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> GreyPFState:
        """The reference histogram and a cloud of equal weights about the box's centre."""
        part, corner = start_window(frame, box)
        window = Window.of(box)
        size = (box.w, box.h)
        kernel = gaussian_kernel(window, self.kernel_scale * hypot(*size))
        levels = quantiser(frame, part.cut(frame.image, corner), self.bins, self.bins_range)
        reference, _ = histogram(frame.image, (box.cx, box.cy), window, kernel, levels)
        positions = np.array([box.cx, box.cy]) + self.start_sd * rng.standard_normal((self.particles, 2))
        margin = (ceil(self.ring * window.columns), ceil(self.ring * window.rows))
        return GreyPFState(
            start=Start(footage(frame), size, window, kernel, Surround.of(window, kernel, margin), levels),
            reference=reference,
            positions=positions,
            previous=positions - self.start_speed_sd * rng.standard_normal((self.particles, 2)),
            weights=np.full(self.particles, 1 / self.particles),
            distances=np.zeros(self.particles),
            sight=Sight(),
        )

    def step(self, state: GreyPFState, frame: Frame, rng: np.random.Generator) -> tuple[GreyPFState, Estimate]:
        """Resample, move, weigh, estimate, update the reference."""
        start = state.start
        start.footage.check(frame)
        chosen = RESAMPLERS[self.resampling](state.weights, rng)
        previous = state.positions.take(chosen, axis=0)
        noise = self.deviation(state.distances[chosen], start.size)[:, None] * rng.standard_normal(previous.shape)
        positions = ar2(previous, state.previous.take(chosen, axis=0), self.damping, noise)

        rho, visible = likeness(frame.image, positions, start.window, start.kernel, start.quantiser, state.reference)
        weights, in_view = weigh(rho, visible, self.lam)
        center = cloud.mean(weights, positions)
        velocity = cloud.mean(weights, positions - previous)
        x, y = center.tolist()
        histograms, shown = start.surround.histograms(frame.image, (x, y), start.quantiser)
        # As in `likeness`, what is cut off by the frame's edge counts against the estimate.
        score, floor = (bhattacharyya(histograms, state.reference) * (shown[0], 1.0)).tolist()
        sight = state.sight.after(score, floor, self.seen) if in_view else state.sight.unseen()

        after = GreyPFState(
            start=start,
            reference=self._updated(state.reference, histograms[0], score, sight),
            positions=positions,
            previous=previous,
            weights=weights,
            distances=np.sqrt(1 - rho),
            sight=sight,
        )
        return after, Estimate(
            center=(x, y),
            size=start.size,
            status=sight.status(self.lost_after) if in_view else "lost",
            score=score,
            velocity=(float(velocity[0]), float(velocity[1])),
            covariance=cloud.covariance(weights, positions, center),
            neff=cloud.neff(weights),
            particles=positions,
            weights=weights,
        )

    def deviation(self, distances: Floats, size: tuple[float, float]) -> Floats:
        """(N,) R of each particle, px: max(min(R0 D, Rmax), Rmin) (eq. 12), or r0 for all."""
        if self.noise == "fixed":
            return np.full(len(distances), self.r0)
        r_max = sqrt(size[0] * size[1]) / 2 if self.r_max is None else self.r_max
        clipped: Floats = np.maximum(np.minimum(self.r0 * distances, r_max), self.r_min)
        return clipped

    def _updated(self, reference: Floats, now: Floats, score: float, sight: Sight) -> Floats:
        """q <- (1 - alpha) q + alpha p(estimate) where the estimate is trusted (eq. 13)."""
        trusted = sight.missed == 0 if self.w_t is None else score > self.w_t
        return (1 - self.alpha) * reference + self.alpha * now if self.update and trusted and score > 0 else reference


def weigh(rho: Floats, visible: Floats, lam: float) -> tuple[Floats, bool]:
    """Weights (N,) of eq. 10, exp(-lambda D^2 / 2), summing to one, and whether any window is in view.

    With D^2 = 1 - rho. The constant 1 / sqrt(2 pi) cancels, and so does the largest weight, which
    keeps a large lambda from underflow. A window wholly outside the frame weighs nothing; all
    outside: equal weights.
    """
    weights = np.exp(lam / 2 * (rho - rho.max())) * (visible > 0)
    total = weights.sum()
    if total == 0:
        return np.full(len(rho), 1 / len(rho)), False
    return weights / total, True
