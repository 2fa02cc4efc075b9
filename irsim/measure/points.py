"""The blur of a camera, where a point is seen."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.measure.given import Values
from irsim.measure.interval import LEVEL, Measured
from irsim.measure.picked import evenly
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

_LOOKED_AT = 48
"""Frames, over the whole length."""
POINT_REACH = 5
"""A window reaches that far about a point, px: it tells blurs up to 1.7 px."""
_BRIGHT = 25.0
"""Least height above what is around, in robust sigmas of the picture."""
_POINTS = 6
"""The brightest of a frame that are looked at."""
_MISFIT = 0.03
"""Greatest rms of what a Gaussian leaves, as a share of its height; a bar of 3 px leaves 0.05."""
_RIM = 0.2
"""Greatest rms of a window's rim about a plane, as a share of what its middle lies above that: of 1082 windows that a
Gaussian fits, on slopes, beside edges, other points, waves and noise, the greatest is 0.05, and no misfit that is
allowed makes more than 0.11; edges of a pole have 0.40 to 0.79. Fits are slow, edges have many maxima."""
FULL = 0.99
"""Share of the highest count from which on a well may be full: what a full one holds is read with noise."""
SIGMAS = (0.25, 1.7)
"""A sharper one is a hot pixel, a wider one no point."""
LEAST_POINT_FRAMES = 6
"""An interval of the median needs as many."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A Gaussian fitted to a window: its sigma, px, and what it leaves, rms and at worst, as shares of its height.

    error: standard error of sigma, if what is left were white.
    """

    sigma: float
    error: float
    misfit: float
    worst: float

    @property
    def is_point(self) -> bool:
        low, high = SIGMAS
        return low < self.sigma < high and self.misfit < _MISFIT


def point_blur(frames: Values, bad: Bools, top: float = math.inf) -> Measured | None:
    """Sigma, px, of the sharpest thing seen in frames (T, rows, columns); None where no point is seen.

    It is the blur if that is a point, and more than it if it is not. In each frame, Gaussians integrated
    over the pixels are fitted to what stands out alone; the narrowest that fits counts, and of those the
    median over frames. The interval is that of order statistics, free of assumptions on the scatter. What comes
    near `top`, the highest count there can be, is cut off there: its width says nothing.
    """
    picked = evenly(len(frames), _LOOKED_AT)
    if len(picked) < LEAST_POINT_FRAMES:
        return None
    near_bad = cv2.dilate(bad.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    sharpest = []
    for k in picked:
        picture = np.asarray(frames[k], np.float32)
        whole = (window for *_, window in windows(picture, near_bad, _POINTS) if window.max() < FULL * top)
        found = [spot.sigma for spot in map(fitted, whole) if spot.is_point]
        if found:
            sharpest.append(min(found))
    if len(sharpest) < LEAST_POINT_FRAMES:
        return None
    return _median(np.sort(sharpest))


def windows(picture: Floats, bad: Bools, most: int) -> Iterator[tuple[int, int, Floats]]:
    """Row, column and window of those of the `most` brightest things in a picture (rows, columns) that stand out on all
    sides.

    Then the same of the coldest.
    """
    apart = picture - cv2.GaussianBlur(picture, (0, 0), 2 * POINT_REACH)
    usual = MEDIAN_TO_SIGMA * float(np.median(np.abs(apart)))
    for sign in (1, -1):
        signed = sign * apart
        top = (signed == cv2.dilate(signed, np.ones((2 * POINT_REACH + 1,) * 2, np.uint8))) & (signed > _BRIGHT * usual)
        top[:POINT_REACH] = top[-POINT_REACH:] = top[:, :POINT_REACH] = top[:, -POINT_REACH:] = False
        places = np.argwhere(top & ~bad)
        order = np.argsort(-signed[tuple(places.T)])[:most]
        for row, column in places[order]:
            rows, columns = (slice(at - POINT_REACH, at + POINT_REACH + 1) for at in (row, column))
            window = np.asarray(picture[rows, columns], np.float64)
            if _on_all_sides(window):
                yield int(row), int(column), window


def _on_all_sides(window: Floats) -> bool:
    """Whether the middle of a window stands out from all of its rim, as a point does: what goes on in some direction,
    an edge or a bar, is in the rim as well."""
    y, x = np.mgrid[-POINT_REACH : POINT_REACH + 1, -POINT_REACH : POINT_REACH + 1]
    rim = np.maximum(np.abs(x), np.abs(y)) == POINT_REACH
    plane = np.stack([np.ones(rim.sum()), x[rim], y[rim]], axis=1)
    weights = np.linalg.lstsq(plane, window[rim], rcond=None)[0]
    left = float(np.sqrt(np.mean(np.square(window[rim] - plane @ weights))))
    return left < _RIM * abs(float(window[POINT_REACH, POINT_REACH] - weights[0]))


def fitted(window: Floats) -> Spot:
    """The Gaussian on a plane that fits a window best."""
    from scipy.optimize import least_squares

    y, x = np.mgrid[-POINT_REACH : POINT_REACH + 1, -POINT_REACH : POINT_REACH + 1]
    plane = np.stack([np.ones(window.size), x.ravel(), y.ravel()], axis=1)

    def left(theta: Floats) -> Floats:
        spot = np.outer(_shares(theta[1], theta[2]), _shares(theta[0], theta[2])).ravel()
        basis = np.concatenate([spot[:, None] / spot.max(), plane], axis=1)
        weights = np.linalg.lstsq(basis, window.ravel(), rcond=None)[0]
        return np.asarray((window.ravel() - basis @ weights) / (abs(weights[0]) + 1e-9))

    low, high = SIGMAS
    found = least_squares(left, [0, 0, 0.7], bounds=([-1, -1, low * 0.8], [1, 1, high * 1.2]))
    misfit = float(np.sqrt(np.mean(np.square(found.fun))))
    error = misfit * float(np.sqrt(np.linalg.pinv(found.jac.T @ found.jac)[2, 2]))
    return Spot(float(found.x[2]), error, misfit, float(np.abs(found.fun).max()))


def _shares(centre: float, sigma: float) -> Floats:
    """Share of a unit Gaussian in each pixel of a line about 0."""
    from scipy.special import ndtr

    edges = (np.arange(-POINT_REACH, POINT_REACH + 2) - 0.5 - centre) / sigma
    return np.asarray(np.diff(ndtr(edges)))


def _median(ordered: Floats) -> Measured:
    """Median of numbers that rise, and the interval between two of them (W. R. Thompson, 1936)."""
    from scipy.stats import binom

    count = len(ordered)
    inner = int(binom.ppf((1 - LEVEL) / 2, count, 0.5))
    low, high = max(inner - 1, 0), min(count - inner, count - 1)
    return Measured(float(np.median(ordered)), float(ordered[low]), float(ordered[high]))
