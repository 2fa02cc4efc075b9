"""Curves: circular arcs at constant speed, and natural cubic splines evaluated by parameter or by arc length."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.base import Several
from irsim.config.quantities import Number
from irsim.motion.base import path_error
from irsim.types import Floats

Leg = Annotated[tuple[Number, Number, Number], Field(strict=False)]
Legs = Several[Leg]


def check_legs(legs: Sequence[tuple[float, float, float]]) -> None:
    """Raise PydanticCustomError at the key `turns` unless legs [from, to, rate] follow each other from frame 0 on."""
    ends = [end for leg in legs for end in leg[:2]]
    for index, (first, last, _) in enumerate(legs):
        if first < 0 or last <= first:
            raise path_error(
                "the turn from frame {first} to {last} is impossible; allowed: [from, to, rate] with 0 <= from < to",
                *("turns", index),
                first=first,
                last=last,
            )
    if any(b < a for a, b in pairwise(ends)):
        raise path_error("the turns overlap; allowed: turns one after the other", "turns")


def arcs(frames: Floats, legs: Sequence[tuple[float, float, float]], speed: float) -> Floats:
    """Return the displacement since frame 0, (n, 2), of a motion in arcs that begins along the first axis.

    legs   (from, to, rad per frame) in order, turning the first axis towards the second; straight elsewhere
    speed  distance per frame
    """
    frames = np.asarray(frames, dtype=np.float64)
    knots = np.array([0.0, *(end for leg in legs for end in leg[:2])])
    rates = np.array([0.0, *(rate for leg in legs for rate in (leg[2], 0.0))])
    spans = np.diff(knots)
    headings = np.append(0.0, np.cumsum(rates[:-1] * spans))
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(chord(speed, headings[:-1], rates[:-1], spans), axis=0)])
    leg = np.maximum(np.searchsorted(knots, frames, side="right") - 1, 0)
    rate = np.where(frames < 0, 0.0, rates[leg])
    return np.asarray(places[leg] + chord(speed, headings[leg], rate, frames - knots[leg]))


def chord(speed: float, heading: Floats, rate: Floats, frames: Floats) -> Floats:
    """Return the chord (n, 2) of an arc at a constant turn rate over frames (n,)."""
    length = speed * frames * np.sinc(rate * frames / (2 * np.pi))
    direction = heading + rate * frames / 2
    return np.stack([length * np.cos(direction), length * np.sin(direction)], axis=-1)


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_PIECES = 16
"""Parts of a span with tabulated arc length; with 8 Gauss points each, lengths are exact to about 1e-12."""


class Spline:
    """Natural cubic spline through points; it continues straight past both ends.

    de Boor, A Practical Guide to Splines, ch. IV: natural end conditions.
    """

    def __init__(self, knots: Floats, points: Floats) -> None:
        """Interpolate points (n, d) at strictly rising knots (n,), n >= 2."""
        self.knots = np.asarray(knots, dtype=np.float64)
        self.points = np.asarray(points, dtype=np.float64)
        self.bends = _second_derivatives(self.knots, self.points)

    def at(self, parameters: Floats) -> Floats:
        """Return points (..., d) at parameters (...)."""
        return self._evaluate(parameters)[0]

    def slope(self, parameters: Floats) -> Floats:
        """Return derivatives (..., d) by the parameter."""
        return self._evaluate(parameters)[1]

    def at_distance(self, distances: Floats) -> Floats:
        """Return points (..., d) at arc lengths (...) from the first point."""
        distances = np.asarray(distances, dtype=np.float64)
        starts, lengths = self._lengths()
        inside = np.clip(distances, 0.0, lengths[-1])
        piece = np.clip(np.searchsorted(lengths, inside, side="right") - 1, 0, len(starts) - 2)
        start, wanted = starts[piece], inside - lengths[piece]
        width = starts[piece + 1] - start
        parameter = start + width * wanted / (lengths[piece + 1] - lengths[piece])
        for _ in range(4):  # Newton: the first guess from the table is close, and the error is squared in each step
            error = self._length(start, parameter) - wanted
            parameter = parameter - error / np.linalg.norm(self.slope(parameter), axis=-1)
        tangent = self.slope(parameter)
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        return self.at(parameter) + (distances - inside)[..., None] * tangent

    def _evaluate(self, parameter: Floats) -> tuple[Floats, Floats]:
        """Return points and derivatives, each (..., d)."""
        inside = np.clip(parameter, self.knots[0], self.knots[-1])
        span = np.clip(np.searchsorted(self.knots, inside, side="right") - 1, 0, len(self.knots) - 2)
        width = (self.knots[span + 1] - self.knots[span])[..., None]
        right = (inside - self.knots[span])[..., None] / width
        left = 1 - right
        p0, p1 = self.points[span], self.points[span + 1]
        m0, m1 = self.bends[span], self.bends[span + 1]
        value = left * p0 + right * p1 + ((left**3 - left) * m0 + (right**3 - right) * m1) * width**2 / 6
        slope = (p1 - p0) / width + ((3 * right**2 - 1) * m1 - (3 * left**2 - 1) * m0) * width / 6
        return value + (parameter - inside)[..., None] * slope, slope

    def _length(self, start: Floats, stop: Floats) -> Floats:
        """Return the arc length between two parameters of one span."""
        half = (stop - start) / 2
        nodes = (start + half)[..., None] + half[..., None] * _NODES
        return np.asarray(np.linalg.norm(self.slope(nodes), axis=-1) @ _WEIGHTS * half)

    def _lengths(self) -> tuple[Floats, Floats]:
        """Return parameters that divide each span between knots, and the arc length up to each of them."""
        steps = np.diff(self.knots)[:, None] * np.arange(_PIECES) / _PIECES
        starts = np.append((self.knots[:-1, None] + steps).ravel(), self.knots[-1])
        return starts, np.append(0.0, np.cumsum(self._length(starts[:-1], starts[1:])))


def _second_derivatives(knots: Floats, points: Floats) -> Floats:
    """Return second derivatives (n, d) at the knots, zero at both ends."""
    count = len(knots)
    right = np.zeros_like(points)
    width = np.diff(knots)
    slope = np.diff(points, axis=0) / width[:, None]
    if count > _DENSE:
        right[1:-1] = np.diff(slope, axis=0)
        return _solve_tridiagonal(width / 6, (width[:-1] + width[1:]) / 3, right)
    matrix = np.eye(count)
    for k in range(1, count - 1):
        matrix[k, k - 1 : k + 2] = width[k - 1] / 6, (width[k - 1] + width[k]) / 3, width[k] / 6
        right[k] = slope[k] - slope[k - 1]
    return np.linalg.solve(matrix, right)


_DENSE = 512
"""Largest number of knots whose equations are solved by a dense matrix; for more, time and memory would grow fast."""


def _solve_tridiagonal(beside: Floats, middle: Floats, right: Floats) -> Floats:
    """Return the solution (n, d) of the symmetric equations beside[k-1] x[k-1] + middle[k-1] x[k] + beside[k] x[k+1] =
    right[k] for k within 1 .. n-2, x zero at both ends, by elimination and substitution (Thomas)."""
    count = len(right)
    found, factors = right.copy(), np.zeros(count)
    for k in range(1, count - 1):
        pivot = middle[k - 1] - beside[k - 1] * factors[k - 1]
        factors[k] = beside[k] / pivot
        found[k] = (right[k] - beside[k - 1] * found[k - 1]) / pivot
    for k in range(count - 2, 0, -1):
        found[k] -= factors[k] * found[k + 1]
    return found
