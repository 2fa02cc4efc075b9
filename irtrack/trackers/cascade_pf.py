"""Particle filters on grey levels and velocity of Xue, Yuan and Xie 2011: `cascade_pf`, `product_pf`, `coasting_pf`.

`cascade_pf` applies the cues one after the other; `product_pf` multiplies them; `coasting_pf` is `product_pf` with
other defaults.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame
from irtrack.features.trajectory import line_fit, trajectory_similarity
from irtrack.filters.motion import random_walk, random_walk_variance
from irtrack.filters.particle import Weights, mean, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices
from irtrack.trackers.appearance import Appearance, RandomWalkParticles
from irtrack.trackers.base import Deviation, Ratio, VisibilityMonitor
from irtrack.types import Estimate

VelocityCue = Callable[[Floats], Floats]
"""Function from positions (N, 2) px to their log-likelihoods (N,) by the velocity cue."""
TINY = float(np.finfo(np.float64).tiny)
"""Least weight of which a logarithm is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class TrajectoryPFState:
    """State: particles at positions (N, 2) px with weights (N,); trajectory, the last (up to k, 2) estimated centres,
    px."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    weights: Floats
    trajectory: Floats
    monitor: VisibilityMonitor


class TrajectoryPF(RandomWalkParticles):
    """Base of particle filters on grey levels and velocity (Xue, Yuan, Xie 2011).

    Choices made here, as the paper leaves them open: sigma of eq. 5 and 7; the distribution of the random walk ("radius
    10": normal with a standard deviation of a third of it, or a disc); the first particles (all on the start box's
    centre); the resampling; the high-pass (see `irtrack.features.highpass`). The model's velocity, v_t of eq. 7, comes
    from the last k estimates; that of a particle, from the last k - 1 estimates and its own position.
    """

    high_pass: Literal["none", "ring", "full", "butterworth"] = "ring"
    """Image of the histograms: the frame, or, with bins over the full range, its difference from a background predicted
    from a ring neighbourhood (Xue et al. 2011, eq. 1) or from a full one (Peng, Zhou 1999), or its high frequencies
    (their reference 13)."""
    cues: Literal["both", "grey", "velocity"] = "both"
    """Likelihoods used: both, or one alone."""
    k: int = Field(default=5, ge=3, le=100)
    """Number of frames of the trajectory (section 3.1: 5, of 4 to 10); in earlier frames only grey levels are used."""
    velocity: Literal["lambda", "sqrt_lambda", "least_squares"] = "lambda"
    """Velocity cue: eq. 6 with the speed from the largest eigenvalue (Algorithm 1) or from its root (section 2); or the
    distance from the position that the trajectory's least-squares line predicts, by `place_sd`."""
    sigma_velocity: Ratio = 0.5
    """sigma of eq. 7. For slow targets the direction of a trajectory is mostly noise, so it must be wide."""
    place_sd: Deviation = 2.0
    """least_squares: standard deviation of the place from the line, px."""
    coast: bool = False
    """True: an occluded target is predicted along the trajectory's line. The estimate lies on the line, particles
    spread about it by `place_sd` times the number of successive misses, and grey levels are ignored. The paper does not
    treat occlusion."""
    carried: bool = False
    """True: particles first move by the velocity of the trajectory's line; false in the paper."""
    by_speed: bool = False
    """True: (1 + v / r)^2 times as many particles within r + v, v the speed of the trajectory's line, r the `radius`:
    as dense on the disc that the target may reach. The paper calls for such a number (section 5), without a method."""
    by_speed_most: Annotated[float, Field(ge=1, le=100)] = 4.0
    """by_speed: largest factor of the number of particles."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> TrajectoryPFState:
        """Return the initial state: the reference histogram, and a single particle at the box's centre, of weight 1."""
        appearance, reference = self.appearance(frame, box)
        center = np.array([[box.cx, box.cy]])
        return TrajectoryPFState(appearance, reference, center, np.ones(1), center, VisibilityMonitor())

    def step(
        self, state: TrajectoryPFState, frame: Frame, rng: np.random.Generator
    ) -> tuple[TrajectoryPFState, Estimate]:
        """Resample, move, weigh by the cues, estimate, update the reference (Algorithm 2)."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.view(frame)
        ahead, velocity = line_fit(state.trajectory)
        speed = float(np.hypot(*velocity)) if self.by_speed else 0.0
        count = round(self._first_layer() * min((1 + speed / self.radius) ** 2, self.by_speed_most))
        scale = 0.0 if self.cues == "velocity" else 1 / (2 * self.sigma_grey**2)

        def move(ancestors: Indices | None) -> Floats:
            start = state.positions.take(ancestors, axis=0) if ancestors is not None else state.positions
            return random_walk(start + velocity if self.carried else start, self.radius + speed, self.propagation, rng)

        step = smc_step(
            state.weights,
            lambda W: RESAMPLERS[self.resampling](W, rng, count),
            move,
            lambda places: appearance.likelihood(picture, places, reference, scale),
        )
        positions, W = step.particles, step.W
        known = len(state.trajectory) == self.k and self.cues != "grey" and step.in_view
        if known:
            positions, W = self._weighed_by_velocity(positions, W, self._velocity_cue(state, ahead), rng)
        center = mean(W, positions)
        match = appearance.match(picture, center, reference)
        monitor = self.monitor_after(state.monitor, match, step.in_view)
        if self.coast and known and monitor.misses > 0:
            positions, center = step.particles, ahead
            W = Weights(self._near(ahead, monitor)(positions)).W
        trajectory = np.concatenate([state.trajectory, center[None]])[-self.k :]
        after = TrajectoryPFState(
            appearance=appearance,
            reference=self.updated(reference, match, monitor),
            positions=positions,
            weights=W,
            trajectory=trajectory,
            monitor=monitor,
        )
        status, velocity = self.status(monitor, step.in_view), line_fit(trajectory)[1]
        estimate = particle_estimate(positions, W, center, velocity, appearance.size, status, match.score)
        spacing = self._spacing_variance()
        if spacing > 0 and estimate.covariance is not None:
            estimate = replace(estimate, covariance=estimate.covariance + spacing * np.eye(2))
        return after, estimate

    @abstractmethod
    def _first_layer(self) -> int:
        """Return the number of particles drawn and weighed by their grey levels."""

    @abstractmethod
    def _weighed_by_velocity(
        self, positions: Floats, W: Floats, cue: VelocityCue, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """Return positions (n, 2) and their weights (n,) by both cues; `W`: weights of `positions` by grey levels."""

    def _spacing_variance(self) -> float:
        """Return the variance, px^2, added to the covariance on each axis for the distance between particles."""
        return 0.0

    def _velocity_cue(self, state: TrajectoryPFState, ahead: Floats) -> VelocityCue:
        if self.velocity == "least_squares":
            return self._near(ahead, state.monitor)
        speed, trajectory = self.velocity, state.trajectory
        return lambda places: (trajectory_similarity(trajectory, places, speed) - 1) / (2 * self.sigma_velocity**2)

    def _near(self, ahead: Floats, monitor: VisibilityMonitor) -> VelocityCue:
        """Return the log-likelihood of positions by their distance from `ahead`, the predicted one."""
        deviation = self.place_sd * (1 + monitor.misses if self.coast else 1)
        return lambda places: -((places - ahead) ** 2).sum(axis=1) / (2 * deviation**2)


class CascadePF(TrajectoryPF):
    """Two layers of particles on the high-passed frame: drawn by grey levels, then weighed by velocity.

    M. Xue, G. Yuan, K. Xie, "Integrating gray and velocity cue for infrared small target tracking",
    J. Image and Graphics 16(5), 2011, Algorithm 2; `TrajectoryPF` lists the choices that it leaves open. Section 4
    takes 30 and 15 particles before the sky, 40 and 20 before the ground.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011"

    n1: int = Field(default=30, ge=2, le=100_000)
    """N1, particles of the first layer (section 4: 30 or 40)."""
    n2: int = Field(default=15, ge=2, le=100_000)
    """N2, particles of the second layer (15 or 20)."""

    def _first_layer(self) -> int:
        return self.n1

    def _spacing_variance(self) -> float:
        """Return s^2 / N1, s^2 px^2 the variance of the random walk on each axis.

        The second layer has two or three distinct places of weight, whose covariance may be 0. N1 normal draws have the
        density N1 / (2 pi s^2) at their centre, so that the nearest is 2 s^2 / N1 away in the mean square.
        """
        return random_walk_variance(self.radius, self.propagation) / self.n1

    def _weighed_by_velocity(
        self, positions: Floats, W: Floats, cue: VelocityCue, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """Draw N2 of the N1 by their grey weights, then weigh them by eq. 7 alone (Algorithm 2, step 4).

        Copies of one particle become one particle with the sum of their weights.
        """
        count = round(self.n2 * len(positions) / self.n1)
        places, copies = np.unique(RESAMPLERS[self.resampling](W, rng, count), return_counts=True)
        chosen = positions.take(places, axis=0)
        return chosen, Weights(cue(chosen), copies.astype(np.float64)).W


class ProductPF(TrajectoryPF):
    """One layer of particles on the high-passed frame, weighed by grey levels times velocity.

    The "basic particle filter" to which M. Xue, G. Yuan, K. Xie 2011, section 3.2, compare their cascade: equally
    costly at N = N1 + N2 and, by their account, less robust. Both sample the same distribution; they differ in the
    variance of the estimate.
    """

    source: ClassVar[str] = "Xue, Yuan, Xie 2011 (section 3.2)"

    particles: int = Field(default=45, ge=2, le=100_000)
    """N (section 3.2: N1 + N2, so 45 or 60)."""

    def _first_layer(self) -> int:
        return self.particles

    def _weighed_by_velocity(
        self, positions: Floats, W: Floats, cue: VelocityCue, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """Weigh by both cues as independent: p(grey, velocity) = p(grey) p(velocity)."""
        return positions, Weights(np.log(np.maximum(W, TINY)) + cue(positions)).W


class CoastingPF(ProductPF):
    """`product_pf` with a straight line in place of principal axes, along which an occluded target is predicted.

    A variant of M. Xue, G. Yuan, K. Xie 2011 which no paper describes: a preset of `product_pf`. Velocity by least
    squares over ten frames (`velocity`, `k`); particles moved by this velocity, with a narrower spread (`carried`,
    `radius`); an occluded target predicted along the line, without updates (`coast`, `update`); eight bins, few enough
    for 25 pixels; and no high-pass (`high_pass`), since it removes the difference between a small target and bright
    cloud. Its values were found on scenes made for this variant, and on the paper's rebuilt scenes with seeds from 1000
    on.
    """

    source: ClassVar[str] = "after Xue, Yuan, Xie 2011"

    bins: int = Field(default=8, ge=2, le=256)
    high_pass: Literal["none", "ring", "full", "butterworth"] = "none"
    particles: int = Field(default=60, ge=2, le=100_000)
    k: int = Field(default=10, ge=3, le=100)
    velocity: Literal["lambda", "sqrt_lambda", "least_squares"] = "least_squares"
    carried: bool = True
    coast: bool = True
    radius: Deviation = 5.0
    sigma_grey: Ratio = 0.25
    update: Literal["always", "seen", "never"] = "seen"
