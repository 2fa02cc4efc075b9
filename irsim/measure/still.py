"""What stands still and bright in a picture, and is no bad pixel and no texture: points, and what fills its pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.measure.around import around
from irsim.measure.defects import Defects
from irsim.measure.given import Values
from irsim.measure.interval import ENDS, Measured
from irsim.measure.points import FULL, POINT_REACH, fitted, windows
from irsim.measure.shared import CROSS
from irsim.types import Bools, Floats

_POINTS = 24
"""The brightest that are looked at; those that are one pixel sharp are not among them."""
_LEAST_SIGMA = 0.3
"""A point's, px, at least. No cluster of hot pixels among 2160 passed this and the next, and 11 this alone."""
_WORST = 0.05
"""Greatest difference between a still point and its Gaussian, as a share of its height."""
_REACH_OF_ERROR = ENDS * 2.5
"""Half of a 95 % interval of a still point's sigma over its `error`: what lies beneath it is the same in all frames and
no white noise, so that sigmas scatter 1.2 to 2.7 times as much (77 points rendered on textured grounds)."""
_SHARP = 0.05
"""Of a point of sigma 0.3 px the four neighbours have more than this share of its height in the mean, anywhere."""
_REACHES = 5
"""Sigmas beyond which a point of 10^5 times the noise is not seen."""
_BESIDE = 0.03
"""Share of a full pixel's height that more than a quarter of what touches it has, if light filled it; beside stuck
pixels there is nothing."""


@dataclass(frozen=True, eq=False)
class Still:
    """points: sigmas of those found, px; around_points, full, around_full: masks (rows, columns)."""

    points: tuple[Measured, ...]
    around_points: Bools
    full: Bools
    around_full: Bools

    @property
    def all(self) -> Bools:
        """What is left out of texture and fixed pattern."""
        still: Bools = self.around_points | self.around_full
        return still

    def spared(self, bad: Defects) -> Defects:
        """Bad pixels without those that are so because of a still point, or full of light: there nobody can tell."""
        return bad.where(~self.all)


def still_things(frames: Values, bad: Defects, top: float = math.inf) -> Still:
    """Still points of frames (T, rows, columns), and pixels that light fills to `top`, the highest count there can be.

    A point is told from hot pixels by its skirt: a Gaussian integrated over the pixels fits all of it.
    """
    level = frames.mean(axis=0, dtype=np.float64)
    full = _full(level, top)
    near_full = cv2.dilate(full.astype(np.uint8), np.ones((2 * POINT_REACH + 1,) * 2, np.uint8)).astype(bool)
    points = np.zeros(level.shape, np.uint8)
    sigmas = []
    for row, column, window in windows(level, bad.dead | bad.blinking | _sharp(level) | near_full, _POINTS):
        found = fitted(window)
        if found.is_point and found.sigma > _LEAST_SIGMA and found.worst < _WORST:
            cv2.circle(points, (column, row), math.ceil(_REACHES * found.sigma), 1, cv2.FILLED)
            reach = _REACH_OF_ERROR * found.error
            sigmas.append(Measured(found.sigma, found.sigma - reach, found.sigma + reach))
    return Still(tuple(sigmas), points.astype(bool), full, near_full)


def _sharp(level: Floats) -> Bools:
    """Whether a pixel is alone in what it has above the median of those around."""
    apart = level - around(level)
    beside = cv2.blur(apart, (3, 1)) * 3 + cv2.blur(apart, (1, 3)) * 3 - 2 * apart
    sharp: Bools = (apart > 0) & (beside / 4 < _SHARP * apart)
    return sharp


def _full(level: Floats, top: float) -> Bools:
    """Pixels that are full, but for stuck ones: groups that touch pixels which have light as well."""
    from scipy.ndimage import label

    full = level >= FULL * top
    usual = float(np.median(level))
    groups, count = label(full, np.ones((3, 3)))
    for group in range(1, count + 1):
        inside = groups == group
        rim = cv2.dilate(inside.astype(np.uint8), CROSS).astype(bool) & ~inside
        if rim.any() and float(np.quantile(level[rim], 0.75, method="lower")) - usual < _BESIDE * (top - usual):
            full[inside] = False
    return full
