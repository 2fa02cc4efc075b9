"""A scene's own picture behind what moves: learned pixel by pixel, and laid under each new frame.

A normal distribution for each pixel, of running mean and variance (C. Wren, A. Azarbayejani, T. Darrell,
A. Pentland, "Pfinder", IEEE TPAMI 19(7), 1997, section 3.2), in coordinates that go along with the camera.
A frame is laid on it by a shift, a gain and an offset: the shift by phase correlation (C. Kuglin, D. Hines,
1975), then all four by reweighted least squares on the picture's slopes (B. Lucas, T. Kanade, 1981), so
that automatic gain and a camera that pans or shakes are no change. A camera that rolls or zooms is one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import MEDIAN_TO_SIGMA, Image

Grid = npt.NDArray[np.float32]
Hole = tuple[slice, slice]
"""Rows and columns of a part of the picture."""

ROUNDING = 1 / 12
"""Counts^2: the variance that rounding to whole counts gives."""
START_SHIFT = 0.3
"""px. Shift that a pixel's first variance allows for: until it is learned, slopes count as unsure."""
SHIFT = 0.1
"""px. Shift that is always allowed for: how far interpolation and registration err on slopes."""
MOVING_RATE = 0.03
"""Share of the new picture that enters where something else stands: 33 frames until a thing that has come
to rest is background."""
BETTER = 0.98
"""A shift or gain is taken where it brings the mean deviation below this share of what it was without it;
without the bound, noise would make a still camera tremble."""
SURE = 4.0
"""Standard errors by which a jump of more than a pixel has to bring frames nearer. It is the best of all shifts there
are: before an even sky it came to 3.3 by noise alone, in 1,392 frames; jumps of a shaking camera come to 5 and more."""
SMOOTH = 1.0
"""px. Deviation of the normal kernel that frames are smoothed by before they are laid on each other."""
OUTLIER = 9.0
"""Square of the deviations beyond which a residual adds no more to a variance."""
LEAST_SIDE = 16
"""px. Smaller frames are not registered: there is no picture to do it by."""
SMOOTHINGS = 200
"""Passes of a 3 x 3 mean by which a hole is filled from its edge."""


@dataclass(frozen=True, slots=True, eq=False)
class LaidFrame:
    """A frame laid on the backdrop.

    picture    (rows, columns) the frame in the backdrop's grey scale;  mean, variance: what is behind it
    known      (rows, columns) whether the backdrop was ever seen there
    shift      (dx, dy) px between canvas and frame, less than a pixel;  moved: (dx, dy) px that the scene
               moved by since the last frame
    """

    picture: Grid
    mean: Grid
    variance: Grid
    known: npt.NDArray[np.bool_]
    shift: tuple[float, float]
    moved: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Backdrop:
    """mean (counts), variance (counts^2) and number of looks of each pixel, on a canvas of the frame's size.

    The canvas keeps to whole pixels: what is left of the shift stands in `shift`. noise: variance of a
    pixel that does not change, counts^2; gain and offset of the last frame.
    """

    mean: Grid
    variance: Grid
    looks: Grid
    noise: float
    shift: tuple[float, float] = (0.0, 0.0)
    gain: float = 1.0
    offset: float = 0.0

    @classmethod
    def begin(cls, image: Image, hole: Hole) -> Backdrop:
        """By a first frame, of which a part is not the backdrop: that is filled smoothly from its edge, and unsure."""
        picture = image.astype(np.float32)
        rows, columns = hole
        unknown = np.zeros(picture.shape, bool)
        unknown[hole] = True
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
        variance = (noise + START_SHIFT**2 * _steepness(picture)).astype(np.float32)
        variance[unknown] = max(float(ring.var()) if ring.size else 0.0, noise)
        return cls(mean, variance, np.where(unknown, 0, 1).astype(np.float32), noise)

    def lay(self, image: Image, register: bool) -> tuple[Backdrop, LaidFrame]:
        """The backdrop moved under a frame, and how the frame lies on it."""
        raw = image.astype(np.float32)
        moved = self._registered(raw) if register and min(raw.shape) >= LEAST_SIDE else self
        picture = (raw - np.float32(moved.offset)) / np.float32(moved.gain)
        whole = (round(moved.shift[0]), round(moved.shift[1]))
        if any(whole):
            moved = moved._rolled(whole, picture)
        mean = _shifted(moved.mean, moved.shift)
        travel = (
            moved.shift[0] + whole[0] - self.shift[0],
            moved.shift[1] + whole[1] - self.shift[1],
        )
        variance = moved.variance + np.float32(SHIFT**2) * _steepness(mean)
        return moved, LaidFrame(picture, mean, variance, moved.looks >= 1, moved.shift, travel)

    def learn(self, laid: LaidFrame, foreground: Grid, rate: float, hole: Hole | None) -> Backdrop:
        """The backdrop after a frame: quickly where it is the backdrop that is seen, not at all in the hole."""
        share = np.maximum(1 / (self.looks + 1), np.float32(rate))
        open_ = np.ones(foreground.shape, np.float32)
        if hole is not None:
            open_[hole] = 0
        clear = share * (1 - foreground) * open_
        residual = _shifted(laid.picture - laid.mean, (-laid.shift[0], -laid.shift[1]))
        spread = np.minimum(residual**2, OUTLIER * self.variance)
        variance = np.maximum(self.variance + clear * (spread - self.variance), np.float32(self.noise / OUTLIER))
        rates = clear + np.float32(MOVING_RATE) * foreground * open_
        mean = (self.mean + rates * residual).astype(np.float32)
        return replace(self, mean=mean, variance=variance, looks=self.looks + open_)

    def _registered(self, raw: Grid) -> Backdrop:
        """With the shift, gain and offset that bring the backdrop nearest to a frame."""
        # Shifted by half a pixel, noise is smoothed and fits better: so all of it is smooth from the start.
        still, raw = _smooth(self.mean), _smooth(raw)
        best, laid = self, _shifted(still, self.shift)
        apart = best._apart(laid, raw)
        # OpenCV multiplies what it is given by the window, in place.
        (dx, dy), _ = cv2.phaseCorrelate(laid.copy(), raw.copy(), _window(raw.shape))
        coarse = replace(self, shift=(self.shift[0] + dx, self.shift[1] + dy))
        moved = _shifted(still, coarse.shift)
        if abs(dx) < raw.shape[1] / 2 and abs(dy) < raw.shape[0] / 2:
            nearer = coarse._apart(moved, raw)
            is_jump = max(abs(dx), abs(dy)) > 1  # finer steps reach no further
            if nearer.mean() < BETTER * apart.mean() and (not is_jump or _no_chance(apart - nearer)):
                best, laid, apart = coarse, moved, nearer
        for _ in range(2):
            finer = best._refined(laid, raw)
            moved = _shifted(still, finer.shift)
            nearer = finer._apart(moved, raw)
            if not nearer.mean() < BETTER * apart.mean():
                break
            best, laid, apart = finer, moved, nearer
        return best

    def _apart(self, laid: Grid, raw: Grid) -> Grid:
        """How far a frame is from the backdrop laid under it, large deviations cut off; every fourth pixel."""
        apart = np.abs(raw[::2, ::2] - np.float32(self.gain) * laid[::2, ::2] - np.float32(self.offset))
        return np.minimum(apart, np.float32(12 * self.noise**0.5))

    def _refined(self, laid: Grid, raw: Grid) -> Backdrop:
        """One step of least squares, weighted by Cauchy's 1 / (1 + (r / 2 s)^2), s from the median deviation."""
        inner = (slice(1, -1, 2), slice(1, -1, 2))
        across, down = (cv2.Sobel(laid, cv2.CV_32F, *axes, scale=1 / 8)[inner].ravel() for axes in ((1, 0), (0, 1)))
        grey = laid[inner].ravel()
        middle = float(grey.mean())
        residual = raw[inner].ravel() - np.float32(self.gain) * grey - np.float32(self.offset)
        scale = MEDIAN_TO_SIGMA * float(np.median(np.abs(residual))) + ROUNDING
        weights = 1 / (1 + (residual / np.float32(2 * scale)) ** 2)
        slopes = np.stack([-self.gain * across, -self.gain * down, grey - middle, np.ones_like(grey)]).astype(
            np.float64
        )
        # A picture without slopes says nothing of a shift, one without contrast nothing of a gain.
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

    def _rolled(self, whole: tuple[int, int], picture: Grid) -> Backdrop:
        """On a canvas moved by whole pixels; what comes into view is taken from the frame, as seen once."""
        matrix = np.array([[1, 0, whole[0]], [0, 1, whole[1]]], np.float64)
        size = picture.shape[::-1]
        fresh = cv2.warpAffine(np.ones(picture.shape, np.uint8), matrix, size, flags=cv2.INTER_NEAREST) == 0

        def roll(canvas: Grid, new: Grid | float) -> Grid:
            moved = cv2.warpAffine(canvas, matrix, size, flags=cv2.INTER_NEAREST)
            return np.where(fresh, np.float32(new), moved)

        return replace(
            self,
            mean=roll(self.mean, picture),
            variance=roll(self.variance, np.float32(self.noise) + np.float32(START_SHIFT**2) * _steepness(picture)),
            looks=roll(self.looks, 1.0),
            shift=(self.shift[0] - whole[0], self.shift[1] - whole[1]),
        )


def _no_chance(gain: Grid) -> bool:
    """Whether a mean of differences is surely above 0, of those so far apart that smoothing has not tied them."""
    single = gain[::2, ::2]
    error = float(single.std()) / np.sqrt(single.size)
    return bool(single.mean() > SURE * error)


def _smooth(picture: Grid) -> Grid:
    return cv2.GaussianBlur(picture, (0, 0), SMOOTH)  # type: ignore[return-value]  # OpenCV's stubs know no element types


def _steepness(picture: Grid) -> Grid:
    """Squared slope of each pixel, (counts/px)^2 (Sobel)."""
    steep: Grid = (
        cv2.Sobel(picture, cv2.CV_32F, 1, 0, scale=1 / 8) ** 2 + cv2.Sobel(picture, cv2.CV_32F, 0, 1, scale=1 / 8) ** 2
    )
    return steep


def _shifted(picture: Grid, shift: tuple[float, float]) -> Grid:
    """The picture moved by (dx, dy) px, cubic; edges are repeated."""
    if max(abs(shift[0]), abs(shift[1])) < 1e-3:
        return picture
    matrix = np.array([[1, 0, shift[0]], [0, 1, shift[1]]], np.float64)
    return cv2.warpAffine(  # type: ignore[return-value]  # OpenCV's stubs know no element types
        picture, matrix, picture.shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )


@lru_cache(maxsize=4)
def _window(shape: tuple[int, int]) -> Grid:
    return cv2.createHanningWindow(shape[::-1], cv2.CV_32F)  # type: ignore[return-value]  # OpenCV's stubs know no element types
