"""`imm_mf`: several hypotheses, each an IMM, on pixels that differ from a registered background and resemble the
target."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, floor, sqrt
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Fraction
from irsim.types import Box, Floats, Frame
from irtrack.features.background import BackgroundModel, Grid, Region, RegisteredFrame
from irtrack.features.background_window import WindowedBackground
from irtrack.features.extent import Extent, extent
from irtrack.features.foreground import GreyDensities, local_foreground, peaks
from irtrack.features.likeness import Likeness
from irtrack.features.point_fit import fit_point, fitted_width
from irtrack.filters.multiple_model import MultipleModel, constant_velocity_model
from irtrack.filters.track_splitting import Hypotheses, Scores, Splitting
from irtrack.trackers.base import Deviation, Footage, MonitoredTracker, VisibilityMonitor, footage, start_window
from irtrack.types import Estimate

POINT_PX = 4.5
"""Longest side of a target that is located by the fit of a point, px."""
KERNEL, LEAST_KERNEL = 0.25, 0.8
"""Deviation of the kernel that averages the foreground: in sides of the target, and its least value, px."""
PARTIAL = 3.0
"""Growth of the standard deviation of a detection's position with the share by which its score falls short of the
target's level, in mean sides of the target."""
WHOLE = 0.8
"""Least share of the target's level at which a detection shows the whole target."""
LEAST = 0.25
"""Score below which a peak is no detection."""
MOST_DETECTIONS = 30
"""Largest number of detections in a frame; the highest are taken."""
NEIGHBOUR = 1.5
"""Distance, in mean sides, within which another object keeps the target from being learned."""
UNOBSERVED = 0.6
"""Factor of the foreground under the start box, where no background has been observed: once the target has left, the
difference from a guessed background must not hold the track."""
ALIKE = 0.6
"""Least share of the target's level at which another object counts as similar."""
APART_RATE = 0.1
"""Share of a new frame in the running mean of each cue's distinction, its value at the target less the largest
elsewhere."""
TEMPER = 0.1
"""Difference of the distinctions of two cues that changes the odds of their weights by a factor of e."""


@dataclass(frozen=True, slots=True, eq=False)
class ImmState:
    """State: size (w, h) px of the box, extent of the target in it and width of a point's image; background, grey
    densities, likeness; the target's usual foreground and score; how far foreground and likeness distinguish it;
    hypotheses."""

    footage: Footage
    size: tuple[float, float]
    offset: tuple[float, float]
    target: tuple[float, float]
    width: float | None
    background: WindowedBackground
    greys: GreyDensities
    likeness: Likeness
    shape: Likeness
    usual: float
    level: float
    apart: tuple[float, float]
    hypotheses: Hypotheses
    monitor: VisibilityMonitor


@dataclass(frozen=True, slots=True, eq=False)
class Cues:
    """Foreground in units of the usual one, likeness, and their mean (rows, columns), of a region of a frame."""

    foreground: Grid
    likeness: Grid
    score: Grid


class ImmMF(MonitoredTracker):
    """Several hypotheses by an IMM, on places that differ from the background and resemble the target.

    No paper describes it. Frames are registered to a learned background (`irtrack.features.background_window`). The
    score of a place is the weighted geometric mean of its foreground and its likeness to the first and to a slowly
    learned patch (`irtrack.features.likeness`); the cue that distinguishes the target better has the larger weight
    (R. Collins, Y. Liu, M. Leordeanu, "Online selection of discriminative tracking features", IEEE TPAMI 27(10), 2005).
    Maxima are detections; points are located by least squares. Two constant-velocity models, one for manoeuvres, mix
    (Blom, Bar-Shalom 1988); doubtful detections split the track, and other objects have tracks of their own
    (`irtrack.filters.track_splitting`). The gate grows with the covariance while the target is hidden. Patch, levels
    and grey levels are learned only while the whole target is seen, alone and beyond doubt.
    """

    source: ClassVar[str] = "after Smith, Buechler 1975; Blom, Bar-Shalom 1988; Collins, Liu, Leordeanu 2005"

    acceleration: Deviation = 0.1
    """Standard deviation of the acceleration on each axis in steady motion, px/frame^2."""
    manoeuvre: Deviation = 0.5
    """Standard deviation of the acceleration in a manoeuvre, px/frame^2."""
    start_speed_sd: Deviation = 2.0
    """Standard deviation of the unknown first speed on each axis, px/frame."""
    gate: Deviation = 16.0
    """Largest squared Mahalanobis distance of a detection; chi-square, 2 degrees: 99.97 %."""
    clutter: Annotated[float, Field(gt=0, le=1)] = 0.03
    """False detections per frame on the area of the target."""
    detection: Annotated[float, Field(gt=0.01, lt=0.999)] = 0.95
    """Probability that a visible target gives a detection."""
    hypotheses: Annotated[int, Field(ge=1, le=50)] = 5
    """Largest number of hypotheses."""
    weight: Annotated[float, Field(ge=0, le=1)] | None = None
    """Weight of the foreground in the score; the likeness has the rest. By default, both follow from the frames: the
    cue that distinguishes the target better has the larger weight."""
    learn: Fraction = 0.1
    """Share of a new frame that enters the background model, where the background is visible."""
    patch_rate: Fraction = 0.05
    """Share of a new patch that enters the learned patch."""
    register_frames: bool = True
    """True: frames are registered to the background by shift, gain and offset."""

    @cached_property
    def bank(self) -> MultipleModel:
        """Motion models, steady and manoeuvring; a manoeuvre lasts five frames in the mean."""
        models = [constant_velocity_model(each, 4) for each in (self.acceleration, self.manoeuvre)]
        return MultipleModel(models, np.array([[0.97, 0.03], [0.2, 0.8]]))

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> ImmState:
        """Return the initial state: the object in the box, its patch and grey levels, and the background without it."""
        start_window(frame, box)
        image, picture = frame.image, frame.image.astype(np.float32)
        found = extent(picture, box)
        region = _region((box.cx, box.cy), (box.w / 2 + 1, box.h / 2 + 1), image.shape)
        model = BackgroundModel.initial(image, region)
        y, x = np.ogrid[: image.shape[0], : image.shape[1]]
        (cx, cy), (w, h) = found.center, found.size
        ellipse = np.maximum(1 - ((x - cx) / (w / 2 + 0.5)) ** 2 - ((y - cy) / (h / 2 + 0.5)) ** 2, 0)
        greys = GreyDensities.of(image, region, ellipse)
        width = fitted_width(picture, found.center) if max(found.size) <= POINT_PX else None
        center = self._first(picture, found, width)
        mean_side = (w * h) ** 0.5
        margin = min(max(2.0, 0.35 * mean_side), 3.0)
        likeness = Likeness.of(picture, center, (max(3, round(w / 2 + margin)), max(3, round(h / 2 + margin))))
        shape = Likeness.of(picture - model.mean, center, likeness.reach)
        background = WindowedBackground(model)
        heights = local_foreground(_foreground(greys, background.compare(image, region)), _kernel(found.size))
        usual = float(heights.max(initial=0.1))
        shift = (box.cx - center[0], box.cy - center[1])
        return ImmState(
            footage=footage(frame),
            size=(box.w, box.h),
            offset=shift if max(map(abs, shift)) > 0.5 else (0.0, 0.0),
            target=found.size,
            width=width,
            background=background,
            greys=greys,
            likeness=likeness,
            shape=shape,
            usual=max(usual, 0.1),
            level=1.0,
            apart=(0.3, 0.3),
            hypotheses=Hypotheses.started(self.bank, center, _noise_sd(found.size), self.start_speed_sd),
            monitor=VisibilityMonitor(),
        )

    def _first(self, picture: Grid, found: Extent, width: float | None) -> tuple[float, float]:
        fit = fit_point(picture, found.center, width) if width is not None else None
        return found.center if fit is None else fit.center

    def step(self, state: ImmState, frame: Frame, rng: np.random.Generator) -> tuple[ImmState, Estimate]:
        """Register the background, find detections near the hypotheses, split and prune, learn the target where it is
        certain."""
        state.footage.check(frame)
        image, picture = frame.image, frame.image.astype(np.float32)
        background, moved = state.background.register(image, self.register_frames)
        predicted = state.hypotheses.predicted(self.bank, moved)
        region = self._search(state, predicted, image.shape)
        registered = background.compare(image, region)
        foreground = _foreground(state.greys, registered)
        departure = np.zeros_like(picture)
        departure[region] = registered.picture - registered.mean
        cues = self._cues(state, foreground, picture, departure, region)
        corner = (region[1].start, region[0].start)
        reach = tuple(max(1, int(0.6 * side)) for side in state.target)
        places, quality = peaks(cues.score, (reach[0], reach[1]), LEAST, MOST_DETECTIONS)
        columns, rows = np.minimum(np.rint(places).astype(int), np.array(cues.score.shape[::-1]) - 1).T
        shown = cues.foreground[rows, columns].astype(np.float64)
        side = (state.target[0] * state.target[1]) ** 0.5
        difference = picture[region] if state.width is None else registered.picture - registered.mean
        places, noises = self._located(state, predicted, difference, places, shown, side, corner)
        centers = places + np.array(corner)
        after = self._rules(state, side).advance(
            predicted, self.bank, centers, quality, noises, state.level, Scores(0.2, LEAST, 0.2)
        )
        mean, covariance = after.states.moments()
        x, y, vx, vy = mean[0].tolist()
        sure = self._is_sure(after, mean, side)
        monitor = state.monitor.hit() if after.misses[0] == 0 and sure else state.monitor.miss()
        learned = replace(state, background=background, hypotheses=after, monitor=monitor)
        whole = _region(
            (x + state.offset[0], y + state.offset[1]), (state.size[0] / 2 + 1, state.size[1] / 2 + 1), image.shape
        )
        taken = int(after.detection[0])
        if taken >= 0 and sure and shown[taken] > WHOLE and self._is_alone(after, state.level, side):
            learned = self._learned(
                learned, cues, picture, departure, foreground, region, (x, y), float(quality[taken]), registered
            )
        waiting = monitor.misses < self.lost_after
        learned = replace(
            learned,
            background=background.learned(
                image, region, registered, foreground, self.learn, whole if waiting else None
            ),
        )
        apart = mean[:, :2] - mean[0, :2]
        spread = np.einsum("n,ni,nj->ij", after.probabilities, apart, apart)
        return learned, Estimate(
            center=(x + state.offset[0], y + state.offset[1]),
            size=state.size,
            status=monitor.status(self.lost_after),
            score=float(quality[taken]) if taken >= 0 else 0.0,
            velocity=(vx, vy),
            covariance=covariance[0, :2, :2] + spread,
        )

    def _search(self, state: ImmState, predicted: Hypotheses, shape: tuple[int, ...]) -> Region:
        """Return the region about the hypotheses: three sides, and four deviations of the prediction."""
        mean, covariance = predicted.states.moments()
        reach = 4 * np.sqrt(np.maximum(covariance[:, (0, 1), (0, 1)], 0.0)) + 12 + 2.5 * np.array(state.target)
        low, high = (mean[:, :2] - reach).min(axis=0), (mean[:, :2] + reach).max(axis=0)
        spans = []
        for axis, length in ((1, shape[0]), (0, shape[1])):
            least = min(length, 24)
            first = min(max(floor(low[axis]), 0), length - least)
            spans.append(slice(first, max(min(ceil(high[axis]) + 1, length), first + least)))
        return spans[0], spans[1]

    def _cues(self, state: ImmState, foreground: Grid, picture: Grid, departure: Grid, region: Region) -> Cues:
        heights = local_foreground(foreground, _kernel(state.target)) / np.float32(state.usual)
        alike = np.maximum(state.likeness.map(picture, region), state.shape.map(departure, region))
        w = self.weight
        if w is None:
            w = min(max(1 / (1 + np.exp((state.apart[1] - state.apart[0]) / TEMPER)), 0.25), 0.75)
        score = np.exp(
            np.float32(w) * np.log(np.clip(heights, 0.02, 1 / UNOBSERVED)) + np.float32(1 - w) * np.log(alike)
        )
        return Cues(heights, alike, score)

    def _located(
        self,
        state: ImmState,
        predicted: Hypotheses,
        difference: Grid,
        places: Floats,
        shown: Floats,
        side: float,
        corner: tuple[int, int],
    ) -> tuple[Floats, Floats]:
        """Return places (m, 2) px and covariances (m, 2, 2) px^2 of detections; points near hypotheses are fitted."""
        lacking = np.maximum(0.9 - shown, 0.0) * PARTIAL * side
        noises = (_noise_sd(state.target) ** 2 + lacking**2)[:, None, None] * np.eye(2)
        if state.width is not None and len(places):
            places = places.copy()
            near = predicted.states.moments()[0][:, :2] - np.array(corner)
            distance = ((places[:, None] - near[None]) ** 2).sum(axis=-1).min(axis=1)
            for row in np.argsort(distance, kind="stable")[:2].tolist():
                fit = fit_point(difference, (places[row, 0], places[row, 1]), state.width)
                if fit is not None:
                    places[row] = fit.center
                    noises[row] += fit.covariance + (0.03**2 - _noise_sd(state.target) ** 2) * np.eye(2)
        return places, noises

    def _rules(self, state: ImmState, side: float) -> Splitting:
        return Splitting(
            noise=max(_noise_sd(state.target), 0.5) ** 2 * np.eye(2),
            detection=self.detection,
            clutter=self.clutter / max(side, 3.0) ** 2,
            gate=self.gate,
            most=self.hypotheses,
            apart=max(0.6 * side, 2.0),
            speed=self.start_speed_sd,
        )

    def _is_sure(self, after: Hypotheses, mean: Floats, side: float) -> bool:
        """Return whether the hypotheses at the best one's place have most of the probability."""
        near = (np.abs(mean[:, :2] - mean[0, :2]) < max(side, 3.0)).all(axis=1)
        return bool(after.probabilities[near].sum() > 0.7)

    def _is_alone(self, after: Hypotheses, level: float, side: float) -> bool:
        objects = after.objects
        others = objects.take(np.flatnonzero((objects.age >= 3) & (objects.level > ALIKE * level)))
        if not len(others.age):
            return True
        apart = others.states.moments()[0][:, :2] - after.states.moments()[0][0, :2]
        return bool((np.hypot(apart[:, 0], apart[:, 1]) > NEIGHBOUR * side).all())

    def _learned(
        self,
        state: ImmState,
        cues: Cues,
        picture: Grid,
        departure: Grid,
        foreground: Grid,
        region: Region,
        center: tuple[float, float],
        quality: float,
        registered: object,
    ) -> ImmState:
        """Return the state after it learned patch, levels and grey levels from the target at a centre."""
        rate = self.patch_rate
        x, y = center[0] - region[1].start, center[1] - region[0].start
        row = min(max(round(y), 0), cues.score.shape[0] - 1)
        column = min(max(round(x), 0), cues.score.shape[1] - 1)
        height = float(cues.foreground[row, column])
        apart = tuple(
            old + APART_RATE * (_distinction(cue, row, column, state.target) - old)
            for old, cue in zip(state.apart, (cues.foreground, cues.likeness), strict=True)
        )
        own = _region((x, y), (state.target[0] / 2, state.target[1] / 2), cues.score.shape)
        return replace(
            state,
            likeness=state.likeness.learned(picture, center, rate),
            shape=state.shape.learned(departure, center, rate),
            usual=max(state.usual * (1 + rate * (height - 1)), 0.05),
            level=min(max(state.level + rate * (quality - state.level), 0.4), 1.1),
            apart=(apart[0], apart[1]),
            greys=state.greys.updated(registered, foreground, own, rate),  # type: ignore[arg-type]
        )


def _foreground(greys: GreyDensities, registered: RegisteredFrame) -> Grid:
    """Return the probability of the target's pixels; nearer to one half where no background has been observed."""
    found = greys.foreground(registered)
    return np.where(registered.known, found, np.float32(0.5) + np.float32(UNOBSERVED) * (found - np.float32(0.5)))


def _distinction(cue: Grid, row: int, column: int, size: tuple[float, float]) -> float:
    """Return the value of a cue at the target less its largest value elsewhere in the region."""
    y, x = max(2, round(size[1])), max(2, round(size[0]))
    inside = (slice(max(row - y, 0), row + y + 1), slice(max(column - x, 0), column + x + 1))
    outside = cue.copy()
    outside[inside] = 0
    return float(cue[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2].max() - outside.max())


def _noise_sd(size: tuple[float, float]) -> float:
    return max(0.4, 0.1 * sqrt(size[0] * size[1]))


def _kernel(size: tuple[float, float]) -> tuple[float, float]:
    return max(KERNEL * size[0], LEAST_KERNEL), max(KERNEL * size[1], LEAST_KERNEL)


def _region(center: tuple[float, float], half: tuple[float, float], shape: tuple[int, ...]) -> Region:
    """Return rows and columns within half sides (x, y) px of a centre; empty where they are outside the frame."""

    def span(at: float, reach: float, length: int) -> slice:
        low, high = floor(at - reach), ceil(at + reach) + 1
        return slice(min(max(low, 0), length), min(max(high, 0), length))

    return span(center[1], half[1], shape[0]), span(center[0], half[0], shape[1])
