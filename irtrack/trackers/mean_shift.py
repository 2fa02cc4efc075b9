"""Trackers by mean shift: `mean_shift`; `mean_shift_kalman`, with a Kalman filter; `mean_shift_pf`, with particles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.filters.motion import random_walk, random_walk_density
from irtrack.filters.particle import mean, normalise, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices
from irtrack.trackers.appearance import Appearance, MeanShiftSearch, RandomWalkParticles, blend
from irtrack.trackers.base import Deviation, VisibilityMonitor
from irtrack.trackers.kalman import GatedKalman, kalman_estimate
from irtrack.types import Estimate


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftState:
    """State: center (2,) px of the last estimate."""

    appearance: Appearance
    reference: Floats
    center: Floats
    monitor: VisibilityMonitor


class MeanShift(MeanShiftSearch):
    """Mean shift on the kernel-weighted grey histogram, started in each frame from the last position.

    The baseline of J. Cheng et al. 2006 (their reference 5: J. Cheng, J. Yang, J. Infrared Millim.
    Waves 24(3), 2005), after D. Comaniciu, V. Ramesh, P. Meer, IEEE TPAMI 25(5), 2003. Cheng and Yang work in a
    "cascade grey space", of which the available sources give only the name; here the histograms are those of grey
    levels or of the high-passed frame. Without a motion model, a target must overlap its last window.
    """

    source: ClassVar[str] = "Cheng, Yang 2005; Comaniciu, Ramesh, Meer 2003"

    alpha: Fraction = 0.0
    """Share of the histogram at the mode that enters the reference where the target is visible (Comaniciu et al. 2003:
    0)."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftState:
        """Return the initial state: the reference histogram, and the box's centre."""
        appearance, reference = self.appearance(frame, box)
        return MeanShiftState(appearance, reference, np.array([box.cx, box.cy]), VisibilityMonitor())

    def step(self, state: MeanShiftState, frame: Frame, rng: np.random.Generator) -> tuple[MeanShiftState, Estimate]:
        """Move the window from its last position by mean shift."""
        appearance = state.appearance
        picture = appearance.picture(frame)
        modes = self.mean_shift_modes(appearance, picture, state.center[None], state.reference)
        center, in_view = modes.centers[0], bool(modes.visible[0] > 0)
        match = appearance.match(picture, center, state.reference)
        monitor = self.monitor_after(state.monitor, match, in_view)
        reference = blend(state.reference, match, self.alpha) if monitor.misses == 0 else state.reference
        x, y = center.tolist()
        vx, vy = (center - state.center).tolist()
        return replace(state, reference=reference, center=center, monitor=monitor), Estimate(
            center=(x, y),
            size=appearance.size,
            status=self.status(monitor, in_view),
            score=match.score,
            velocity=(vx, vy),
        )


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftKalmanState:
    """State: mean (4,) = x, y px, vx, vy px/frame, and its covariance (4, 4)."""

    appearance: Appearance
    reference: Floats
    mean: Floats
    covariance: Floats
    monitor: VisibilityMonitor


class MeanShiftKalman(MeanShiftSearch, GatedKalman):
    """Constant-velocity Kalman filter measured by a mean shift from the predicted place.

    R. Xu, L. Yang, "Small target tracking approach combined the merits of two tracking frameworks
    under infrared complex background", J. Infrared Millim. Waves 27(5), 2008, as cited by Xue et al. 2011
    (reference 5): a kernel-weighted grey histogram, mean shift as measurement, a Kalman filter over time. Nothing else
    is known. Chosen here: white-noise acceleration (Bar-Shalom et al. 2001, eq. 6.3.2-4); a position that does not
    match the target, or lies beyond the gate (section 2.3.2 there), is no measurement, so that an occluded target is
    predicted.
    """

    source: ClassVar[str] = "Xu, Yang 2008"

    alpha: Fraction = 0.0
    """Share of the histogram at the mode that enters the reference where the target is visible (Comaniciu et al. 2003:
    0)."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftKalmanState:
        """Return the state at the box's centre, with velocity 0 of standard deviation `start_speed_sd`."""
        appearance, reference = self.appearance(frame, box)
        return MeanShiftKalmanState(appearance, reference, *self.start(box), VisibilityMonitor())

    def step(
        self, state: MeanShiftKalmanState, frame: Frame, rng: np.random.Generator
    ) -> tuple[MeanShiftKalmanState, Estimate]:
        """Predict, move the window by mean shift from the prediction, and update by the mode."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.picture(frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        modes = self.mean_shift_modes(appearance, picture, mean[None, :2], reference)
        measured, in_view = modes.centers[0], bool(modes.visible[0] > 0)
        match = appearance.match(picture, measured, reference)
        gated = in_view and self.within_gate(mean, covariance, measured)
        monitor = self.monitor_after(state.monitor, match, gated)
        if monitor.misses == 0:
            mean, covariance = self.updated(mean, covariance, measured)
            reference = blend(reference, match, self.alpha)
        after = replace(state, reference=reference, mean=mean, covariance=covariance, monitor=monitor)
        status = self.status(monitor, in_view)
        return after, kalman_estimate(mean, covariance, appearance.size, status, match.score)


@dataclass(frozen=True, slots=True, eq=False)
class MeanShiftPFState:
    """State: positions (N, 2) px, weights (N,); center (2,) px of the last estimate."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    weights: Floats
    center: Floats
    monitor: VisibilityMonitor


class MeanShiftPF(MeanShiftSearch, RandomWalkParticles):
    """Particles that walk at random, move by mean shift, and are weighed by their grey histogram.

    K. Wei, Y. Zhao, Q. Pan, et al., "IR target tracking based on mean shift and particle filter",
    J. Optoelectronics Laser 19(2), 2008, as described and measured by Xue et al. 2011 (reference 8;
    section 4: 45 or 60 particles, 32 bins, Epanechnikov kernel, radius 10). Nothing else is known: sigma and update are
    those that Xue et al. print for their own filter. The original has no high-pass, and Xue's filter has one; set
    `high_pass` here as well to compare the two.

    A shifted particle is no draw from the motion model, so that weights by likelihood alone favour the modes of mean
    shift. With `corrected`, shifted particles are scattered by `jitter` and weighed by likelihood times motion-model
    density over proposal density; both densities are mixtures over all particles.
    """

    source: ClassVar[str] = "Wei, Zhao, Pan, Zhang 2008"

    particles: int = Field(default=45, ge=2, le=1000)
    """N (section 4 of Xue et al.: 45 or 60)."""
    corrected: bool = False
    """True: weights are corrected for the mean shift."""
    jitter: Deviation = 1.0
    """corrected: standard deviation of the scatter after a mean shift, px."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> MeanShiftPFState:
        """Return the initial state: the reference histogram, and a single particle at the box's centre, of weight 1."""
        appearance, reference = self.appearance(frame, box)
        center = np.array([box.cx, box.cy])
        return MeanShiftPFState(appearance, reference, center[None], np.ones(1), center, VisibilityMonitor())

    def step(
        self, state: MeanShiftPFState, frame: Frame, rng: np.random.Generator
    ) -> tuple[MeanShiftPFState, Estimate]:
        """Resample, move, shift, weigh, estimate, update the reference."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.picture(frame)
        start = modes = state.positions

        def move(ancestors: Indices | None) -> Floats:
            nonlocal start, modes
            start = state.positions.take(ancestors, axis=0) if ancestors is not None else state.positions
            walked = random_walk(start, self.radius, self.propagation, rng)
            modes = self.mean_shift_modes(appearance, picture, walked, reference).centers
            return modes + self.jitter * rng.standard_normal(modes.shape) if self.corrected else modes

        step = smc_step(
            state.weights,
            lambda W: RESAMPLERS[self.resampling](W, rng, self.particles),
            move,
            lambda places: appearance.likelihood(picture, places, reference, 1 / (2 * self.sigma_grey**2)),
        )
        positions, W = step.particles, step.W
        if self.corrected and step.in_view:
            W = self.importance_correction(W, positions, start, modes)
        center = mean(W, positions)
        match = appearance.match(picture, center, reference)
        monitor = self.monitor_after(state.monitor, match, step.in_view)
        after = MeanShiftPFState(
            appearance=appearance,
            reference=self.updated(reference, match, monitor),
            positions=positions,
            weights=W,
            center=center,
            monitor=monitor,
        )
        status, velocity = self.status(monitor, step.in_view), center - state.center
        return after, particle_estimate(positions, W, center, velocity, appearance.size, status, match.score)

    def importance_correction(self, W: Floats, positions: Floats, start: Floats, modes: Floats) -> Floats:
        """Return weights (N,) times motion-model density over proposal density; unchanged where all densities are 0."""
        prior = random_walk_density(positions, start, self.radius, self.propagation)
        proposal = random_walk_density(positions, modes, 3 * self.jitter, "gaussian")
        corrected: Floats = W * prior / proposal
        return normalise(corrected) if corrected.sum() > 0 else W
