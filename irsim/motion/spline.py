"""A natural cubic spline through points, read at a parameter or at a distance along the curve."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_PIECES = 16
"""Parts of a span whose lengths are tabulated; with 8 Gauss points each, lengths hold to about 1e-12."""


class Spline:
    """Twice continuously differentiable; straight on past both ends, where its curvature is zero.

    de Boor, A Practical Guide to Splines, ch. IV: natural end conditions.
    """

    def __init__(self, knots: Floats, points: Floats) -> None:
        """knots (n,) strictly rising; points (n, d); n >= 2."""
        self.knots = np.asarray(knots, dtype=np.float64)
        self.points = np.asarray(points, dtype=np.float64)
        self.bends = _second_derivatives(self.knots, self.points)

    def at(self, parameters: Floats) -> Floats:
        """(..., d) points of the curve at parameters (...)."""
        return self._evaluate(np.asarray(parameters, dtype=np.float64))[0]

    def slope(self, parameters: Floats) -> Floats:
        """(..., d) derivatives by the parameter."""
        return self._evaluate(np.asarray(parameters, dtype=np.float64))[1]

    def at_distance(self, distances: Floats) -> Floats:
        """(..., d) points of the curve at distances (...) from its first point, along the curve."""
        distances = np.asarray(distances, dtype=np.float64)
        starts, lengths = self._lengths()
        inside = np.clip(distances, 0.0, lengths[-1])
        piece = np.clip(np.searchsorted(lengths, inside, side="right") - 1, 0, len(starts) - 2)
        start, wanted = starts[piece], inside - lengths[piece]
        width = starts[piece + 1] - start
        parameter = start + width * wanted / (lengths[piece + 1] - lengths[piece])
        for _ in range(4):  # Newton: the table's guess is near, and the error squares in each round
            error = self._length(start, parameter) - wanted
            parameter = parameter - error / np.linalg.norm(self.slope(parameter), axis=-1)
        tangent = self.slope(parameter)
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        return self.at(parameter) + (distances - inside)[..., None] * tangent

    def _evaluate(self, parameter: Floats) -> tuple[Floats, Floats]:
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
        """Length of the curve between parameters that lie in one span."""
        half = (stop - start) / 2
        nodes = (start + half)[..., None] + half[..., None] * _NODES
        return np.asarray(np.linalg.norm(self.slope(nodes), axis=-1) @ _WEIGHTS * half)

    def _lengths(self) -> tuple[Floats, Floats]:
        """Parameters that part each span into pieces, and the curve's length up to each."""
        steps = np.diff(self.knots)[:, None] * np.arange(_PIECES) / _PIECES
        starts = np.append((self.knots[:-1, None] + steps).ravel(), self.knots[-1])
        return starts, np.append(0.0, np.cumsum(self._length(starts[:-1], starts[1:])))


def _second_derivatives(knots: Floats, points: Floats) -> Floats:
    """(n, d) second derivatives at the knots, zero at both ends."""
    count = len(knots)
    matrix = np.eye(count)
    right = np.zeros_like(points)
    width = np.diff(knots)
    slope = np.diff(points, axis=0) / width[:, None]
    for k in range(1, count - 1):
        matrix[k, k - 1 : k + 2] = width[k - 1] / 6, (width[k - 1] + width[k]) / 3, width[k] / 6
        right[k] = slope[k] - slope[k - 1]
    return np.linalg.solve(matrix, right)
