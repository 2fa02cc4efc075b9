"""Linear support vector machine, and probabilities from its margins.

    margin = w . x + b,   min_(w, b)  |w|^2 / 2 + b^2 / 2 + C sum_i max(0, 1 - y_i margin_i)^2
    P(target) = 1 / (1 + exp(-(a margin + c)))

The problem is that of scikit-learn's `LinearSVC` with its defaults (squared hinge loss, bias penalised), solved by the
finite Newton method of S. Keerthi, D. DeCoste, JMLR 6, 2005. Probabilities: J. Platt 1999, fitted as in H. Lin, C. Lin,
R. Weng, "A note on Platt's probabilistic outputs for support vector machines", Machine Learning 68, 2007.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.types import Bools, Floats

STEPS = 100
"""Largest number of Newton steps; some ten suffice."""
TOLERANCE = 1e-9
"""Norm of the gradient, as a share of the first, at which the iteration ends."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearSVM:
    """Linear classifier: weights w (d,), bias b; `a`, `c` of the probability."""

    w: Floats
    b: float
    a: float = 1.0
    c: float = 0.0

    def margins(self, vectors: Floats) -> Floats:
        """Return the margins (n,) of vectors (n, d)."""
        margins: Floats = vectors @ self.w + self.b
        return margins

    def log_probabilities(self, margins: Floats) -> Floats:
        """Return ln P(target) of margins, without overflow."""
        logs: Floats = -np.logaddexp(0.0, -(self.a * margins + self.c))
        return logs


def fit_svm(vectors: Floats, positive: Bools, cost: float = 1.0) -> LinearSVM:
    """Return the linear SVM of vectors (n, d) with the penalty C = `cost`; `positive` (n,): class of each."""
    x = np.column_stack([vectors, np.ones(len(vectors))])
    y = np.where(positive, 1.0, -1.0)
    w = np.zeros(x.shape[1])
    first = None
    for _ in range(STEPS):
        active = y * (x @ w) < 1
        inner = x[active]
        gradient = w + 2 * cost * inner.T @ (inner @ w - y[active])
        size = float(np.linalg.norm(gradient))
        first = size if first is None else first
        if size <= TOLERANCE * max(first, 1e-300):
            break
        hessian = np.eye(len(w)) + 2 * cost * inner.T @ inner
        w = w + _line_step(x, y, w, -np.linalg.solve(hessian, gradient), cost)
    return LinearSVM(w[:-1], float(w[-1]))


def _line_step(x: Floats, y: Floats, w: Floats, direction: Floats, cost: float) -> Floats:
    """Return the step along a direction, halved until the objective falls by Armijo's rule."""

    def objective(at: Floats) -> float:
        slack = np.maximum(1 - y * (x @ at), 0)
        return float(at @ at / 2 + cost * slack @ slack)

    start, step = objective(w), 1.0
    slack = np.maximum(1 - y * (x @ w), 0)
    slope = float((w - 2 * cost * x.T @ (y * slack)) @ direction)
    while step > 1e-10 and objective(w + step * direction) > start + 1e-4 * step * slope:
        step /= 2
    taken: Floats = step * direction
    return taken


def fit_platt(margins: Floats, positive: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """Return a, c of P = 1 / (1 + exp(-(a margin + c))) by the likelihood of held-out margins (n,).

    The targets are Platt's: (n+ + 1) / (n+ + 2) for the n+ positive ones, 1 / (n- + 2) for the others.
    """
    count = int(positive.sum())
    t = np.where(positive, (count + 1) / (count + 2), 1 / (len(margins) - count + 2))
    u = np.column_stack([margins, np.ones(len(margins))])

    def loss(at: Floats) -> float:
        z = u @ at
        return float((np.logaddexp(0, z) - t * z).sum())

    found = np.array([0.0, np.log((count + 1) / (len(margins) - count + 1))])
    for _ in range(STEPS):
        p = 1 / (1 + np.exp(-np.clip(u @ found, -500, 500)))
        gradient = u.T @ (p - t)
        if np.abs(gradient).max() < 1e-8:
            break
        hessian = (u * (p * (1 - p))[:, None]).T @ u + 1e-12 * np.eye(2)
        direction, step = -np.linalg.solve(hessian, gradient), 1.0
        while step > 1e-10 and loss(found + step * direction) > loss(found) + 1e-4 * step * float(gradient @ direction):
            step /= 2
        found = found + step * direction
    return float(found[0]), float(found[1])
