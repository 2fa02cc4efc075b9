"""`pdaf`: a Kalman filter updated by all detections in its gate, by their probabilities of association."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log, pi, sqrt
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.detectors import detected, parse_detector
from irtrack.detectors.bandpass import DoG
from irtrack.features.centroid import contrast
from irtrack.features.window import region
from irtrack.filters.data_association import MOST_AMPLITUDE, joint_probabilities
from irtrack.filters.multiple_model import States, update_mixture
from irtrack.trackers.base import (
    Deviation,
    Footage,
    MonitoredTracker,
    Ratio,
    VisibilityMonitor,
    footage,
    start_window,
)
from irtrack.trackers.kalman import GatedKalman, kalman_estimate
from irtrack.types import Detections, Detector, Estimate

THRESHOLD = 4.0
"""Threshold of the default detector, robust standard deviations: low, since the association weighs detections."""
PSF = (0.5, 10.0)
"""Least and largest width of the default detector's inner Gaussian, px."""
SLOW = 1.0
"""Speed below which the direction of motion is noise and not used, px/frame."""
LEVEL_RATE = 0.1
"""Share of a new score in the running means of scores."""
LEAST_SHARE = 0.05
"""Least mean of false scores above the least score, as a share of the mean false score."""


@dataclass(frozen=True, slots=True, eq=False)
class PDAFState:
    """State: mean (4,), x, y px, vx, vy px/frame; covariance (4, 4); detector and its memory.

    level         running mean of the target's scores
    false_level   running mean of the scores of detections outside the gate
    """

    footage: Footage
    size: tuple[float, float]
    detector: Detector
    memory: Any
    mean: Floats
    covariance: Floats
    level: float
    false_level: float
    monitor: VisibilityMonitor


class PDAF(GatedKalman, MonitoredTracker):
    """Probabilistic data association filter on detections, with amplitude and direction of motion.

    Li 2008, of which only the title is available (PDAF with amplitude). The filter is that of Y. Bar-Shalom, F. Daum,
    J. Huang, "The probabilistic data association filter", IEEE Control Systems 29(6), 2009, eq. 35 to 43; amplitude as
    in D. Lerro, Y. Bar-Shalom, "Interacting multiple model tracking with target amplitude feature", IEEE TAES 29(2),
    1993:

        L_j = P_D N(nu_j; 0, S) / lambda . p1(a_j) / p0(a_j) . exp(-(1 - cos_j) / (2 direction_sd^2))
        beta_j = L_j / (1 - P_D P_G + sum L),   beta_0 = (1 - P_D P_G) / (1 - P_D P_G + sum L)

    with detections j in the gate only; P_G = 1 - exp(-gate / 2) is the probability of the gate. lambda is the number of
    detections in the gate over its area (nonparametric PDAF), or `clutter`. Chosen here: the detector, a difference of
    Gaussians of the start box's size; p1 normal about the running mean of the target's scores; p0 exponential above the
    least score, with the mean of the scores outside the gate; cos_j, between the displacement since the last estimate
    and the velocity, is left out below 1 px/frame. A frame is a hit where beta_0 < 1/2.
    """

    source: ClassVar[str] = "Li 2008; Bar-Shalom, Daum, Huang 2009; Lerro, Bar-Shalom 1993"

    detector: str | None = None
    """Detector, as `irtrack bench --detectors` takes it: NAME or NAME:KEY=VALUE. By default `dog`, of the start box's
    size and the target's polarity, with a threshold of 4."""
    detection_probability: Annotated[float, Field(gt=0, le=1)] = 0.9
    """P_D, probability that the target gives a detection."""
    clutter: Annotated[float | None, Field(gt=0, le=1)] = None
    """lambda, false detections per px^2; by default counted in the gate."""
    amplitude: bool = True
    """True: scores enter the association."""
    amplitude_sd: Ratio = 0.3
    """Standard deviation of p1, as a share of the target's mean score."""
    direction: bool = True
    """True: the direction of motion enters the association."""
    direction_sd: Deviation = 0.5
    """Standard deviation of sqrt(1 - cos), without unit."""
    seen: Fraction = 0.5
    """Least probability that one of the detections is the target, where it counts as visible."""

    @property
    def detector_used(self) -> Detector | None:
        """Detector of the parameter `detector`; None for that of the start box."""
        return None if self.detector is None else parse_detector(self.detector)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> PDAFState:
        """Return the state at the box's centre; the target's score is that of the nearest detection in the box."""
        window, corner = start_window(frame, box)
        detector = self.detector_used
        if detector is None:
            surround = region(frame.image, window, corner, (window.columns, window.rows))[2]
            cold = contrast(window.cut(frame.image, corner), surround) < 0
            psf = min(max(sqrt(box.w * box.h) / 4, PSF[0]), PSF[1])
            separation = max(round(psf), 2)
            detector = DoG(psf=psf, separation=separation, threshold=THRESHOLD, polarity="cold" if cold else "hot")
        memory, found = detected(detector, None, frame)
        apart = np.abs(found.centers - (box.cx, box.cy))
        inside = (apart <= np.array([box.w, box.h]) / 2).all(axis=1)
        own = found.scores[inside]
        others = found.scores[~inside]
        nearest = own[np.hypot(*apart[inside].T).argmin()] if len(own) else THRESHOLD
        mean, covariance = self.start(box)
        return PDAFState(
            footage=footage(frame),
            size=(box.w, box.h),
            detector=detector,
            memory=memory,
            mean=mean,
            covariance=covariance,
            level=float(nearest),
            false_level=float(others.mean()) if len(others) else 0.0,
            monitor=VisibilityMonitor(),
        )

    def step(self, state: PDAFState, frame: Frame, rng: np.random.Generator) -> tuple[PDAFState, Estimate]:
        """Predict, detect, weigh the detections in the gate, update by their mixture."""
        state.footage.check(frame)
        memory, found = detected(state.detector, state.memory, frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        inside = self.gated(mean, covariance, found.centers)
        gated, others = found.take(inside), found.scores[~inside]
        beta = self.probabilities(state, mean, covariance, gated)
        own = float(beta.sum())
        if own > 0:
            states = States(mean[None, None], covariance[None, None], np.ones((1, 1)))
            updated = update_mixture(states, gated.centers, self._measured(mean)[1], beta[None])
            mean, covariance = updated.mean[0, 0], updated.covariance[0, 0]
        level, monitor = state.level, state.monitor.miss()
        if own > self.seen:
            level += LEVEL_RATE * (float(beta @ gated.scores) / own - level)
            monitor = state.monitor.hit()
        false_level = state.false_level
        if len(others):
            average = float(others.mean())
            false_level = average if false_level == 0 else false_level + LEVEL_RATE * (average - false_level)
        after = PDAFState(
            state.footage, state.size, state.detector, memory, mean, covariance, level, false_level, monitor
        )
        return after, kalman_estimate(mean, covariance, state.size, monitor.status(self.lost_after), own)

    def gated(self, mean: Floats, covariance: Floats, centers: Floats) -> np.ndarray:
        """Return a mask (m,) of the detections at centres (m, 2) px in the gate."""
        nu, S = self._innovations(mean, covariance, centers)
        return np.asarray((nu * np.linalg.solve(S, nu.T).T).sum(axis=1) <= self.gate)

    def probabilities(self, state: PDAFState, mean: Floats, covariance: Floats, gated: Detections) -> Floats:
        """Return beta (m,) of the detections in the gate about the predicted mean."""
        if len(gated) == 0:
            return np.zeros(0)
        nu, S = self._innovations(mean, covariance, gated.centers)
        area = pi * self.gate * sqrt(np.linalg.det(S))
        density = self.clutter or len(gated) / area
        squares = (nu * np.linalg.solve(S, nu.T).T).sum(axis=1)
        missed = max(1 - self.detection_probability * (1 - exp(-self.gate / 2)), 1e-15)
        L = log(self.detection_probability / (density * missed * 2 * pi)) - 0.5 * (squares + np.linalg.slogdet(S)[1])
        if self.amplitude:
            L = L + self._amplitude_ratios(state, gated.scores)
        speed = float(np.hypot(*mean[2:]))
        if self.direction and speed >= SLOW:
            moved = gated.centers - state.mean[:2]
            cosines = moved @ mean[2:] / (np.maximum(np.hypot(*moved.T), 1e-9) * speed)
            L = L - (1 - cosines) / (2 * self.direction_sd**2)
        beta: Floats = joint_probabilities(L[None])[0]
        return beta

    def _innovations(self, mean: Floats, covariance: Floats, centers: Floats) -> tuple[Floats, Floats]:
        """Return the innovations (m, 2) px of detections, and their covariance S (2, 2) px^2."""
        H, R = self._measured(mean)
        return centers - H @ mean, H @ covariance @ H.T + R

    def _amplitude_ratios(self, state: PDAFState, scores: Floats) -> Floats:
        """Return ln p1(a) - ln p0(a) (m,), within +- `MOST_AMPLITUDE`."""
        least = min(float(scores.min()), state.false_level or np.inf)
        mean = max(state.false_level - least, LEAST_SHARE * max(state.false_level, least))
        sd = self.amplitude_sd * state.level
        target = -0.5 * ((scores - state.level) / sd) ** 2 - log(sqrt(2 * pi) * sd)
        ratios: Floats = np.clip(target + (scores - least) / mean + log(mean), -MOST_AMPLITUDE, MOST_AMPLITUDE)
        return ratios
