"""Least-squares fit of a point's image: place, amplitude and level, with the covariance of the place.

The image of a point is a normal curve integrated over pixels. Under white noise the fit reaches the Cramer-Rao bound
(S. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory", 1993, section 3.9).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import erf, exp, pi, sqrt

import numpy as np

from irsim.types import Floats
from irtrack.features.background import Grid

ITERATIONS = 3
"""Number of Gauss-Newton steps; from half a pixel off, a third step changes the place by less than .001 px."""
REACH = 3
"""Half side of the square that is fitted, px."""
WIDTHS = (0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.5, 1.8)
"""Standard deviations of point images that are tried, px."""


@dataclass(frozen=True, slots=True)
class PointFit:
    """Place (x, y) px, its covariance (2, 2) px^2, amplitude (sum of counts), and residual variance, counts^2."""

    center: tuple[float, float]
    covariance: Floats
    amplitude: float
    residual: float


def fit_point(picture: Grid, center: tuple[float, float], width: float) -> PointFit | None:
    """Return the fit of a point of standard deviation `width`, px, near a centre; None where none is found: at the
    frame's edge, without an amplitude, or more than 1.5 px off."""
    column, row = round(center[0]), round(center[1])
    left, top = column - REACH, row - REACH
    if left < 0 or top < 0 or column + REACH >= picture.shape[1] or row + REACH >= picture.shape[0]:
        return None
    values = picture[top : row + REACH + 1, left : column + REACH + 1].astype(np.float64).ravel()
    side = 2 * REACH + 1
    x, y = center[0] - left, center[1] - top
    basis = np.ones((side * side, 4))
    amplitude = 0.0
    for _ in range(ITERATIONS):
        across, slope_x = _line(x, width, side)
        down, slope_y = _line(y, width, side)
        basis[:, 0] = np.outer(down, across).ravel()
        if amplitude == 0.0:
            amplitude = _amplitude(basis[:, 0], values)
            if amplitude == 0.0:
                return None
        basis[:, 1] = amplitude * np.outer(down, slope_x).ravel()
        basis[:, 2] = amplitude * np.outer(slope_y, across).ravel()
        normal = basis.T @ basis
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return None
        amplitude_now, dx, dy, level = (inverse @ (basis.T @ values)).tolist()
        x, y, amplitude = x + min(max(dx, -0.7), 0.7), y + min(max(dy, -0.7), 0.7), amplitude_now
        if max(abs(x + left - center[0]), abs(y + top - center[1])) > 1.5 or amplitude == 0.0:
            return None
    residual = values - amplitude * np.outer(_line(y, width, side)[0], _line(x, width, side)[0]).ravel() - level
    variance = float(residual @ residual) / (side * side - 4)
    return PointFit((x + left, y + top), variance * inverse[1:3, 1:3], amplitude, variance)


def fitted_width(picture: Grid, center: tuple[float, float]) -> float | None:
    """Return the standard deviation of `WIDTHS` that leaves the least residual near a centre, px; None without a
    fit."""
    fits = [(fit.residual, width) for width in WIDTHS if (fit := fit_point(picture, center, width)) is not None]
    return min(fits)[1] if fits else None


def _amplitude(shape: Floats, values: Floats) -> float:
    shape = shape - shape.mean()
    return float(shape @ values) / float(shape @ shape)


def _line(at: float, width: float, side: int) -> tuple[Floats, Floats]:
    """Return the integral over each pixel of a normal curve about `at`, and its derivative with respect to `at`."""
    edges = [(k - 0.5 - at) / width for k in range(side + 1)]
    whole = [erf(edge / sqrt(2)) / 2 for edge in edges]
    height = [exp(-edge * edge / 2) / (width * sqrt(2 * pi)) for edge in edges]
    return np.diff(whole), -np.diff(height)
