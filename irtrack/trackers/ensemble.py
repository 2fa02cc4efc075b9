"""`ensemble`: mean shift on the confidence of an ensemble of pixel classifiers that learns from each frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.types import Box, Floats, Frame, Image
from irtrack.features.ensemble import SIDE, Ensemble, pixel_features
from irtrack.features.quantiser import first_quantiser
from irtrack.features.window import Window
from irtrack.trackers.base import Footage, MonitoredTracker, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate

CONVERGED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 0.5)
"""Mean shift: at most 20 steps, or until a step is shorter than half a pixel."""


@dataclass(frozen=True, slots=True, eq=False)
class EnsembleState:
    """State: center (2,) px; grey range of the first frame, counts; the ensemble."""

    footage: Footage
    size: tuple[float, float]
    window: Window
    levels: tuple[float, float]
    ensemble: Ensemble
    first: tuple[Floats, Floats]
    center: Floats
    monitor: VisibilityMonitor


class EnsembleTracker(MonitoredTracker):
    """Ensemble of weak pixel classifiers, target against surroundings; mean shift on the map of their votes.

    S. Avidan, "Ensemble Tracking", IEEE TPAMI 29(2), 2007. A pixel has 9 features: an orientation histogram of 8 bins
    over 5 x 5 px, and its grey level in place of colour. Weak classifiers are planes of least squares, weighted by
    AdaBoost; in each frame the best are kept, weighted anew, and new ones are trained (Algorithm 2). Pixels of the
    box's ellipse are positive, those of a ring around it negative.

    Chosen here: classes weigh alike; the map of positive scores is searched within one box side beyond the window;
    frames without a hit teach nothing; pixels of the first frame are learned again in each frame (`anchor`), since
    classifiers that learn from their own estimates drift. The score is the share of the ellipse's pixels that are
    classified as target, and its background score the same share of the ring.
    """

    source: ClassVar[str] = "Avidan 2007"

    classifiers: int = Field(default=5, ge=1, le=50)
    """Number of weak classifiers (section 4: 5)."""
    renewed: int = Field(default=1, ge=0, le=50)
    """Number of classifiers trained anew in a frame; 0: the first ensemble stays, with its votes."""
    anchor: int = Field(default=3, ge=0, le=20)
    """Number of times that the first frame's pixels count among those of a frame that teaches; 0: not (Avidan)."""
    ring: Annotated[float, Field(ge=0.2, le=5)] = 0.5
    """Width of the ring, in sides of the box."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> EnsembleState:
        """Return the ensemble trained on the first frame."""
        part, corner = start_window(frame, box)
        levels = first_quantiser(frame, part.cut(frame.image, corner), 32, "first_frame")
        state = EnsembleState(
            footage=footage(frame),
            size=(box.w, box.h),
            window=Window.of(box),
            levels=(float(levels.low), float(levels.high)),
            ensemble=Ensemble(np.zeros((0, 10)), np.zeros(0)),
            first=(np.zeros((0, 9)), np.zeros(0)),
            center=np.array([box.cx, box.cy]),
            monitor=VisibilityMonitor(),
        )
        features, labels = self._examples(state, frame.image, state.center)
        return replace(state, ensemble=Ensemble.fitted(features, labels, self.classifiers), first=(features, labels))

    def step(self, state: EnsembleState, frame: Frame, rng: np.random.Generator) -> tuple[EnsembleState, Estimate]:
        """Classify the pixels about the last place, move by mean shift, learn where the target is visible."""
        state.footage.check(frame)
        center = self._shifted(state, frame.image)
        features, labels = self._examples(state, frame.image, center)
        inside, hits = labels > 0, state.ensemble.scores(features) > 0
        score = float(hits[inside].mean()) if inside.any() else 0.0
        background = float(hits[~inside].mean()) if (~inside).any() else 0.0
        monitor = state.monitor.after(score, background, self.seen) if inside.any() else state.monitor.miss()
        ensemble = state.ensemble
        if monitor.misses == 0 and self.renewed > 0:
            keep = max(self.classifiers - self.renewed, 0)
            for _ in range(self.anchor):
                features = np.concatenate([features, state.first[0]])
                labels = np.concatenate([labels, state.first[1]])
            ensemble = ensemble.updated(features, labels, self.classifiers, keep)
        x, y = center.tolist()
        vx, vy = (center - state.center).tolist()
        status = monitor.status(self.lost_after) if inside.any() else "lost"
        after = replace(state, ensemble=ensemble, center=center, monitor=monitor)
        return after, Estimate((x, y), state.size, status, score, velocity=(vx, vy))

    def _examples(self, state: EnsembleState, image: Image, center: Floats) -> tuple[Floats, Floats]:
        """Return features (n, 9) and labels (n,) of the pixels of the ellipse and the ring that are in the frame."""
        rx, ry = (max(round(self.ring * side), 1) for side in (state.window.columns, state.window.rows))
        left, top, right, bottom = self._region(state, image, center, (rx, ry))
        if right <= left or bottom <= top:
            return np.zeros((0, 9)), np.zeros(0)
        features = pixel_features(image, (left, top, right, bottom), *state.levels)
        x, y = state.window.corner((float(center[0]), float(center[1])))
        rows, columns = np.arange(top, bottom)[:, None], np.arange(left, right)
        w, h = state.window.columns, state.window.rows
        inside = (columns >= x) & (columns < x + w) & (rows >= y) & (rows < y + h)
        ellipse = ((columns - x + 0.5) * 2 / w - 1) ** 2 + ((rows - y + 0.5) * 2 / h - 1) ** 2 <= 1
        labels = np.where(ellipse, 1.0, np.where(inside, 0.0, -1.0))
        return features[labels != 0], labels[labels != 0]

    def _shifted(self, state: EnsembleState, image: Image) -> Floats:
        """Return the centre (2,) px to which mean shift moves the window on the map of positive scores.

        The window is wider by `SIDE` on each side than the box: features reach beyond the target, and a window that
        their plateau fills would stay.
        """
        window = state.window
        margin = window.columns + SIDE, window.rows + SIDE
        left, top, right, bottom = self._region(state, image, state.center, margin)
        if right - left < 1 or bottom - top < 1:
            return state.center
        scores = state.ensemble.scores(pixel_features(image, (left, top, right, bottom), *state.levels))
        weights = np.maximum(scores, 0).astype(np.float32)
        x, y = window.corner((float(state.center[0]), float(state.center[1])))
        columns, rows = min(window.columns + 2 * SIDE, right - left), min(window.rows + 2 * SIDE, bottom - top)
        x = min(max(x - SIDE - left, 0), right - left - columns)
        y = min(max(y - SIDE - top, 0), bottom - top - rows)
        _, (x, y, w, h) = cv2.meanShift(weights, (x, y, columns, rows), CONVERGED)
        moments = cv2.moments(weights[y : y + h, x : x + w])
        if moments["m00"] <= 0:
            return state.center
        return np.array([moments["m10"], moments["m01"]]) / moments["m00"] + (left + x, top + y)

    def _region(
        self, state: EnsembleState, image: Image, center: Floats, margin: tuple[int, int]
    ) -> tuple[int, int, int, int]:
        """Return (left, top, right, bottom) of the window at a centre and a margin (x, y) px, inside the frame."""
        x, y = state.window.corner((float(center[0]), float(center[1])))
        left, top = max(x - margin[0], 0), max(y - margin[1], 0)
        right = min(x + state.window.columns + margin[0], image.shape[1])
        bottom = min(y + state.window.rows + margin[1], image.shape[0])
        return left, top, right, bottom
