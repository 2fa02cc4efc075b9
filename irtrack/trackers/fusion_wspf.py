"""`fusion_wspf`: grey levels and gradients fused, weights selected, occlusion handled; Li and Li 2014."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field as Parameter

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.confidence import CONFIDENCES, Confidence
from irtrack.features.correlation import rival as highest_apart
from irtrack.features.cues import Cue, Field, Pattern, likeness_map
from irtrack.features.quantise import BinsRange, quantiser
from irtrack.features.window import Window
from irtrack.filters import particle as cloud
from irtrack.filters.resampling import RESAMPLERS, Resampling
from irtrack.filters.selection import Restoring, chosen, largest_first, restored
from irtrack.trackers.base import DISTINCT, Sight, Spread, TrackerPart, footage, start_window
from irtrack.trackers.fusion_looks import RING_PX, FusionState, Look, Start, best_of_frame, field_of, look_at, shifted
from irtrack.types import Estimate

MOST_PLACES = 400
"""Pixels of a window that are counted; of larger ones an even grid. Chosen here: the cost of a step stays flat,
and the noise of a histogram of 8 bins, (B - 1) / (8 n), is .002."""
SIZES = (0.5, 2.0)
"""Least and largest size of a particle, in start sizes. Chosen here: histograms are blind to a window within a
uniform target, so that sizes would wander."""


class FusionWSPF(TrackerPart):
    """Particle filter with selected weights on grey levels and gradients, which finds the target again.

    W. Li, H. Li, "Infrared target tracking based on optimized particle filter of multi-feature
    fusion", Laser & Infrared 44(1), 2014. A step is section 4.3: predict, weigh by eq. 8, 11 and 12,
    choose the Np largest weights and estimate from them, resample those, update the model by eq. 13;
    while the target is hidden, mean shift with a wider bandwidth (section 4.2), then detection anew.

    What the source leaves open or the print has lost, and what is chosen here: the noises of the
    state; the kernel of eq. 4 (Epanechnikov's); orientations weighted by magnitude, over the whole
    circle; sigma of eq. 12; the confidence of eq. 9 (three are offered); the form of eq. 13: the fused
    coefficient passes rho_T, or that of the cue of greater confidence does; the update's rate; the
    weights that particles set aside come back with (see `irtrack.filters.selection`); Neff is that
    of all N particles, since over the Np kept it is always below Nth. Mean shift starts from the
    estimate, on grey levels, and where the target is seen at its place the cloud moves there.
    Detection slides the model over the whole frame; the best place is taken where it is more like the
    model than `accept`, else the filter goes on predicting and looks again in the next frame.

    The source counts a frame as unseen where no condition of eq. 13 holds. rho_T is the same for all
    scenes, so that a target like its surroundings always passes: here the place must besides pass
    what its surroundings and its usual likeness set (see `irtrack.trackers.base.Sight`).
    """

    source: ClassVar[str] = "Li, Li 2014"

    particles: int = Parameter(default=100, ge=2, le=1_000_000)
    """N (section 5.2: 100)."""
    share: Annotated[float, Parameter(ge=0.01, le=1)] = 0.56
    """Np / N, the share of particles that are chosen (section 2: 0.56); 1: all, the standard filter."""
    threshold: Fraction = 2 / 3
    """Nth / N, resampled where Neff is not above (section 4.3: 2/3)."""
    restoring: Restoring = "own"
    """Weights of particles set aside after resampling (Step 6): what they had, or 1/N for all."""
    resampling: Resampling = "systematic"
    """How particles are drawn; the source does not say."""
    grey_bins: int = Parameter(default=8, ge=2, le=256)
    """Grey levels (section 5.2: 8)."""
    gradient_bins: int = Parameter(default=8, ge=2, le=256)
    """Gradient orientations (section 5.2: 8)."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame, kept; or the full range of the bits."""
    cues: Literal["both", "grey", "gradient"] = "both"
    """Which cues count; one alone has the confidence 1."""
    confidence: Confidence | Literal["equal"] = "bhattacharyya"
    """How well a cue tells the model from the ring around it (eq. 9), or one half for both."""
    sigma: Annotated[float, Parameter(ge=0.01, le=100)] = 0.15
    """sigma of the observation model (eq. 12), in units of the Bhattacharyya distance."""
    position_sd: Spread = 1.0
    """Noise of the place, px."""
    speed_sd: Spread = 0.5
    """Noise of the speed, px/frame."""
    size_sd: Annotated[float, Parameter(ge=0, le=1)] = 0.01
    """Random disturbance of the size, in start sizes."""
    start_speed_sd: Spread = 2.0
    """Spread of the first cloud's speed, and that of a detected target, px/frame."""
    rho_t: Fraction | None = 0.86
    """rho_T (section 4.2: 0.86); without a value, what the scene sets alone decides."""
    update: Fraction = 0.05
    """Share of the estimate's cues that enters the model when eq. 13 holds; 0: the model stays."""
    seen: Fraction = 0.5
    """Share of the way from the ring's coefficient to the target's usual one that counts as seen."""
    shift_after: int = Parameter(default=2, ge=1, le=1_000_000)
    """Frames in a row unseen from which on mean shift helps (section 4.2: 2; the step list: 4)."""
    widening: Annotated[float, Parameter(ge=0, le=10)] = 2.0
    """Bandwidth of the mean shift in occlusion, in that of the target; 0: no mean shift."""
    lost_after: int = Parameter(default=4, ge=1, le=1_000_000)
    """Frames in a row unseen from which on the target is lost and detected anew (section 4.2: 4)."""
    redetect: bool = True
    """Whether a lost target is looked for in the whole frame."""
    accept: Fraction | None = None
    """Fused coefficient that a detection must pass; without a value, half way from the best false match
    in the first frame to what the target usually has (the way is `seen`)."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> FusionState:
        """The model, and a cloud of equal weights at the box's centre."""
        part, corner = start_window(frame, box)
        window, size = Window.of(box), (box.w, box.h)
        levels = quantiser(frame, part.cut(frame.image, corner), self.grey_bins, self.bins_range)
        pattern = Pattern.of(window, MOST_PLACES)
        field = Field(frame.image, levels, self.gradient_bins)
        at = np.array([box.cx, box.cy, 0.0, 0.0, 1.0, 1.0])
        cues, _ = field.windows(pattern, at[None, :2], at[None, 4:])
        model = cues.of(0)
        confidence = self._confidence(model, field.ring((box.cx, box.cy, *size), RING_PX))
        rival = 0.0
        if self.redetect:
            fused = np.tensordot(confidence, likeness_map(field, window, pattern, model), 1)
            rival = highest_apart(fused, window.corner((box.cx, box.cy)), window)
        return FusionState(
            start=Start(footage(frame), size, window, pattern, levels, rival),
            model=model,
            confidence=confidence,
            particles=self._cloud(at, rng),
            weights=np.full(self.particles, 1 / self.particles),
            sight=Sight(),
        )

    def step(self, state: FusionState, frame: Frame, rng: np.random.Generator) -> tuple[FusionState, Estimate]:
        """Predict, weigh, choose, estimate, resample; see to occlusion; update model and confidence."""
        start, image = state.start, frame.image
        start.footage.check(frame)
        particles = self._moved(state.particles, rng)
        field = field_of(state, image)
        cues, visible = field.windows(start.pattern, particles[:, :2], particles[:, 4:])
        rho = state.confidence @ cues.like(state.model) * visible
        weights, in_view = weigh(state.weights, rho, visible, self.sigma)

        count = max(1, round(self.share * self.particles))
        order = largest_first(weights, count)
        particles, weights = particles[order], weights[order]
        mean = chosen(weights, count) @ particles[:count]
        look = look_at(state, field, mean)
        sight = self._sight(state, look) if in_view else state.sight.unseen()
        neff, covariance = float(cloud.neff(weights)), cloud.covariance(weights, particles[:, :2], mean[:2])
        after_particles, after_weights = self._resampled(particles, weights, count, neff, rng)

        if sight.missed >= self.shift_after and self.widening > 0:
            rest = shifted(state, image, mean, self.widening)
            there = self._sight(state, rest)
            if there.missed == 0:
                after_particles = after_particles + np.concatenate([rest.state[:2] - mean[:2], np.zeros(4)])
                look, sight = rest, there
        if sight.missed >= self.lost_after and self.redetect:
            found = self._found(state, image, look.state[2:4])
            if found is not None:
                after_particles, after_weights = self._cloud(found.state, rng), np.full(len(weights), 1 / len(weights))
                look, sight = found, Sight(state.sight.level)
        particles = particles + np.concatenate([look.state[:2] - mean[:2], np.zeros(4)])

        seen = sight.missed == 0
        model = state.model.mixed(look.cue, self.update) if seen and self.update > 0 else state.model
        after = FusionState(
            start=start,
            model=model,
            confidence=self._confidence(model, look.ring) if seen else state.confidence,
            particles=after_particles,
            weights=after_weights,
            sight=sight,
        )
        x, y, vx, vy, w, h = look.state.tolist()
        return after, Estimate(
            center=(x, y),
            size=(w * start.size[0], h * start.size[1]),
            status=sight.status(self.lost_after) if in_view else "lost",
            score=look.fused,
            velocity=(vx, vy),
            covariance=covariance,
            neff=neff,
            particles=particles,
            weights=weights,
        )

    def _moved(self, particles: Floats, rng: np.random.Generator) -> Floats:
        """Constant velocity for the place, a random disturbance for the size (section 3.1, eq. 2; T is one frame)."""
        moved = particles.copy()
        moved[:, :2] += moved[:, 2:4]
        moved += rng.standard_normal(moved.shape) * np.repeat([self.position_sd, self.speed_sd, self.size_sd], 2)
        np.minimum(np.maximum(moved[:, 4:], SIZES[0], out=moved[:, 4:]), SIZES[1], out=moved[:, 4:])
        return moved

    def _cloud(self, at: Floats, rng: np.random.Generator) -> Floats:
        """(N, 6) particles about a state of known place and size."""
        spread = np.repeat([self.position_sd, self.start_speed_sd, 0.0], 2)
        return at + spread * rng.standard_normal((self.particles, 6))

    def _sight(self, state: FusionState, look: Look) -> Sight:
        """Eq. 13: the fused coefficient, or that of the leading cue, passes rho_T; and the scene's own threshold."""
        leading = look.rho[state.confidence.argmax()]
        if self.rho_t is not None and max(look.fused, leading) < self.rho_t:
            return state.sight.unseen()
        return state.sight.after(look.fused, look.floor, self.seen)

    def _confidence(self, model: Cue, ring: Cue) -> Floats:
        """(L_y, L_d) of eq. 9, 10, summing to one; one half each where neither cue tells anything."""
        if self.cues != "both":
            return np.array([1.0, 0.0] if self.cues == "grey" else [0.0, 1.0])
        if self.confidence == "equal":
            return np.array([0.5, 0.5])
        measure = CONFIDENCES[self.confidence]
        both = np.array([measure(model.grey, ring.grey), measure(model.gradient, ring.gradient)])
        total = both.sum()
        return both / total if total > 0 else np.array([0.5, 0.5])

    def _resampled(
        self, particles: Floats, weights: Floats, count: int, neff: float, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """Those chosen are resampled among themselves where Neff <= Nth (section 2, Step 5, 6)."""
        if neff > self.threshold * len(weights):
            return particles, weights
        picked = RESAMPLERS[self.resampling](chosen(weights, count), rng)
        return np.concatenate([particles[picked], particles[count:]]), restored(weights, count, self.restoring)

    def _found(self, state: FusionState, image: Image, speed: Floats) -> Look | None:
        """The best place in the whole frame, where it is good enough and unlike its surroundings; else None."""
        look = best_of_frame(state, image, speed)
        if look is None:
            return None
        rival = state.start.rival
        level = max(state.sight.level or 0.0, rival)
        accept = rival + self.seen * (level - rival) if self.accept is None else self.accept
        return look if look.fused > accept and look.fused > look.floor + DISTINCT else None


def weigh(before: Floats, rho: Floats, visible: Floats, sigma: float) -> tuple[Floats, bool]:
    """Weights (N,) times p of eq. 12, exp(-(1 - rho) / (2 sigma^2)), summing to one, and whether any window is in view.

    A window wholly outside the frame weighs nothing. Equal weights where nothing is left: those in view, if any,
    weighed nothing before.
    """
    weights = cloud.reweigh(before * (visible > 0), rho, 1 / (2 * sigma**2))
    if weights is None:
        return np.full(len(rho), 1 / len(rho)), bool(visible.any())
    return weights, True
