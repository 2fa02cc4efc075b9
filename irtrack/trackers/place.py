"""What `kalman` and `ekf` share: plain measurements of a target's place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import Literal

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame, Image
from irtrack.features.centroid import centroid, contrast
from irtrack.features.correlation import ncc, peak, rival
from irtrack.features.histogram import Surround, epanechnikov_kernel
from irtrack.features.mean_shift import Bandwidth, bandwidth, kernel_histogram, mean_shift
from irtrack.features.quantise import Quantiser, quantiser
from irtrack.features.window import Window, region
from irtrack.trackers.base import Footage, Sight, footage, start_window
from irtrack.trackers.gated import GatedPart, filtered
from irtrack.types import Estimate

BINS = 32
"""Grey levels of the mean shift's histogram: those of Cheng et al. 2006, section 3."""


@dataclass(frozen=True, slots=True, eq=False)
class Grey:
    """The target's grey histogram: of the mean shift's own kernel, and of the window that is judged beside its ring."""

    levels: Quantiser
    reference: Floats
    h: Bandwidth
    surround: Surround
    judged: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """What the first frame says of the target: of these, a measurement uses its own.

    contrast         counts, for centroid
    template, floor  (rows, columns) counts and the best false match's score, for ncc
    grey             for mean_shift
    """

    footage: Footage
    size: tuple[float, float]
    window: Window
    contrast: float
    template: Floats
    floor: float
    grey: Grey

    @classmethod
    def of(cls, frame: Frame, box: Box) -> Target:
        """InputError where the box does not meet the frame, or is none."""
        window, corner = start_window(frame, box)
        patch, center = window.cut(frame.image, corner), (box.cx, box.cy)
        template = patch.astype(np.float64)
        left, top, around = region(frame.image, window, corner, (window.columns, window.rows))
        levels = quantiser(frame, patch, BINS, "first_frame")
        whole = Window.of(box)
        reach = (ceil(whole.columns / 2), ceil(whole.rows / 2))
        surround = Surround.of(whole, epanechnikov_kernel(whole), reach, levels)
        return cls(
            footage=footage(frame),
            size=(box.w, box.h),
            window=window,
            contrast=contrast(patch, around),
            template=template,
            floor=rival(ncc(around, template), (corner[0] - left, corner[1] - top), window),
            grey=Grey(
                levels=levels,
                reference=kernel_histogram(frame.image, center, bandwidth(box), levels)[0],
                h=bandwidth(box),
                surround=surround,
                judged=surround.histograms(frame.image, center)[0][0],
            ),
        )


@dataclass(frozen=True, slots=True, eq=False)
class PlaceState:
    """mean (n,): x, y px, vx, vy px/frame, then what the motion needs besides; and its covariance (n, n)."""

    target: Target
    mean: Floats
    covariance: Floats
    sight: Sight


class PlacePart(GatedPart):
    """A Gaussian filter whose measurement is one of three; where there is none in the gate, the prediction stands."""

    measurement: Literal["centroid", "ncc", "mean_shift"] = "centroid"
    """What gives the target's place in a frame: the centroid of what stands out, the best match of the first
    patch, or the climb to the grey levels most like the target's from the predicted place."""
    threshold: Fraction = 0.5
    """centroid: share of the target's first contrast that a pixel must pass."""
    seen: Fraction = 0.5
    """ncc: share of the way from the best false match's score to the target's usual one that counts as seen;
    mean_shift: from the surrounding ring's likeness."""
    lost_after: int = Field(default=10, ge=1, le=1_000_000)
    """Frames in a row without a measurement after which the status is lost."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> PlaceState:
        """At the box's centre, at rest within `start_speed_sd`."""
        return PlaceState(Target.of(frame, box), *self.start(box), Sight())

    def step(self, state: PlaceState, frame: Frame, rng: np.random.Generator) -> tuple[PlaceState, Estimate]:
        """Predict, measure within the gate, update."""
        target = state.target
        target.footage.check(frame)
        mean, covariance = self.predict(state.mean, state.covariance)
        variance = np.diag(covariance)[:2] + self.measurement_sd**2
        measured, score, sight = self._measure(state, frame.image, mean, variance)
        if measured is not None:
            place = np.array(measured)
            if self.within_gate(mean, covariance, place):
                mean, covariance = self.update(mean, covariance, place)
            else:
                sight = state.sight.unseen()
        after = replace(state, mean=mean, covariance=covariance, sight=sight)
        return after, filtered(mean, covariance, target.size, sight.status(self.lost_after), score)

    def _measure(
        self, state: PlaceState, image: Image, mean: Floats, variance: Floats
    ) -> tuple[tuple[float, float] | None, float | None, Sight]:
        """The place measured about the prediction (None: not seen), its score, and the sight after it."""
        target = state.target
        if self.measurement == "mean_shift":
            return self._climbed(target.grey, state.sight, image, mean)
        window, corner = target.window, target.window.corner((float(mean[0]), float(mean[1])))
        gate = [ceil(min(sqrt(self.gate * v), max(image.shape))) for v in variance.tolist()]
        if self.measurement == "centroid":
            # At least twice the target's size, so that the region's median is the background's level.
            reach = (max(gate[0], ceil(window.columns / 2)), max(gate[1], ceil(window.rows / 2)))
            left, top, pixels = region(image, window, corner, reach)
            found = centroid(pixels, target.contrast, self.threshold)
            if found is None:
                return None, None, state.sight.unseen()
            return (left + found[0], top + found[1]), None, state.sight.seen()
        left, top, pixels = region(image, window, corner, (gate[0], gate[1]))
        (x, y), score = peak(ncc(pixels, target.template))
        sight = state.sight.after(score, target.floor, self.seen)
        return (window.center((left + x, top + y)) if sight.missed == 0 else None), score, sight

    def _climbed(
        self, grey: Grey, sight: Sight, image: Image, mean: Floats
    ) -> tuple[tuple[float, float] | None, float | None, Sight]:
        rest = mean_shift(image, mean[None, :2], grey.h, grey.levels, grey.reference)
        if rest.visible[0] == 0:
            return None, 0.0, sight.unseen()
        x, y = rest.centers[0].tolist()
        judged = grey.surround.judge(image, (x, y), grey.judged)
        sight = sight.after(judged.score, judged.floor, self.seen)
        return ((x, y) if sight.missed == 0 else None), judged.score, sight
