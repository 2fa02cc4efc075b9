"""`upf`: a particle filter whose proposal is an unscented Kalman filter for each particle."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, pi, sqrt
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.filters.multiple_model import Model, white_acceleration_model
from irtrack.filters.particle import Weights, covariance, equal_weights, ess, mean, particle_estimate
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.filters.unscented import square_root
from irtrack.points.gaussian import update_all
from irtrack.points.particles import log_normal
from irtrack.points.sensor import PointSensor
from irtrack.trackers.appearance import Appearance, GreyTracker, blend
from irtrack.trackers.base import Deviation, Ratio, Spread, VisibilityMonitor
from irtrack.trackers.match_map import MatchMap
from irtrack.types import Estimate

MOST_REACH = 15
"""Largest half side of the gate, px."""


@dataclass(frozen=True, slots=True, eq=False)
class UPFState:
    """State: particles (N, 4) = x, y px, vx, vy px/frame; their covariances (N, 4, 4); weights (N,)."""

    appearance: Appearance
    reference: Floats
    particles: Floats
    covariances: Floats
    weights: Floats
    monitor: VisibilityMonitor


class UPF(GreyTracker):
    """Unscented particle filter: each particle is drawn by its own unscented Kalman filter, measured by the best match.

    Kang, Xie, Huang 2007 (reference 3 in Xue et al. 2011), of which only the title is available. The filter is that of
    R. van der Merwe, A. Doucet, N. de Freitas, E. Wan, "The unscented particle filter", 2000, figure 4:

        x_i ~ q_i = N(m_i, P_i),   w_i ~ p(y | x_i) p(x_i | x_i') / q_i(x_i)

    m_i, P_i: unscented prediction and update (alpha .5, beta 2, kappa 0) by z, the best match of the grey histogram in
    the gate of all particles. A match that is no hit is no measurement, and particles come from the prior.

    `weigh`: the likelihood p(y | x). grey: that of `grey_pf`, exp(-lambda (1 - rho) / 2). match: N(z; x, R), the
    measurement of the Kalman filter alone. With grey, z chooses the proposal only, since weights divide by q. Motion
    and measurement are linear here, so that each filter is exact and equal to a Kalman filter; the motion has nearly
    constant velocity, with white acceleration, so that its density exists.
    """

    source: ClassVar[str] = "Kang, Xie, Huang 2007; van der Merwe, Doucet, de Freitas, Wan 2000"

    particles: int = Field(default=100, ge=2, le=100_000)
    """N."""
    lam: Ratio = 20.0
    """lambda of the grey likelihood (Cheng et al. 2006, section 2.2.2: 20)."""
    weigh: Literal["grey", "match"] = "grey"
    """Likelihood of the weights: that of grey histograms, or that of the best match."""
    proposal: Literal["unscented", "prior"] = "unscented"
    """Proposal: an unscented Kalman filter for each particle, or the motion model (a bootstrap filter)."""
    carried: bool = False
    """True: each particle carries the covariance of its filter, as in van der Merwe et al. False: the covariance before
    the update is that of the motion noise, since the particle's last state is known (A. Doucet, S. Godsill, C. Andrieu,
    Statistics and Computing 10, 2000, section II-D). Carried ones are much wider than the motion model, so that few
    particles keep a weight."""
    acceleration: Deviation = 1.0
    """Root of the density of white acceleration on each axis, px/frame^(3/2)."""
    measurement_sd: Deviation = 2.0
    """Standard deviation of the best match on each axis, px; a grey histogram is flat over a pixel or two."""
    start_sd: Spread = 1.0
    """Standard deviation of the first particles on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    threshold: Annotated[float, Field(ge=0, le=1)] = 2 / 3
    """Particles are resampled where Neff is below this share of N."""
    resampling: Resampling = "systematic"
    """Resampling scheme."""
    update: bool = True
    """True: the reference is updated while the target is visible."""
    alpha: Annotated[float, Field(ge=0, le=1)] = 0.1
    """Share of the estimate's histogram that enters the reference."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> UPFState:
        """Return the reference histogram and particles of equal weights about the box's centre."""
        appearance, reference = self.appearance(frame, box)
        sds = np.repeat([self.start_sd, self.start_speed_sd], 2)
        particles = np.array([box.cx, box.cy, 0, 0]) + sds * rng.standard_normal((self.particles, 4))
        covariances: Floats = np.tile(np.diag(sds**2), (self.particles, 1, 1))
        return UPFState(
            appearance, reference, particles, covariances, equal_weights(self.particles), VisibilityMonitor()
        )

    def step(self, state: UPFState, frame: Frame, rng: np.random.Generator) -> tuple[UPFState, Estimate]:
        """Predict, match, draw, weigh, estimate, resample, update the reference."""
        appearance, reference = state.appearance, state.reference
        picture, model = appearance.view(frame), white_acceleration_model(self.acceleration)
        expected = state.particles @ model.F.T
        before: Floats = np.broadcast_to(model.Q, state.covariances.shape)
        if self.carried:
            before = model.F @ state.covariances @ model.F.T + model.Q
        middle = mean(state.weights, expected)
        spread = covariance(state.weights, expected[:, :2], middle[:2]) + self.measurement_sd**2 * np.eye(2)
        reach = min(max(ceil(3 * sqrt(float(np.linalg.eigvalsh(spread)[-1]))), 2), MOST_REACH)
        found = MatchMap.of(appearance, picture, middle[:2], reach, 1.0, reference)
        in_view = bool(found.rho.any())
        best = appearance.match(picture, found.best, reference)
        z = found.best if self.monitor_after(state.monitor, best, in_view).misses == 0 else None
        particles, P, lw = self.proposed(expected, before, z, model, rng)
        if self.weigh == "grey":
            likelihood = appearance.likelihood(picture, particles[:, :2], reference, self.lam / 2)
            lw = lw + likelihood.scale * np.where(likelihood.visible > 0, likelihood.lw, 0.0)
        elif z is not None:
            lw = lw + log_normal(particles[:, :2] - z, self.measurement_sd**2 * np.eye(2))
        W = Weights(lw, state.weights).W
        center = mean(W, particles)
        match = appearance.match(picture, center[:2], reference)
        monitor = self.monitor_after(state.monitor, match, in_view)
        rows = np.arange(self.particles)
        after_weights = W
        if float(ess(W)) < self.threshold * self.particles:
            rows, after_weights = RESAMPLERS[self.resampling](W, rng), equal_weights(self.particles)
        follows = self.update and monitor.misses == 0
        after = UPFState(
            appearance=appearance,
            reference=blend(reference, match, self.alpha) if follows else reference,
            particles=particles[rows],
            covariances=P[rows],
            weights=after_weights,
            monitor=monitor,
        )
        status = self.status(monitor, in_view)
        return after, particle_estimate(particles, W, center[:2], center[2:], appearance.size, status, match.score)

    def proposed(
        self, expected: Floats, before: Floats, z: Floats | None, model: Model, rng: np.random.Generator
    ) -> tuple[Floats, Floats, Floats]:
        """Draw particles (N, 4); return them, their covariances (N, 4, 4), and ln p(x | x') - ln q(x), (N,).

        expected and before: predicted means (N, 4) and covariances; z: measured place (2,) px, None without one.
        """
        normals = rng.standard_normal(expected.shape)
        if self.proposal == "prior" or z is None:
            return expected + normals @ square_root(model.Q).T, before, np.zeros(len(expected))
        sensor = PointSensor(kind="position", range_sd=self.measurement_sd, glint=0)
        plot = z[None, None]
        center, P, _ = update_all(expected[None], before[None], plot, np.zeros(2), sensor, "unscented", 1.0)
        root = square_root(P[0])
        particles = center[0] + np.matmul(root, normals[..., None])[..., 0]
        q = -0.5 * (normals**2).sum(axis=1) - np.log(np.abs(np.linalg.det(root))) - 2 * log(2 * pi)
        return particles, P[0], log_normal(particles - expected, model.Q) - q
