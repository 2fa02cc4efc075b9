"""`hog_pf`: a particle filter weighed by a support vector machine on oriented gradients, which also detects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, log
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.types import Bools, Box, Floats, Frame
from irtrack.features.scaled_region import ScaledRegion
from irtrack.features.window import overlaps
from irtrack.filters.particle import Likelihood, covariance, equal_weights, mean, particle_estimate, smc_step
from irtrack.filters.resampling import RESAMPLERS, Indices, Resampling
from irtrack.models import model_path
from irtrack.models.hog import HOGModel
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

SIZES = (0.35, 3.0)
"""Least and largest size of a particle, times that of the start box."""
STRIDE = 0.25
"""Step of the windows of a detection, in sides of the target."""
MOST_STEPS = 9
"""Largest number of steps on each side of the prediction, so that a detection has at most 361 windows."""
RETRY = 3
"""Number of frames from one detection to the next while the target is not seen."""
OVERLAP = 0.5
"""IoU with a window of a larger margin above which a window is no detection (non-maximum suppression)."""
AROUND = np.array([(0, 0), (-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)], dtype=np.float64)
"""Places of the window at the estimate, and of those around it, in sides of the target."""


@dataclass(frozen=True, slots=True, eq=False)
class HogPFState:
    """State: particles (N, 5): x, y px, vx, vy px/frame, ln(size / start size); weights; frames since the start."""

    footage: Footage
    size: tuple[float, float]
    particles: Floats
    weights: Floats
    frames: int
    monitor: VisibilityMonitor


class HogPF(MonitoredTracker):
    """Particle filter on the probability that a window's oriented gradients are a target's.

    "Pedestrian detection and tracking based on HOG and a particle filter", of which a digest survives: HOG vectors and
    a support vector machine detect; a particle filter on the HOG likelihood tracks. The probability of a particle's
    window of margin m, fitted on held-out windows (Platt 1999), is

        p = 1 / (1 + exp(-(a m + c)))

    Detection runs in the gate every `detect_every` frames, and every third frame while the target is not seen. Of the
    windows with a margin above 0 those remain that overlap no better one by half; a share of the particles moves to
    them by their probabilities: a mixture of motion and detections, as in K. Okuma et al., "A Boosted Particle Filter",
    ECCV 2004. Chosen here, as the digest prints no number: constant velocity with white acceleration, the walk of the
    size, the weight (p + `floor`)^`sharpness`, the shares. The model is trained on rendered targets of all classes
    (`irtrack train hog`) and does not know the target itself: another target in the gate is as good. The digest names
    light and occlusion as weak points.
    """

    source: ClassVar[str] = "HOG and particle filter (digest); Dalal, Triggs 2005; Okuma et al. 2004"

    model: str | None = Field(default=None, max_length=4096)
    """File of `irtrack train hog`; by default the shipped model."""
    particles: int = Field(default=100, ge=2, le=100_000)
    """N, number of particles."""
    acceleration: Deviation = 0.5
    """Standard deviation of the acceleration on each axis, px/frame^2."""
    position_sd: Spread = 0.5
    """Standard deviation of the position noise, px."""
    size_walk: Annotated[float, Field(ge=0, le=1)] = 0.02
    """Standard deviation of the step of the logarithm of the size; 0: the size stays."""
    floor: Annotated[float, Field(ge=0, le=1)] = 0.02
    """Added to the probability: where no window is a target's, the weights are equal and the particles coast; 0 in the
    source."""
    sharpness: Ratio = 3.0
    """Power of the probability in a weight, as it is flat where near 1; 1 in the source. Found on development seeds."""
    resampling: Resampling = "systematic"
    """Resampling scheme (the source gives none)."""
    detect: bool = True
    """True: detections move particles."""
    detect_every: int = Field(default=10, ge=1, le=1000)
    """Number of frames from one detection to the next while the target is seen."""
    detect_share: Annotated[float, Field(ge=0, le=1)] = 0.3
    """Share of the particles that moves to a detection."""
    gate: Ratio = 13.8
    """Largest squared Mahalanobis distance of a measurement; chi-square, 2 degrees: 99.9 %."""
    start_sd: Spread = 1.0
    """Standard deviation of the first particles on each axis, px."""
    start_speed_sd: Spread = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""

    @property
    def weights(self) -> tuple[str, ...]:
        """Files whose content decides a track, for the key of a run."""
        return (str(model_path("hog", self.model)),)

    @cached_property
    def classifier(self) -> HOGModel:
        """Classifier of the model file; InputError, one line, where the file is none."""
        return HOGModel.read(model_path("hog", self.model))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> HogPFState:
        """Return particles of equal weights about the box's centre, of its size."""
        start_window(frame, box)
        _ = self.classifier
        normals = rng.standard_normal((self.particles, 4))
        deviations = [self.start_sd] * 2 + [self.start_speed_sd] * 2
        particles = np.zeros((self.particles, 5))
        particles[:, :4] = np.array([box.cx, box.cy, 0, 0]) + deviations * normals
        weights = equal_weights(self.particles)
        return HogPFState(footage(frame), (box.w, box.h), particles, weights, 0, VisibilityMonitor())

    def step(self, state: HogPFState, frame: Frame, rng: np.random.Generator) -> tuple[HogPFState, Estimate]:
        """Resample, move, detect where it is due, weigh, estimate."""
        state.footage.check(frame)
        size = np.array(state.size)
        frames = state.frames + 1
        due = self.detect and (frames % self.detect_every == 0 or state.monitor.misses % RETRY == 1)

        def move(ancestors: Indices | None) -> Floats:
            assert ancestors is not None
            moved = self._moved(state.particles.take(ancestors, axis=0), rng)
            return self._with_detection(moved, size, frame, rng) if due else moved

        region: ScaledRegion | None = None

        def likelihood(particles: Floats) -> Likelihood:
            nonlocal region
            region = self._region(particles[:, :2], size * np.exp(particles[:, 4].mean()), frame)
            return self._likelihood(particles, size, region, frame)

        step = smc_step(state.weights, lambda W: RESAMPLERS[self.resampling](W, rng, self.particles), move, likelihood)
        average = mean(step.W, step.particles)
        now = size * np.exp(average[4])
        assert region is not None
        score, background = self._scores(average[:2], now, region)
        seen = step.in_view and bool(_inside(average[None, :2], frame)[0])
        monitor = state.monitor.after(score, background, self.seen) if seen else state.monitor.miss()
        status = monitor.status(self.lost_after) if step.in_view else "lost"
        after = replace(state, particles=step.particles, weights=step.W, frames=frames, monitor=monitor)
        width, height = now.tolist()
        return after, particle_estimate(
            step.particles, step.W, average[:2], average[2:4], (width, height), status, score
        )

    def _moved(self, particles: Floats, rng: np.random.Generator) -> Floats:
        """Return particles (N, 5) a frame later."""
        normals = rng.standard_normal((len(particles), 5))
        push = self.acceleration * normals[:, :2]
        moved = particles.copy()
        moved[:, :2] += particles[:, 2:4] + push / 2 + self.position_sd * normals[:, 2:4]
        moved[:, 2:4] += push
        moved[:, 4] = np.clip(moved[:, 4] + self.size_walk * normals[:, 4], *np.log(SIZES))
        return moved

    def _region(self, centers: Floats, size: Floats, frame: Frame) -> ScaledRegion:
        """Return the part of the frame about centres (n, 2), with room for windows of a size and those around them."""
        model = self.classifier
        standard, window = np.array(model.standard), np.array([model.layout.columns, model.layout.rows])
        room = size * (1 + window / standard / 2)
        shape = np.array(frame.image.shape[::-1])
        low = np.minimum(np.maximum(centers.min(axis=0), 0), shape) - room
        high = np.maximum(np.minimum(centers.max(axis=0), shape), low + room) + room
        return ScaledRegion.of(frame.image, low, high, size / standard)

    def _likelihood(self, particles: Floats, size: Floats, region: ScaledRegion, frame: Frame) -> Likelihood:
        """Return the likelihood of particles (N, 5): 0 where their centre is outside the frame."""
        boxes = np.concatenate([particles[:, :2], size * np.exp(particles[:, 4:])], axis=1)
        model = self.classifier
        logs = model.svm.log_probabilities(model.margins(region, boxes))
        if self.floor > 0:
            logs = np.logaddexp(logs, log(self.floor))
        return Likelihood(logs, self.sharpness, _inside(particles[:, :2], frame).astype(np.float64))

    def _scores(self, center: Floats, size: Floats, region: ScaledRegion) -> tuple[float, float]:
        """Return the probability of the window at the estimate, and the median of those around it."""
        boxes = np.concatenate([center + AROUND * size, np.broadcast_to(size, AROUND.shape)], axis=1)
        model = self.classifier
        probabilities = np.exp(model.svm.log_probabilities(model.margins(region, boxes)))
        return float(probabilities[0]), float(np.median(probabilities[1:]))

    def _with_detection(self, particles: Floats, size: Floats, frame: Frame, rng: np.random.Generator) -> Floats:
        """Return the particles, a share of which has moved to the detections in the gate, by probability."""
        center = particles[:, :2].mean(axis=0)
        now = size * np.exp(particles[:, 4].mean())
        S = covariance(equal_weights(len(particles)), particles[:, :2], center) + np.diag((STRIDE * now) ** 2)
        reach = np.sqrt(self.gate * np.diag(S))
        stride = np.maximum(STRIDE * now, reach / MOST_STEPS)
        steps = [ceil(float(r / d)) for r, d in zip(reach, stride, strict=True)]
        x, y = (stride[i] * np.arange(-steps[i], steps[i] + 1) for i in range(2))
        offsets = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        near = (offsets * np.linalg.solve(S, offsets.T).T).sum(axis=1) <= self.gate
        places = center + offsets[near]
        places = places[_inside(places, frame)]
        if len(places) == 0:
            return particles
        boxes = np.column_stack([places, np.tile(now, (len(places), 1))])
        margins = self.classifier.margins(self._region(places, now, frame), boxes)
        best = suppressed(boxes, margins)
        if len(best) == 0:
            return particles
        shares = np.exp(self.classifier.svm.log_probabilities(margins[best]))
        count = round(self.detect_share * len(particles))
        chosen = places[best[rng.choice(len(best), count, p=shares / shares.sum())]]
        moved = particles.copy()
        moved[:count, :2] = chosen + stride / 2 * rng.standard_normal((count, 2))
        return moved


def suppressed(boxes: Floats, margins: Floats) -> Indices:
    """Return the boxes (n, 4) with a margin above 0 that overlap none of a larger margin by `OVERLAP`, best first."""
    order = np.argsort(-margins, kind="stable")
    order = order[margins[order] > 0]
    kept: list[int] = []
    while len(order):
        kept.append(int(order[0]))
        order = order[1:][overlaps(boxes[order[:1]], boxes[order[1:]])[0] <= OVERLAP]
    return np.array(kept, dtype=np.intp)


def _inside(centers: Floats, frame: Frame) -> Bools:
    """Return which centres (n, 2) lie in the frame."""
    rows, columns = frame.image.shape
    x, y = centers[:, 0], centers[:, 1]
    inside: Bools = (x >= -0.5) & (y >= -0.5) & (x < columns - 0.5) & (y < rows - 0.5)
    return inside
