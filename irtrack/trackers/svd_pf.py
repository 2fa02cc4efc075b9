"""`svd_pf`: small targets detected in a suppressed background within a particle filter's window."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.svd import Residual, candidates, largest_parts, standardised
from irtrack.filters.particle import Likelihood, Weights, covariance, equal_weights, mean, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.trackers.base import (
    Deviation,
    Footage,
    MonitoredTracker,
    Ratio,
    Spread,
    VisibilityMonitor,
    footage,
    start_window,
)
from irtrack.types import Estimate

MOST_CANDIDATES = 100
"""Largest number of candidates in a frame; the highest are taken."""
MOST_COMPONENTS = 10
"""Largest number of components tried where `components` is not given."""
LARGEST_PX = 31
"""Largest side over which a residual is averaged, px, as the method is for small targets."""
POINT = (3, 3)
"""Size (w, h) of the image of a point target, px; an average over its larger box would hide the target."""
SHARPEST = 4.0
"""pf: largest expected z of a target, so that one bright pixel does not attract all particles."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Settings taken from the first frame: size (w, h) px of the box; odd sides (w, h) px over which z is averaged;
    sign, 1 hot, -1 cold; number of components removed."""

    footage: Footage
    size: tuple[float, float]
    window: tuple[int, int]
    sign: float
    components: int


@dataclass(frozen=True, slots=True, eq=False)
class SVDPFState:
    """State: particles (N, 4), x, y px, vx, vy px/frame; weights (N,)."""

    start: Start
    particles: Floats
    weights: Floats
    monitor: VisibilityMonitor
    tentative: Tentative | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Tentative:
    """Candidates of successive frames that may be one target outside the search window.

    first, last  (2,) px, the first and the last of them;  age  number of frames since the first
    hits         True for each recent frame with a candidate near the last one, the newest last
    """

    first: Floats
    last: Floats
    age: int = 0
    hits: tuple[bool, ...] = (True,)

    def after(self, found: Floats | None, length: int) -> Tentative:
        """Return the candidates after a frame with the candidate `found` (2,) px, or with none."""
        hits = (*self.hits, found is not None)[-length:]
        return Tentative(self.first, self.last if found is None else found, self.age + 1, hits)

    def state(self) -> Floats:
        """Return the state (4,) at the last candidate, with the mean velocity since the first."""
        return np.concatenate([self.last, (self.last - self.first) / max(self.age, 1)])


@dataclass(slots=True, eq=False)
class Observed(Likelihood):
    """Likelihood of particles, score and monitor after the frame, and a state (4,) to start anew from, or None."""

    score: float
    monitor: VisibilityMonitor
    restart: Floats | None = None
    tentative: Tentative | None = None


class SVDPF(MonitoredTracker):
    """Candidates in the residual of singular-value suppression, in a particle filter's search window.

    L. Cui, J. Zheng, X. Li 2011 (see `irtrack.features.svd`), of which only the summary is available:
    SVD filtering gives candidates in each frame, and a particle filter predicts a search window, so that a missed
    target is predicted, and candidates correct a wrong prediction.

    All else is chosen here. Candidates are maxima of z, the mean over the target's box (or over 3x3 px, if z is larger)
    in standard deviations, above `threshold`. The highest candidate in the search window is the target. In a frame
    without one, particles are weighed by z at their positions, as in the mode `pf`; after `wrong_after` such frames,
    they start anew at a candidate outside the window that was found in `confirm` of `confirm_of` frames, the M-of-N
    rule of track initiation (Bar-Shalom, Li, Kirubarajan 2001), since the highest of one frame may be clutter.
    """

    source: ClassVar[str] = "Cui, Zheng, Li 2011"

    use: Literal["joint", "svd", "pf"] = "joint"
    """Method: both, SVD and particle filter; the highest candidate of each frame alone; or the particle filter alone,
    weighed by z (likelihood ratio of a known amplitude A in normal noise, exp(A z - A^2 / 2))."""
    components: Annotated[int | None, Field(ge=0, le=50)] = None
    """Number of largest singular values removed; by default the number with the target's largest z in the first frame,
    since the largest components may contain a large target."""
    threshold: Ratio = 4.0
    """Least z of a candidate; in normal noise one position in 30,000 passes 4."""
    particles: int = Field(default=100, ge=2, le=1_000_000)
    """N, number of particles."""
    position_sd: Spread = 0.5
    """Standard deviation of the position noise, px."""
    speed_sd: Spread = 0.3
    """Standard deviation of the velocity noise on each axis, px/frame."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    measurement_sd: Deviation = 1.0
    """Standard deviation of a candidate's place on each axis, px."""
    gate: Ratio = 3.0
    """Half side of the search window in standard deviations of the predicted particles, beyond half the box."""
    resampling: Resampling = "systematic"
    """Resampling scheme, used where Neff is below N / 2."""
    wrong_after: int = Field(default=10, ge=1, le=1_000_000)
    """Number of successive frames without a candidate in the window after which the whole frame is searched."""
    confirm: int = Field(default=3, ge=1, le=100)
    """M, number of hits after which the particles start anew at a candidate outside the window."""
    confirm_of: int = Field(default=5, ge=1, le=100)
    """N, number of frames in which the M hits must lie, at least M."""
    seen: Fraction = 0.3
    """Least z of a visible target: the share of the way from `threshold` to the target's usual z."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> SVDPFState:
        """Return the initial state: polarity, number of components, and particles about the box's centre."""
        part, (left, top) = start_window(frame, box)
        parts = largest_parts(frame.image, MOST_COMPONENTS if self.components is None else self.components, rng)
        tried = range(MOST_COMPONENTS + 1) if self.components is None else [self.components]
        # Middle of the part of the box inside the frame.
        row, column = top + part.rows // 2, left + part.columns // 2
        heights = {
            (window, k): float(standardised(parts.less(k), window, 1.0)[row, column])
            for window in {(_odd(box.w), _odd(box.h)), POINT}
            for k in tried
        }
        window, components = max(sorted(heights), key=lambda choice: abs(heights[choice]))
        sign = 1.0 if heights[window, components] >= 0 else -1.0
        start = Start(footage(frame), (box.w, box.h), window, sign, components)
        return SVDPFState(
            start=start,
            particles=self._particles_at(np.array([box.cx, box.cy, 0.0, 0.0]), rng),
            weights=equal_weights(self.particles),
            monitor=VisibilityMonitor(),
        )

    def step(self, state: SVDPFState, frame: Frame, rng: np.random.Generator) -> tuple[SVDPFState, Estimate]:
        """Suppress, predict, search the window, weigh, estimate, resample."""
        start = state.start
        start.footage.check(frame)
        z = self.standardised(frame.image, start, rng)
        step = smc_step(
            state.weights,
            None,
            lambda _: self._moved(state.particles, rng),
            lambda particles: self._observed(state, particles, z),
        )
        particles, W, found = step.particles, step.W, step.likelihood
        if found.restart is not None:
            particles = self._particles_at(found.restart, rng)
        if found.restart is not None or self.use == "svd":
            W = equal_weights(self.particles)
        center = mean(W, particles)
        status = found.monitor.status(self.lost_after)
        estimate = particle_estimate(particles, W, center[:2], center[2:], start.size, status, found.score)
        if estimate.neff is not None and estimate.neff < self.particles / 2:
            particles = particles[RESAMPLERS[self.resampling](W, rng)]
            W = equal_weights(self.particles)
        after = replace(state, particles=particles, weights=W, monitor=found.monitor, tentative=found.tentative)
        return after, estimate

    def standardised(self, image: Image, start: Start, rng: np.random.Generator) -> Residual:
        """Return z (rows, columns) of a frame, positive for targets."""
        residual = largest_parts(image, start.components, rng).less(start.components)
        return standardised(residual, start.window, start.sign)

    def _moved(self, particles: Floats, rng: np.random.Generator) -> Floats:
        """Move by constant velocity with normal noise."""
        deviations = np.repeat([self.position_sd, self.speed_sd], 2)
        moved: Floats = particles + deviations * rng.standard_normal(particles.shape)
        moved[:, :2] += particles[:, 2:]
        return moved

    def _observed(self, state: SVDPFState, particles: Floats, z: Residual) -> Observed:
        """Return the likelihood by the best candidate in the window or frame; without one, by z at the particles."""
        if self.use == "pf":
            return self._by_z(state, particles, z)
        start = state.start
        centers, heights = candidates(z, start.window, self.threshold, MOST_CANDIDATES)
        predicted = mean(state.weights, particles)
        if self.use == "joint":
            deviation = np.sqrt(np.diag(covariance(state.weights, particles[:, :2], predicted[:2])))
            inside = (np.abs(centers - predicted[:2]) <= self.gate * deviation + np.array(start.size) / 2).all(axis=1)
            if inside.any():
                first = int(inside.argmax())  # the highest come first
                monitor = state.monitor.after(float(heights[first]), self.threshold, self.seen)
                if monitor.misses == 0:
                    squares = ((particles[:, :2] - centers[first]) ** 2).sum(axis=1) / self.measurement_sd**2
                    return Observed(-squares, 0.5, np.ones(len(squares)), float(heights[first]), monitor)
        zero, one = np.zeros(len(particles)), np.ones(len(particles))
        if self.use == "svd":
            height = float(heights[0]) if len(centers) > 0 else 0.0
            monitor = state.monitor.after(height, self.threshold, self.seen)
            if monitor.misses == 0:
                return Observed(zero, 0.0, one, height, monitor, np.concatenate([centers[0], predicted[2:]]))
            return Observed(zero, 0.0, one, 0.0, monitor)
        usual = self.threshold + self.seen * max((state.monitor.level or self.threshold) - self.threshold, 0.0)
        high = heights > usual
        tentative = self._tentative(state.tentative, centers[high])
        confirmed = tentative is not None and tentative.hits[-1] and sum(tentative.hits) >= self.confirm
        if tentative is not None and confirmed and state.monitor.misses + 1 >= self.wrong_after:
            height = float(heights[high][(centers[high] == tentative.last).all(axis=1)].max())
            monitor = replace(state.monitor, misses=0)
            return Observed(zero, 0.0, one, height, monitor, tentative.state())
        return replace(self._by_z(state, particles, z), monitor=state.monitor.miss(), tentative=tentative)

    def _tentative(self, before: Tentative | None, centers: Floats) -> Tentative | None:
        """Return the tentative target after a frame with candidates (n, 2) px, the highest first; None without one.

        A hit is the highest candidate within `gate` deviations of the last one. After more than N - M misses the
        highest candidate of the frame is taken in its place.
        """
        length = max(self.confirm, self.confirm_of)
        if before is not None:
            frames = 1 + before.hits[::-1].index(True)
            deviation = np.hypot(sqrt(2) * self.measurement_sd, frames * self.start_speed_sd)
            near = centers[(np.hypot(*(centers - before.last).T) <= self.gate * deviation)]
            after = before.after(near[0] if len(near) > 0 else None, length)
            if after.hits.count(False) <= length - self.confirm:
                return after
        return Tentative(centers[0], centers[0]) if len(centers) > 0 else None

    def _by_z(self, state: SVDPFState, particles: Floats, z: Residual) -> Observed:
        """Return the likelihood by z at the positions of the particles; z is 0 outside the frame."""
        columns, rows = np.floor(particles[:, :2].T + 0.5)
        inside = (columns >= 0) & (columns < z.shape[1]) & (rows >= 0) & (rows < z.shape[0])
        heights = np.zeros(len(particles))
        heights[inside] = z[rows[inside].astype(np.intp), columns[inside].astype(np.intp)]
        amplitude = min(max(state.monitor.level or self.threshold, 0.0), SHARPEST)
        score = float(Weights(heights, state.weights, amplitude).W @ heights)
        monitor = state.monitor.after(score, self.threshold, self.seen)
        return Observed(heights, amplitude, np.ones(len(heights)), score, monitor)

    def _particles_at(self, at: Floats, rng: np.random.Generator) -> Floats:
        """Draw particles (N, 4) about the state `at`, whose position is known and velocity uncertain."""
        deviations = np.repeat([self.measurement_sd if self.use != "svd" else 0.0, self.start_speed_sd], 2)
        return at + deviations * rng.standard_normal((self.particles, 4))


def _odd(side: float) -> int:
    """Return the odd number of pixels next to `side`, at most `LARGEST_PX`, so that the window has a middle pixel."""
    return min(2 * int(side / 2) + 1, LARGEST_PX)
