"""Background model: a normal distribution of each pixel, learned over time and registered to each frame.

Each pixel has a running mean and variance (C. Wren, A. Azarbayejani, T. Darrell, A. Pentland,
"Pfinder", IEEE TPAMI 19(7), 1997, section 3.2), in coordinates that move with the camera. A frame is registered by a
shift, a gain and an offset: first the shift by phase correlation (C. Kuglin, D. Hines, 1975), then shift, gain and
offset by reweighted least squares on the picture's slopes (B. Lucas, T. Kanade, 1981). So automatic gain control, pan
and shake of the camera are not foreground; roll and zoom are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import MEDIAN_TO_SIGMA, Image

Grid = npt.NDArray[np.float32]
Region = tuple[slice, slice]
"""Rows and columns of a rectangle of the picture, as slices."""

ROUNDING = 1 / 12
"""Variance of rounding to whole counts, counts^2."""
START_SHIFT = 0.3
"""Registration error in the initial variance of a pixel, px: it changes the grey level where there are slopes."""
SHIFT = 0.1
"""Error of interpolation and registration in every variance, px: it changes the grey level where there are slopes."""
MOVING_RATE = 0.03
"""Share of the new picture that enters the model where it is foreground: an object at rest becomes background in 33
frames."""
BETTER = 0.98
"""Ratio of the mean deviations after and before registration, below which a shift or gain is accepted; at 1, noise
would move the model under a still camera."""
SURE = 4.0
"""Number of standard errors by which a shift of more than a pixel must lower the deviation. Noise on a uniform sky
reached 3.3 in 1,392 frames; shifts of a shaking camera reach 5 and more."""
SMOOTH = 1.0
"""Standard deviation of the normal kernel that smooths frames before registration, px."""
OUTLIER = 9.0
"""Largest squared residual, in variances of the pixel, that enters the variance."""
LEAST_SIDE = 16
"""Least side of a frame that is registered, px."""
SMOOTHINGS = 200
"""Number of passes of a 3 x 3 mean that fill a masked region from its edge."""


@dataclass(frozen=True, slots=True, eq=False)
class RegisteredFrame:
    """Frame registered to the background model.

    picture    (rows, columns) the frame in the model's grey scale;  mean, variance  the model at the frame's pixels
    known      (rows, columns) True where the model has observed the background
    shift      (dx, dy) px between the model's canvas and the frame, less than a pixel
    moved      (dx, dy) px of the scene since the last frame
    """

    picture: Grid
    mean: Grid
    variance: Grid
    known: npt.NDArray[np.bool_]
    shift: tuple[float, float]
    moved: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class BackgroundModel:
    """Mean (counts), variance (counts^2) and number of observations of each pixel, on a canvas of the frame's size.

    The canvas moves with the scene by whole pixels; `shift` is the remaining fraction. `noise`: variance of a pixel at
    rest, counts^2; `gain`, `offset`: those of the last frame.
    """

    mean: Grid
    variance: Grid
    observations: Grid
    noise: float
    shift: tuple[float, float] = (0.0, 0.0)
    gain: float = 1.0
    offset: float = 0.0

    @classmethod
    def initial(cls, image: Image, target: Region) -> BackgroundModel:
        """Return the model of a first frame; the target's region is filled from its edge, with a large variance."""
        picture = image.astype(np.float32)
        rows, columns = target
        unknown = np.zeros(picture.shape, bool)
        unknown[target] = True
        steps = np.abs(np.diff(picture, axis=1))
        noise = max((MEDIAN_TO_SIGMA * float(np.median(steps))) ** 2 / 2, ROUNDING) if steps.size else ROUNDING
        margin = max(rows.stop - rows.start, columns.stop - columns.start)
        around = (
            slice(max(rows.start - margin, 0), rows.stop + margin),
            slice(max(columns.start - margin, 0), columns.stop + margin),
        )
        ring = picture[around][~unknown[around]]
        mean, inside = picture.copy(), np.ascontiguousarray(unknown[around])
        filled = mean[around]
        filled[inside] = np.median(ring) if ring.size else np.median(picture)
        for _ in range(SMOOTHINGS):
            filled[inside] = cv2.blur(filled, (3, 3))[inside]
        variance = (noise + START_SHIFT**2 * squared_slope(picture)).astype(np.float32)
        variance[unknown] = max(float(ring.var()) if ring.size else 0.0, noise)
        return cls(mean, variance, np.where(unknown, 0, 1).astype(np.float32), noise)

    def register(self, image: Image, align: bool) -> tuple[BackgroundModel, RegisteredFrame]:
        """Return the model moved to a frame, and the frame in the model's grey scale; both unchanged if `align` is
        false."""
        raw = image.astype(np.float32)
        moved = self.aligned(raw) if align else self
        picture = (raw - np.float32(moved.offset)) / np.float32(moved.gain)
        whole = (round(moved.shift[0]), round(moved.shift[1]))
        if any(whole):
            moved = moved.rolled(whole, picture)
        mean = shifted(moved.mean, moved.shift)
        travel = (moved.shift[0] + whole[0] - self.shift[0], moved.shift[1] + whole[1] - self.shift[1])
        variance = moved.variance + np.float32(SHIFT**2) * squared_slope(mean)
        return moved, RegisteredFrame(picture, mean, variance, moved.observations >= 1, moved.shift, travel)

    def updated(
        self, registered: RegisteredFrame, foreground: Grid, rate: float, target: Region | None
    ) -> BackgroundModel:
        """Return the model after it learned a frame at `rate` where the background is visible, outside the target."""
        share = np.maximum(1 / (self.observations + 1), np.float32(rate))
        open_ = np.ones(foreground.shape, np.float32)
        if target is not None:
            open_[target] = 0
        clear = share * (1 - foreground) * open_
        residual = shifted(registered.picture - registered.mean, (-registered.shift[0], -registered.shift[1]))
        squares = np.minimum(residual**2, OUTLIER * self.variance)
        variance = np.maximum(self.variance + clear * (squares - self.variance), np.float32(self.noise / OUTLIER))
        rates = clear + np.float32(MOVING_RATE) * foreground * open_
        mean = (self.mean + rates * residual).astype(np.float32)
        return replace(self, mean=mean, variance=variance, observations=self.observations + open_)

    def aligned(self, raw: Grid) -> BackgroundModel:
        """Return the model with the shift, gain and offset that fit it best to a frame; unchanged for a small frame."""
        if min(raw.shape) < LEAST_SIDE:
            return self
        # Model and frame are smoothed first: interpolation at half a pixel smooths noise, and would always fit better.
        still, raw = _smooth(self.mean), _smooth(raw)
        best, under = self, shifted(still, self.shift)
        deviation = best._deviation(under, raw)
        # OpenCV multiplies its arguments by the window in place.
        (dx, dy), _ = cv2.phaseCorrelate(under.copy(), raw.copy(), _window(raw.shape))
        coarse = replace(self, shift=(self.shift[0] + dx, self.shift[1] + dy))
        moved = shifted(still, coarse.shift)
        if abs(dx) < raw.shape[1] / 2 and abs(dy) < raw.shape[0] / 2:
            nearer = coarse._deviation(moved, raw)
            is_jump = max(abs(dx), abs(dy)) > 1  # least squares find shifts up to a pixel
            if nearer.mean() < BETTER * deviation.mean() and (not is_jump or _significant(deviation - nearer)):
                best, under, deviation = coarse, moved, nearer
        for _ in range(2):
            finer = best._refined(under, raw)
            moved = shifted(still, finer.shift)
            nearer = finer._deviation(moved, raw)
            if not nearer.mean() < BETTER * deviation.mean():
                break
            best, under, deviation = finer, moved, nearer
        return best

    def _deviation(self, under: Grid, raw: Grid) -> Grid:
        """Return the absolute deviation of a frame from the model at its pixels, clipped; every fourth pixel."""
        apart = np.abs(raw[::2, ::2] - np.float32(self.gain) * under[::2, ::2] - np.float32(self.offset))
        return np.minimum(apart, np.float32(12 * self.noise**0.5))

    def _refined(self, under: Grid, raw: Grid) -> BackgroundModel:
        """Return the model after one step of least squares with weights 1 / (1 + (r / 2 s)^2), s from the median of the
        residuals r."""
        inner = (slice(1, -1, 2), slice(1, -1, 2))
        across, down = (cv2.Sobel(under, cv2.CV_32F, *axes, scale=1 / 8)[inner].ravel() for axes in ((1, 0), (0, 1)))
        grey = under[inner].ravel()
        middle = float(grey.mean())
        residual = raw[inner].ravel() - np.float32(self.gain) * grey - np.float32(self.offset)
        scale = MEDIAN_TO_SIGMA * float(np.median(np.abs(residual))) + ROUNDING
        weights = 1 / (1 + (residual / np.float32(2 * scale)) ** 2)
        slopes = np.stack([-self.gain * across, -self.gain * down, grey - middle, np.ones_like(grey)]).astype(
            np.float64
        )
        # A picture without slopes does not determine a shift, and one without contrast does not determine a gain.
        least = np.array([0.01 * self.noise, 0.01 * self.noise, 1.0, 1e-3]) * 1e-3 * grey.size
        dx, dy, gain, offset = np.linalg.solve(
            (slopes * weights) @ slopes.T + np.diag(least), (slopes * weights) @ residual
        )
        if not 0.5 < (self.gain + gain) < 2:
            gain = 0.0
        return replace(
            self,
            shift=(self.shift[0] + float(np.clip(dx, -1, 1)), self.shift[1] + float(np.clip(dy, -1, 1))),
            gain=self.gain + float(gain),
            offset=self.offset + float(offset) - float(gain) * middle,
        )

    def rolled(self, whole: tuple[int, int], picture: Grid) -> BackgroundModel:
        """Return the model on a canvas moved by whole pixels; pixels new in view are taken from the frame."""
        matrix = np.array([[1, 0, whole[0]], [0, 1, whole[1]]], np.float64)
        size = picture.shape[::-1]
        fresh = cv2.warpAffine(np.ones(picture.shape, np.uint8), matrix, size, flags=cv2.INTER_NEAREST) == 0

        def roll(canvas: Grid, new: Grid | float) -> Grid:
            moved = cv2.warpAffine(canvas, matrix, size, flags=cv2.INTER_NEAREST)
            return np.where(fresh, np.float32(new), moved)

        unsure = np.float32(self.noise) + np.float32(START_SHIFT**2) * squared_slope(picture)
        return replace(
            self,
            mean=roll(self.mean, picture),
            variance=roll(self.variance, unsure),
            observations=roll(self.observations, 1.0),
            shift=(self.shift[0] - whole[0], self.shift[1] - whole[1]),
        )


def _significant(gain: Grid) -> bool:
    """Return whether the mean of `gain`, subsampled to be uncorrelated, is above 0 by `SURE` standard errors."""
    single = gain[::2, ::2]
    error = float(single.std()) / np.sqrt(single.size)
    return bool(single.mean() > SURE * error)


def _smooth(picture: Grid) -> Grid:
    return cv2.GaussianBlur(picture, (0, 0), SMOOTH)  # type: ignore[return-value]  # OpenCV's stubs have no element types


def squared_slope(picture: Grid) -> Grid:
    """Return the squared slope of each pixel, (counts/px)^2 (Sobel)."""
    squares: Grid = (
        cv2.Sobel(picture, cv2.CV_32F, 1, 0, scale=1 / 8) ** 2 + cv2.Sobel(picture, cv2.CV_32F, 0, 1, scale=1 / 8) ** 2
    )
    return squares


def shifted(picture: Grid, shift: tuple[float, float]) -> Grid:
    """Return the picture moved by (dx, dy) px, by cubic interpolation; edges are repeated."""
    if max(abs(shift[0]), abs(shift[1])) < 1e-3:
        return picture
    matrix = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float64)
    return cv2.warpAffine(  # type: ignore[return-value]  # OpenCV's stubs have no element types
        picture, matrix, picture.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )


@lru_cache(maxsize=4)
def _window(shape: tuple[int, int]) -> Grid:
    return cv2.createHanningWindow(shape[::-1], cv2.CV_32F)  # type: ignore[return-value]  # OpenCV's stubs have no element types
