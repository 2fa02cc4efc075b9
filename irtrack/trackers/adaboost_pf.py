"""`adaboost_pf`: a particle filter on grey histograms whose search region a boosted detector of targets uses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, sqrt
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.centroid import contrast
from irtrack.features.scaled_region import ScaledRegion
from irtrack.features.window import region
from irtrack.filters.motion import ar2
from irtrack.filters.particle import covariance, equal_weights, mean, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices, Resampling
from irtrack.models import model_path
from irtrack.models.haar import HaarModel
from irtrack.trackers.appearance import Appearance, GreyTracker, blend
from irtrack.trackers.base import Deviation, Ratio, Spread, VisibilityMonitor
from irtrack.types import Estimate

STRIDE = 0.125
"""Step of the detector's windows, in sides of the target."""
MOST_REACH = 2.0
"""Largest distance of a detector's window from the prediction on each axis, in sides of the target."""


@dataclass(frozen=True, slots=True, eq=False)
class AdaBoostPFState:
    """State: `positions` and `previous` (N, 2) px, in this and the previous frame; weights (N,); `cold`: the target is
    darker than its surroundings; `deviation`: that of the next step, px."""

    appearance: Appearance
    reference: Floats
    positions: Floats
    previous: Floats
    weights: Floats
    deviation: float
    cold: bool
    frames: int
    monitor: VisibilityMonitor


class AdaBoostPF(GreyTracker):
    """Particle filter on grey histograms, with steps by its dispersion, corrected by an AdaBoost detector.

    "Design of a real-time face tracking system based on a particle filter", of which the abstract survives: AdaBoost
    detects faces; a particle filter with second-order autoregressive motion and HSV histograms follows them; the step
    adapts to the dispersion of the particles; the track is fed back to the detector, so that lost targets are found
    again and wrong ones corrected. Here: grey levels for colours; Cheng et al. 2006, eq. 4 for the motion and eq. 10
    for the weights; the step R = clip(c sqrt(tr Sigma / 2), Rmin, Rmax) with the covariance Sigma of the particles.

    The track gives the detector its search region, a gate of the particles' covariance times one plus the misses. Where
    the target was not seen in the last frame, or `detect_every` frames have passed, a detection whose histogram is the
    target's, and matches better than that at the estimate, resets the cloud. Chosen here: c, Rmin, Rmax and the gate.
    The model is trained on rendered targets (`irtrack train adaboost`); windows of cold targets are seen in the
    negative picture.
    """

    source: ClassVar[str] = "AdaBoost and particle filter (digest); Viola, Jones 2004; Cheng et al. 2006"

    model: str | None = Field(default=None, max_length=4096)
    """File of `irtrack train adaboost`; by default the shipped model."""
    particles: int = Field(default=100, ge=2, le=1_000_000)
    """N, number of particles."""
    lam: Ratio = 20.0
    """lambda of eq. 10 (section 2.2.2: 20)."""
    step_by: Literal["dispersion", "fixed"] = "dispersion"
    """Standard deviation R of the step: by the dispersion of the particles, or `fixed_step`."""
    dispersion: Ratio = 0.7
    """c, step per dispersion of the particles."""
    r_min: Spread = 0.5
    """Rmin, least step, px."""
    r_max: Deviation | None = None
    """Rmax, largest step, px; by default half the mean side of the start box, sqrt(w h) / 2."""
    fixed_step: Deviation = 2.0
    """fixed: R, px."""
    damping: Fraction = 1.0
    """Factor of the last displacement in eq. 4; 1 in the paper."""
    resampling: Resampling = "systematic"
    """Resampling scheme (the source gives none)."""
    alpha: Fraction = 0.1
    """Share of the histogram at the estimate that enters the reference where the target is visible."""
    feedback: bool = True
    """True: detections reset the cloud."""
    detect_every: int = Field(default=10, ge=1, le=1000)
    """Number of frames from one detection to the next while the target is seen."""
    gate: Ratio = 13.8
    """Largest squared Mahalanobis distance of a measurement; chi-square, 2 degrees: 99.9 %."""
    start_sd: Spread = 1.0
    """Standard deviation of the first particles on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""

    @model_validator(mode="after")
    def _ordered(self) -> AdaBoostPF:
        if self.r_max is not None and self.r_max < self.r_min:
            raise ValueError(f"r_max {self.r_max} is below r_min {self.r_min}")
        return self

    @property
    def weights(self) -> tuple[str, ...]:
        """Files whose content decides a track, for the key of a run."""
        return (str(model_path("adaboost", self.model)),)

    @cached_property
    def classifier(self) -> HaarModel:
        """Classifier of the model file; InputError, one line, where the file is none."""
        return HaarModel.read(model_path("adaboost", self.model))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> AdaBoostPFState:
        """Return the reference histogram and particles of equal weights about the box's centre."""
        appearance, reference = self.appearance(frame, box)
        _ = self.classifier
        part, corner = appearance.window.inside(appearance.window.corner((box.cx, box.cy)), frame.image.shape)
        surround = region(frame.image, part, corner, (part.columns, part.rows))[2]
        positions = np.array([box.cx, box.cy]) + self.start_sd * rng.standard_normal((self.particles, 2))
        return AdaBoostPFState(
            appearance=appearance,
            reference=reference,
            positions=positions,
            previous=positions - self.start_speed_sd * rng.standard_normal((self.particles, 2)),
            weights=equal_weights(self.particles),
            deviation=self._step_deviation(self.start_speed_sd, appearance.size),
            cold=contrast(part.cut(frame.image, corner), surround) < 0,
            frames=0,
            monitor=VisibilityMonitor(),
        )

    def step(self, state: AdaBoostPFState, frame: Frame, rng: np.random.Generator) -> tuple[AdaBoostPFState, Estimate]:
        """Resample, move, weigh, estimate; where it is due, detect and start the cloud anew; update the reference."""
        appearance, reference = state.appearance, state.reference
        picture = appearance.view(frame)
        previous: Floats = state.positions

        def move(ancestors: Indices | None) -> Floats:
            nonlocal previous
            assert ancestors is not None
            deviations = np.full(len(ancestors), state.deviation)
            positions, previous = ar2(state.positions, state.previous, ancestors, self.damping, deviations, rng)
            return positions

        step = smc_step(
            state.weights,
            lambda W: RESAMPLERS[self.resampling](W, rng, self.particles),
            move,
            lambda positions: appearance.likelihood(picture, positions, reference, self.lam / 2),
        )
        positions, W = step.particles, step.W
        center, velocity = mean(W, positions), mean(W, positions - previous)
        match, in_view = appearance.match(picture, center, reference), step.in_view
        frames = state.frames + 1
        if self.feedback and (state.monitor.misses > 0 or frames % self.detect_every == 0):
            cloud = covariance(equal_weights(len(positions)), positions, positions.mean(axis=0))
            spread = (1 + state.monitor.misses) * cloud
            found = self._detection(frame.image, positions.mean(axis=0), spread, appearance.size, state.cold)
            again = None if found is None else appearance.match(picture, found, reference)
            hit = again is not None and self.monitor_after(state.monitor, again).misses == 0
            if found is not None and again is not None and hit and again.score > match.score:
                velocity = velocity if state.monitor.misses == 0 else np.zeros(2)
                positions = found + self.start_sd * rng.standard_normal(positions.shape)
                speeds = velocity + self.start_speed_sd * rng.standard_normal(positions.shape)
                previous, W = positions - speeds, equal_weights(self.particles)
                center, match, in_view = mean(W, positions), again, True
        monitor = self.monitor_after(state.monitor, match, in_view)
        sigma = covariance(W, positions, center)
        after = replace(
            state,
            reference=blend(reference, match, self.alpha) if monitor.misses == 0 else reference,
            positions=positions,
            previous=previous,
            weights=W,
            deviation=self._step_deviation(sqrt(max(float(np.trace(sigma)), 0.0) / 2), appearance.size),
            frames=frames,
            monitor=monitor,
        )
        status = self.status(monitor, in_view)
        return after, particle_estimate(positions, W, center, velocity, appearance.size, status, match.score)

    def _step_deviation(self, dispersion: float, size: tuple[float, float]) -> float:
        """Return R, px: clip(c times the dispersion, Rmin, Rmax), or the fixed one."""
        if self.step_by == "fixed":
            return self.fixed_step
        r_max = sqrt(size[0] * size[1]) / 2 if self.r_max is None else self.r_max
        return max(min(self.dispersion * dispersion, r_max), self.r_min)

    def _detection(
        self, image: Image, center: Floats, spread: Floats, size: tuple[float, float], cold: bool
    ) -> Floats | None:
        """Return the centre (2,) px of the largest decision above the threshold; None without one.

        It is sought in the gate about a centre (2,) px of covariance `spread` (2, 2) px^2.
        """
        rows, columns = image.shape
        if not ((center >= -0.5) & (center < (columns - 0.5, rows - 0.5))).all():
            return None
        model, sides = self.classifier, np.array(size)
        stride = np.maximum(STRIDE * sides, 1e-3)
        S = spread + np.diag(stride**2)
        reach = np.minimum(np.sqrt(self.gate * np.diag(S)), MOST_REACH * sides)
        steps = [ceil(float(r / d)) for r, d in zip(reach, stride, strict=True)]
        x, y = (stride[i] * np.arange(-steps[i], steps[i] + 1) for i in range(2))
        offsets = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        near = (offsets * np.linalg.solve(S, offsets.T).T).sum(axis=1) <= self.gate
        places = center + offsets[near]
        places = places[((places >= -0.5) & (places < (columns - 0.5, rows - 0.5))).all(axis=1)]
        room = reach + sides * model.features.side / np.array(model.standard)
        part = ScaledRegion.of(image, center - room, center + room, sides / np.array(model.standard))
        seen = ScaledRegion(-part.pixels, part.left, part.step) if cold else part
        decisions = model.decisions(seen, places)
        best = int(decisions.argmax()) if len(places) else 0
        found: Floats | None = places[best] if len(places) and decisions[best] > model.threshold else None
        return found
