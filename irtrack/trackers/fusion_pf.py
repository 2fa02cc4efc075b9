"""`fusion_wspf`: grey levels and gradients fused, weights selected, occlusion handled; Li and Li 2014."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.correlation import best_distractor
from irtrack.features.gradients import CueImage, Cues, Pattern
from irtrack.features.histogram import DISTANCES, Distance, kullback_leibler
from irtrack.features.mean_shift import bandwidth, mean_shift
from irtrack.features.quantiser import BinsRange, Quantiser, first_quantiser
from irtrack.features.window import Window
from irtrack.filters.particle import Likelihood, covariance, equal_weights, ess, normalise, smc_step
from irtrack.filters.resampling import RESAMPLERS, Resampling, Restoring, after_selection, largest_first
from irtrack.trackers.base import DISTINCT, Footage, MonitoredTracker, Spread, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate

MOST_PLACES = 400
"""Largest number of pixels counted in a window; larger windows are sampled on a grid. With 8 bins, the noise of rho is
then .002."""
SIZES = (0.5, 2.0)
"""Least and largest size of a particle, in start sizes: within a uniform target, histograms do not determine the
size."""
RING_PX = 10
"""Width of the ring of local background, px (Li, Li 2014, section 4.1: ten pixels outside the window)."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """Settings taken from the first frame. `distractor`: the best fused rho away from the target in this frame."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    pattern: Pattern
    quantiser: Quantiser
    distractor: float


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Match of a state (6,) with the model: cues, their rho (2,) and fused rho; cues and fused rho of the ring."""

    state: Floats
    cues: Cues
    rho: Floats
    score: float
    ring: Cues
    background_score: float


@dataclass(frozen=True, slots=True, eq=False)
class FusionState:
    """model: q of both cues; confidence: (L_y, L_d) of grey and gradient, summing to one;
    particles (N, 6): x, y px, vx, vy px/frame, size in start sizes; weights (N,)."""

    start: Start
    model: Cues
    confidence: Floats
    particles: Floats
    weights: Floats
    monitor: VisibilityMonitor

    def cue_image(self, image: Image) -> CueImage:
        """Return a frame with the bins of both cues."""
        return CueImage(image, self.start.quantiser, len(self.model.gradient))

    def match(self, field: CueImage, at: Floats) -> Match:
        """Return the match of the state `at` (6,) (position, velocity, size) with the model."""
        cues, visible = field.windows(self.start.pattern, at[None, :2], at[None, 4:])
        found = cues.of(0)
        ring = field.ring(self.box(at), RING_PX)
        rho = np.array(found.similarity(self.model)) * visible[0]
        background = float(self.confidence @ ring.similarity(self.model))
        return Match(at, found, rho, float(self.confidence @ rho), ring, background)

    def mode(self, image: Image, at: Floats, widening: float) -> Match:
        """Return the match of the mode reached by mean shift from `at` (6,), with `widening` times its bandwidth."""
        h = bandwidth(Box(*self.box(at)), widening)
        modes = mean_shift(image, at[None, :2], h, self.start.quantiser, self.model.grey)
        return self.match(self.cue_image(image), np.concatenate([modes.centers[0], at[2:]]))

    def best_of_frame(self, image: Image, speed: Floats) -> Match | None:
        """Return the best match in the frame, of start size and velocity `speed` (2,); None where no window fits."""
        start, field = self.start, self.cue_image(image)
        fused = np.tensordot(self.confidence, field.similarity_map(start.window, start.pattern, self.model), 1)
        if fused.size == 0:
            return None
        row, column = np.unravel_index(int(fused.argmax()), fused.shape)
        center = start.window.center((float(column), float(row)))
        return self.match(field, np.array([*center, *speed, 1.0, 1.0]))

    def box(self, at: Floats) -> tuple[float, float, float, float]:
        """Return cx, cy, w, h px of a state (6,)."""
        width, height = self.start.size
        return at[0], at[1], at[4] * width, at[5] * height


class FusionWSPF(MonitoredTracker):
    """Particle filter with selected weights on grey levels and gradients, with redetection after occlusion.

    W. Li, H. Li, "Infrared target tracking based on optimized particle filter of multi-feature
    fusion", Laser & Infrared 44(1), 2014. A step is section 4.3: predict, weigh by eq. 8, 11 and 12,
    choose the Np largest weights and estimate from them, resample those, update the model by eq. 13;
    while the target is hidden, mean shift with a wider bandwidth (section 4.2), then detection anew.

    Chosen here, where the paper is silent or illegible: the noises of the state; the kernel of eq. 4 (Epanechnikov's);
    orientations weighted by magnitude, over the whole circle; sigma of eq. 12; the confidence of eq. 9 (three forms);
    the condition of eq. 13 (the fused coefficient, or that of the leading cue, passes rho_T); the update's rate; the
    weights of particles set aside after resampling (see `irtrack.filters.resampling`); Neff of all N particles, since
    that of the Np chosen is always below Nth. Section 4.3 resamples before it estimates; here the estimate comes first,
    of the same mean and a smaller variance. Mean shift on grey levels starts from the estimate; the particles move to a
    mode where the target is visible. Detection compares the model with every position of the frame; the best one is
    taken where it passes `accept`.

    A hit passes rho_T and the threshold of its scene (`irtrack.trackers.base.VisibilityMonitor`), since a target
    similar to its surroundings always passes rho_T.
    """

    source: ClassVar[str] = "Li, Li 2014"

    particles: int = Field(default=100, ge=2, le=1_000_000)
    """N (section 5.2: 100)."""
    share: Annotated[float, Field(ge=0.01, le=1)] = 0.56
    """Np / N, the share of particles that are chosen (section 2: 0.56); 1: all, the standard filter."""
    threshold: Fraction = 2 / 3
    """Nth / N; particles are resampled where Neff is at most Nth (section 4.3: 2/3)."""
    restoring: Restoring = "own"
    """Weights of particles set aside after resampling (Step 6): their own, or 1/N for all."""
    resampling: Resampling = "systematic"
    """Resampling scheme; the paper gives none."""
    grey_bins: int = Field(default=8, ge=2, le=256)
    """Grey levels (section 5.2: 8)."""
    gradient_bins: int = Field(default=8, ge=2, le=256)
    """Gradient orientations (section 5.2: 8)."""
    bins_range: BinsRange = "first_frame"
    """Grey range of the bins: that of the first frame for all frames, or the full range of the bit depth."""
    cues: Literal["both", "grey", "gradient"] = "both"
    """Cues used; a single cue has the confidence 1."""
    confidence: Distance | Literal["equal"] = "kullback_leibler"
    """Confidence of a cue: distance of the model's histogram from the ring's (eq. 9), or one half for both cues. Eq. 9
    prints xi and background densities, as in a mean log-ratio: kullback_leibler."""
    xi: Annotated[float, Field(ge=1e-9, le=0.1)] = 1e-3
    """kullback_leibler: xi of eq. 9, least share of a bin in the logarithm; no value is printed (Collins et al. 2005:
    0.001)."""
    sigma: Annotated[float, Field(ge=0.01, le=100)] = 0.15
    """sigma of the observation model (eq. 12), in units of the Bhattacharyya distance."""
    position_sd: Spread = 1.0
    """Standard deviation of the position noise, px."""
    speed_sd: Spread = 0.5
    """Standard deviation of the velocity noise on each axis, px/frame."""
    size_sd: Annotated[float, Field(ge=0, le=1)] = 0.01
    """Standard deviation of the random change of size, in start sizes."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the speed of the first particles, and of those at a detected target, px/frame."""
    rho_t: Fraction | None = 0.86
    """rho_T of eq. 13 (section 4.2: 0.86): least Bhattacharyya coefficient of a visible target with the model, fused
    or of the leading cue, in addition to the threshold by `seen`; without a value only that threshold is used."""
    update: Fraction = 0.05
    """Share of the estimate's cues that enters the model when eq. 13 holds; 0: the model stays."""
    update_when: Literal["seen", "always"] = "seen"
    """Frames in which the model is updated: those of a hit, or all with a window inside the frame."""
    shift_after: int = Field(default=2, ge=1, le=1_000_000)
    """Number of successive misses after which mean shift is used (section 4.2: 2; the step list: 4)."""
    widening: Annotated[float, Field(ge=0, le=10)] = 2.0
    """Bandwidth of the mean shift in occlusion, over that of the visible target; 0: no mean shift."""
    lost_after: int = Field(default=4, ge=1, le=1_000_000)
    """Number of successive misses after which the target is lost and detected anew (section 4.2: 4)."""
    redetect: bool = True
    """True: a lost target is searched in the whole frame."""
    accept: Fraction | None = None
    """Least fused coefficient of a detection; by default the share `seen` of the way from distractor to target."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> FusionState:
        """Return the model, and particles of equal weights at the box's centre."""
        part, corner = start_window(frame, box)
        window, size = Window.of(box), (box.w, box.h)
        levels = first_quantiser(frame, part.cut(frame.image, corner), self.grey_bins, self.bins_range)
        pattern = Pattern.of(window, MOST_PLACES)
        field = CueImage(frame.image, levels, self.gradient_bins)
        at = np.array([box.cx, box.cy, 0.0, 0.0, 1.0, 1.0])
        cues, _ = field.windows(pattern, at[None, :2], at[None, 4:])
        model = cues.of(0)
        confidence = self._confidence(model, field.ring((box.cx, box.cy, *size), RING_PX))
        distractor = 0.0
        if self.redetect:
            fused = np.tensordot(confidence, field.similarity_map(window, pattern, model), 1)
            distractor = best_distractor(fused, window.corner((box.cx, box.cy)), window)
        return FusionState(
            start=Start(footage(frame), size, window, pattern, levels, distractor),
            model=model,
            confidence=confidence,
            particles=self._particles_at(at, rng),
            weights=equal_weights(self.particles),
            monitor=VisibilityMonitor(),
        )

    def step(self, state: FusionState, frame: Frame, rng: np.random.Generator) -> tuple[FusionState, Estimate]:
        """Predict, weigh, choose, estimate, resample; handle occlusion; update model and confidence."""
        start, image = state.start, frame.image
        start.footage.check(frame)
        field = state.cue_image(image)

        def likelihood(particles: Floats) -> Likelihood:
            cues, visible = field.windows(start.pattern, particles[:, :2], particles[:, 4:])
            rho = state.confidence @ cues.similarity(state.model) * visible
            return Likelihood(rho, 1 / (2 * self.sigma**2), visible)

        step = smc_step(state.weights, None, lambda _: self._moved(state.particles, rng), likelihood)
        count = max(1, round(self.share * self.particles))
        order = largest_first(step.W, count)
        particles, W = step.particles[order], step.W[order]
        mean = normalise(W[:count]) @ particles[:count]
        match = state.match(field, mean)
        monitor = self._monitor(state, match) if step.in_view else state.monitor.miss()
        size, spread = float(ess(W)), covariance(W, particles[:, :2], mean[:2])
        after_particles, after_weights = self._resampled(particles, W, count, size, rng)

        if monitor.misses >= self.shift_after and self.widening > 0:
            mode = state.mode(image, mean, self.widening)
            there = self._monitor(state, mode)
            if there.misses == 0:
                after_particles = after_particles + np.concatenate([mode.state[:2] - mean[:2], np.zeros(4)])
                match, monitor = mode, there
        if monitor.misses >= self.lost_after and self.redetect:
            found = self._detected(state, image, match.state[2:4])
            if found is not None:
                after_particles, after_weights = self._particles_at(found.state, rng), equal_weights(len(W))
                match, monitor = found, VisibilityMonitor(state.monitor.level)
        particles = particles + np.concatenate([match.state[:2] - mean[:2], np.zeros(4)])

        hit = monitor.misses == 0
        follows = hit or (self.update_when == "always" and match.score > 0)
        model = state.model.blended(match.cues, self.update) if follows and self.update > 0 else state.model
        after = FusionState(
            start=start,
            model=model,
            confidence=self._confidence(model, match.ring) if hit else state.confidence,
            particles=after_particles,
            weights=after_weights,
            monitor=monitor,
        )
        x, y, vx, vy, w, h = match.state.tolist()
        return after, Estimate(
            center=(x, y),
            size=(w * start.size[0], h * start.size[1]),
            status=monitor.status(self.lost_after) if step.in_view else "lost",
            score=match.score,
            velocity=(vx, vy),
            covariance=spread,
            neff=size,
            particles=particles,
            weights=W,
        )

    def _moved(self, particles: Floats, rng: np.random.Generator) -> Floats:
        """Move by constant velocity, and disturb the size at random (section 3.1, eq. 2; T is one frame)."""
        moved = particles.copy()
        moved[:, :2] += moved[:, 2:4]
        moved += rng.standard_normal(moved.shape) * np.repeat([self.position_sd, self.speed_sd, self.size_sd], 2)
        np.minimum(np.maximum(moved[:, 4:], SIZES[0], out=moved[:, 4:]), SIZES[1], out=moved[:, 4:])
        return moved

    def _particles_at(self, at: Floats, rng: np.random.Generator) -> Floats:
        """Draw particles (N, 6) about the state `at`, with known position and size and an uncertain velocity."""
        deviations = np.repeat([self.position_sd, self.start_speed_sd, 0.0], 2)
        return at + deviations * rng.standard_normal((self.particles, 6))

    def _monitor(self, state: FusionState, match: Match) -> VisibilityMonitor:
        """Return the monitor after a match; a hit passes rho_T (eq. 13) and the threshold of the scene."""
        leading = match.rho[state.confidence.argmax()]
        if self.rho_t is not None and max(match.score, leading) < self.rho_t:
            return state.monitor.miss()
        return state.monitor.after(match.score, match.background_score, self.seen)

    def _confidence(self, model: Cues, ring: Cues) -> Floats:
        """Return (L_y, L_d) of eq. 9 and 10, summing to one; (1/2, 1/2) where both distances are 0."""
        if self.cues != "both":
            return np.array([1.0, 0.0] if self.cues == "grey" else [0.0, 1.0])
        if self.confidence == "equal":
            return np.array([0.5, 0.5])
        distance = DISTANCES[self.confidence]
        if self.confidence == "kullback_leibler":
            distance = partial(kullback_leibler, floor=self.xi)
        both = np.array([distance(model.grey, ring.grey), distance(model.gradient, ring.gradient)])
        return normalise(both) if both.sum() > 0 else np.array([0.5, 0.5])

    def _resampled(
        self, particles: Floats, W: Floats, count: int, size: float, rng: np.random.Generator
    ) -> tuple[Floats, Floats]:
        """Resample the chosen particles among themselves where Neff <= Nth (section 2, Step 5, 6)."""
        if size > self.threshold * len(W):
            return particles, W
        picked = RESAMPLERS[self.resampling](normalise(W[:count]), rng)
        return np.concatenate([particles[picked], particles[count:]]), after_selection(W, count, self.restoring)

    def _detected(self, state: FusionState, image: Image, speed: Floats) -> Match | None:
        """Return the best match in the frame if its score exceeds `accept` and that of its local background; else
        None."""
        match = state.best_of_frame(image, speed)
        if match is None:
            return None
        distractor = state.start.distractor
        level = max(state.monitor.level or 0.0, distractor)
        accept = distractor + self.seen * (level - distractor) if self.accept is None else self.accept
        return match if match.score > accept and match.score > match.background_score + DISTINCT else None
