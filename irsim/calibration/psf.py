"""PSF: sigma of the sharpest point, by elliptical Gaussians fitted to still and passing points.

The minor axis measures the blur, as motion blur and most of an object's size lie along the major axis. An object may be
larger than a point, so that the sigma is an upper bound of the lens's blur.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.calibration.bad_pixels import FULL
from irsim.calibration.statistics import Estimate, Values, evenly, order_median
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

SIGMAS = (0.3, 1.7)
"""Least and greatest sigma of a point, px: hot pixels are sharper, extended objects wider."""
_REACH = 5
"""Half width of the window about a point, px."""
_FRAMES = 48
_LEAST_POINTS = 6
_POINTS = 3
"""Number of points fitted in a picture, the brightest ones."""
_BRIGHT = 25.0
"""Least height of a point, in robust sigmas of the picture."""
_MISFIT = 0.03
"""Largest rms of the fit's residual, as a fraction of the point's height. A bar of 3 px leaves 0.05."""
_RIM = 0.2
"""Largest rms of a window's rim about a plane, as a fraction of the point's height. Edges have 0.4 and more."""
_OVERSAMPLED = 4
_SYSTEMATIC = 0.01
"""Relative error of a sigma by response time, gain differences and the sampling of the model."""
_STILL_ERROR = 2.5
"""Factor on the error of a still point. The background beneath it is the same in all frames and not white."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Gaussian fitted to a window: sigmas of its axes, px, standard error of the minor one, px, and rms of the residual
    as a fraction of the height, `misfit`."""

    minor: float
    major: float
    error: float
    misfit: float

    @property
    def is_point(self) -> bool:
        low, high = SIGMAS
        return low < self.minor <= self.major < 2 * high and self.minor < high and self.misfit < _MISFIT


def point_blur(frames: Values, bad: Bools, top: float, still: bool) -> tuple[Estimate | None, int]:
    """Return the sigma, px, of the sharpest point in frames (T, rows, columns), and the number of still points.

    bad     (rows, columns) mask of bad pixels
    top     highest possible count; points near it are clipped
    still   True for a still scene: points are searched in the mean, and in each frame less the median of frames

    For a passing point the interval is that of the median over frames, for a still point that of the fit.
    """
    picked = evenly(len(frames), _FRAMES)
    near_bad = cv2.dilate(bad.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    scene = np.median(frames[picked], axis=0) if still else np.zeros(bad.shape)
    found: list[Estimate] = []
    standing = 0
    if still:
        level = frames.mean(axis=0, dtype=np.float64)
        for window, peak in _windows(level, level, near_bad):
            spot = fit_spot(window)
            if spot.is_point and peak < FULL * top:
                standing += 1
                reach = math.hypot(1.96 * _STILL_ERROR * spot.error, _SYSTEMATIC * spot.minor)
                found.append(Estimate(spot.minor, spot.minor - reach, spot.minor + reach))
    sharpest = []
    for k in picked:
        windows = _windows(frames[k] - scene, frames[k], near_bad)
        spots = [fit_spot(window) for window, peak in windows if peak < FULL * top]
        if points := [spot.minor for spot in spots if spot.is_point]:
            sharpest.append(min(points))
    if len(sharpest) >= _LEAST_POINTS:
        blur = order_median(np.array(sharpest))
        reach = _SYSTEMATIC * blur.value
        found.append(Estimate(blur.value, blur.low - reach, blur.high + reach))
    return min(found, key=lambda sigma: sigma.high, default=None), standing


def _windows(picture: Floats, counts: Values, bad: Bools) -> Iterator[tuple[Floats, float]]:
    """Yield windows about the brightest and coldest isolated peaks of a picture, with the counts at the peaks."""
    values = np.asarray(picture, np.float32)
    apart = values - cv2.GaussianBlur(values, (0, 0), 2 * _REACH)
    usual = MEDIAN_TO_SIGMA * float(np.median(np.abs(apart)))
    square = np.ones((2 * _REACH + 1,) * 2, np.uint8)
    for sign in (1, -1):
        signed = sign * apart
        peaks = (signed == cv2.dilate(signed, square)) & (signed > _BRIGHT * usual) & ~bad
        peaks[:_REACH] = peaks[-_REACH:] = peaks[:, :_REACH] = peaks[:, -_REACH:] = False
        places = np.argwhere(peaks)
        for row, column in places[np.argsort(-signed[tuple(places.T)])[:_POINTS]]:
            rows, columns = (slice(at - _REACH, at + _REACH + 1) for at in (row, column))
            window = np.asarray(picture[rows, columns], np.float64)
            if not bad[rows, columns].any() and _isolated(window):
                yield window, float(counts[row, column])


def _isolated(window: Floats) -> bool:
    """Return True where the middle of a window stands out from its whole rim, unlike at an edge or a bar."""
    y, x = np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1]
    rim = np.maximum(np.abs(x), np.abs(y)) == _REACH
    plane = np.stack([np.ones(rim.sum()), x[rim], y[rim]], axis=1)
    weights = np.linalg.lstsq(plane, window[rim], rcond=None)[0]
    left = math.sqrt(float(np.mean(np.square(window[rim] - plane @ weights))))
    return left < _RIM * abs(float(window[_REACH, _REACH] - weights[0]))


def fit_spot(window: Floats) -> Spot:
    """Return the least-squares fit to a window of an elliptical Gaussian, integrated over pixels, plus a plane."""
    from scipy.optimize import least_squares

    side = 2 * _REACH + 1
    fine = (np.arange(side * _OVERSAMPLED) + 0.5) / _OVERSAMPLED - side / 2
    y, x = np.meshgrid(fine, fine, indexing="ij")
    rows, columns = np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1]
    plane = np.stack([np.ones(window.size), columns.ravel(), rows.ravel()], axis=1)

    def residual(theta: Floats) -> Floats:
        across, down, minor, ratio, angle = theta
        u = (x - across) * math.cos(angle) + (y - down) * math.sin(angle)
        v = (y - down) * math.cos(angle) - (x - across) * math.sin(angle)
        spot = np.exp(-((u / (minor * ratio)) ** 2 + (v / minor) ** 2) / 2)
        pixels = spot.reshape(side, _OVERSAMPLED, side, _OVERSAMPLED).mean(axis=(1, 3)).ravel()
        basis = np.concatenate([pixels[:, None] / max(pixels.max(), 1e-12), plane], axis=1)
        weights = np.linalg.lstsq(basis, window.ravel(), rcond=None)[0]
        return np.asarray((window.ravel() - basis @ weights) / (abs(weights[0]) + 1e-9))

    angle = _major_angle(window)
    low = [-1.0, -1.0, 0.8 * SIGMAS[0], 1.0, angle - 1.6]
    high = [1.0, 1.0, 1.2 * SIGMAS[1], 4.0, angle + 1.6]
    found = least_squares(residual, [0.0, 0.0, 0.7, 1.05, angle], bounds=(low, high), xtol=1e-5, ftol=1e-5)
    misfit = math.sqrt(float(np.mean(np.square(found.fun))))
    error = misfit * math.sqrt(float(np.linalg.pinv(found.jac.T @ found.jac)[2, 2]))
    return Spot(float(found.x[2]), float(found.x[2] * found.x[3]), error, misfit)


def _major_angle(window: Floats) -> float:
    """Return the angle of a peak's major axis, rad, from second moments about the window's middle."""
    height = window - np.median(window)
    height = np.clip(height * np.sign(height[_REACH, _REACH]), 0, None)
    y, x = np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1]
    return 0.5 * math.atan2(2 * float((height * x * y).sum()), float((height * (x**2 - y**2)).sum()))
