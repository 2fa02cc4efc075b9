"""Classifiers of several classes on standardised vectors: linear SVMs, a small network, nearest neighbours.

Each gives probabilities. SVMs stand one against the rest, each with Platt's probability; the network has one hidden
layer of tanh units and a softmax, fitted by L-BFGS with a penalty on its weights; of the k nearest neighbours the share
of each class counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack.models.files import read_model
from irtrack.models.svm import LinearSVM, fit_platt, fit_svm

Method = Literal["svm", "network", "neighbours"]
NEIGHBOURS = 5
HIDDEN = 12
"""Hidden units of the network."""
COST, PENALTY = 0.05, 0.02
"""C of the SVMs, and penalty on the squares of the network's weights."""


@dataclass(frozen=True, slots=True, eq=False)
class ClassModel:
    """Classifiers of K classes on vectors (d,), standardised by `mean` and `sd` (d,).

    w (K, d), b, a, c (K,)    SVMs with Platt's a, c
    inner (d + 1, H), outer (H + 1, K)   the network; its last rows are biases
    known (n, d), labels (n,)   standardised neighbours
    """

    classes: tuple[str, ...]
    mean: Floats
    sd: Floats
    w: Floats
    b: Floats
    a: Floats
    c: Floats
    inner: Floats
    outer: Floats
    known: Floats
    labels: npt.NDArray[np.int64]

    @classmethod
    def read(cls, path: Path) -> ClassModel:
        """Return the model of a file; InputError, one line, where it is none."""
        values = read_model(path, "identity")
        arrays = {name: np.array(values[name]) for name in cls.__slots__ if name != "classes"}
        return cls(tuple(values["classes"]), **arrays)

    def values(self) -> dict[str, Any]:
        """Return the values of the model's file."""
        return {name: getattr(self, name) for name in self.__slots__}

    def probabilities(self, vectors: Floats, method: Method = "svm") -> Floats:
        """Return the probabilities (n, K) of the classes of vectors (n, d)."""
        x = (vectors - self.mean) / self.sd
        if method == "network":
            return _network(x, self.inner, self.outer)
        if method == "neighbours":
            apart = (x**2).sum(axis=1)[:, None] - 2 * x @ self.known.T + (self.known**2).sum(axis=1)
            nearest = np.argsort(apart, axis=1, kind="stable")[:, :NEIGHBOURS]
            votes = self.labels[nearest][:, :, None] == np.arange(len(self.classes))
            shares: Floats = votes.mean(axis=1)
            return shares
        odds = 1 / (1 + np.exp(-np.clip(self.a * (x @ self.w.T + self.b) + self.c, -500, 500)))
        return np.asarray(odds / np.maximum(odds.sum(axis=1, keepdims=True), 1e-300))


def fit_classes(
    vectors: Floats,
    labels: npt.NDArray[np.int64],
    held: Floats,
    held_labels: npt.NDArray[np.int64],
    classes: tuple[str, ...],
    rng: np.random.Generator,
) -> ClassModel:
    """Return the classifiers of vectors (n, d) with labels (n,); probabilities of SVMs by the held-out vectors."""
    mean, sd = vectors.mean(axis=0), np.maximum(vectors.std(axis=0), 1e-6)
    x, z = (vectors - mean) / sd, (held - mean) / sd
    machines: list[LinearSVM] = []
    for k in range(len(classes)):
        machine = fit_svm(x, labels == k, COST)
        machines.append(LinearSVM(machine.w, machine.b, *fit_platt(machine.margins(z), held_labels == k)))
    inner, outer = _fit_network(x, labels, len(classes), rng)
    w, b, a, c = (np.array([getattr(each, name) for each in machines]) for name in ("w", "b", "a", "c"))
    return ClassModel(classes, mean, sd, w, b, a, c, inner, outer, x, labels)


def _network(x: Floats, inner: Floats, outer: Floats) -> Floats:
    """Return the softmax outputs (n, K) of a network for inputs (n, d)."""
    scores = np.tanh(x @ inner[:-1] + inner[-1]) @ outer[:-1] + outer[-1]
    grown = np.exp(scores - scores.max(axis=1, keepdims=True))
    return np.asarray(grown / grown.sum(axis=1, keepdims=True))


def _fit_network(
    x: Floats, labels: npt.NDArray[np.int64], count: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Return the weights of least cross entropy plus penalty, by L-BFGS from a random start."""
    from scipy.optimize import minimize  # 0.4 s to import

    n, d = x.shape
    target = (labels[:, None] == np.arange(count)).astype(np.float64)
    shapes = (d + 1, HIDDEN), (HIDDEN + 1, count)
    split = shapes[0][0] * shapes[0][1]

    def loss(flat: Floats) -> tuple[float, Floats]:
        inner, outer = flat[:split].reshape(shapes[0]), flat[split:].reshape(shapes[1])
        hidden = np.tanh(x @ inner[:-1] + inner[-1])
        scores = hidden @ outer[:-1] + outer[-1]
        scores = scores - scores.max(axis=1, keepdims=True)
        logs = scores - np.log(np.exp(scores).sum(axis=1, keepdims=True))
        error = (np.exp(logs) - target) / n
        back = (error @ outer[:-1].T) * (1 - hidden**2)
        slopes = np.concatenate([(x.T @ back).ravel(), back.sum(axis=0), (hidden.T @ error).ravel(), error.sum(axis=0)])
        return float(-(target * logs).sum() / n + PENALTY * flat @ flat / 2), slopes + PENALTY * flat

    start = rng.standard_normal(split + shapes[1][0] * shapes[1][1]) / np.sqrt(d)
    found = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": 300}).x
    return found[:split].reshape(shapes[0]), found[split:].reshape(shapes[1])
