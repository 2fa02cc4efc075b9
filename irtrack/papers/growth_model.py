"""The growth model, on which Li and Li 2014 (section 5.1) compare filters, and the filters, many runs at once.

    x_k = x_{k-1} / 2 + 25 x_{k-1} / (1 + x_{k-1}^2) + 8 cos(1.2 k) + w_k,   y_k = x_k^2 / 20 + v_k

(Gordon, Salmond, Smith, IEE Proceedings F 140, 1993, section 4.1, there with k - 1 in the cosine.) The
source prints only the variances of w, 10, and of v, 1; k counts from 1, and x_0 is normal with
variance 2 for truth and particles alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.rng import stream
from irsim.types import Floats
from irtrack.filters.particle import Weights, ess, normalise
from irtrack.filters.resampling import Restoring, after_selection, largest_first, systematic_copies

PROCESS_VARIANCE, MEASUREMENT_VARIANCE, START_VARIANCE = 10.0, 1.0, 2.0


@dataclass(frozen=True, slots=True)
class GrowthFilter:
    """A particle filter that resamples systematically; as it stands, the bootstrap filter.

    particles  N
    share      Np / N: the particles of largest weight that are averaged and, when it is time,
               resampled among themselves (Li, Li 2014, section 2: .56); 1: all
    threshold  Nth / N: resampled where Neff is below (section 4.3: 2/3); 1: at every step
    restoring  weights after that, see `irtrack.filters.resampling.after_selection`
    """

    particles: int = 100
    share: float = 1.0
    threshold: float = 1.0
    restoring: Restoring = "own"


BOOTSTRAP = GrowthFilter()
WSPF = GrowthFilter(share=0.56, threshold=2 / 3)


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """Runs of the model: states x (runs, steps) and measurements y (runs, steps), k = 1 .. steps."""

    states: Floats
    measurements: Floats

    @classmethod
    def of(cls, runs: int, seed: int, steps: int = 100) -> Growth:
        """Independent runs; run i of a seed depends on how many there are."""
        rng = stream(seed, "growth", "truth")
        states = np.empty((runs, steps))
        x = np.sqrt(START_VARIANCE) * rng.standard_normal(runs)
        for k in range(1, steps + 1):
            x = moved(x, k) + np.sqrt(PROCESS_VARIANCE) * rng.standard_normal(runs)
            states[:, k - 1] = x
        noise = np.sqrt(MEASUREMENT_VARIANCE) * rng.standard_normal(states.shape)
        return cls(states, states**2 / 20 + noise)


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """estimates (runs, steps); neff (runs, steps) over all particles, before resampling."""

    estimates: Floats
    neff: Floats


def moved(x: Floats, k: int) -> Floats:
    """The state a step on, without its noise."""
    after: Floats = x / 2 + 25 * x / (1 + x * x) + 8 * np.cos(1.2 * k)
    return after


def run(growth: Growth, filter: GrowthFilter, seed: int) -> Filtered:
    """The filter on every run at once: predict, weigh, choose, estimate, resample."""
    runs, steps = growth.measurements.shape
    n = filter.particles
    count = max(1, round(filter.share * n))
    estimates, neff = np.empty((runs, steps)), np.empty((runs, steps))
    rng = stream(seed, "growth", "filter")
    x = np.sqrt(START_VARIANCE) * rng.standard_normal((runs, n))
    weights = np.full((runs, n), 1 / n)
    for k in range(1, steps + 1):
        x = moved(x, k)
        x += np.sqrt(PROCESS_VARIANCE) * rng.standard_normal((runs, n))
        weights = weighed(weights, growth.measurements[:, k - 1, None], x)
        if count < n:
            order = largest_first(weights, count)
            x, weights = np.take_along_axis(x, order, axis=1), np.take_along_axis(weights, order, axis=1)
        kept = normalise(weights[:, :count])
        estimates[:, k - 1] = np.einsum("rn,rn->r", kept, x[:, :count])
        neff[:, k - 1] = ess(weights)
        due = neff[:, k - 1] < filter.threshold * n
        x[due, :count] = resampled(x[due, :count], kept[due], rng)
        weights[due] = after_selection(weights[due], count, filter.restoring)
    return Filtered(estimates, neff)


def weighed(weights: Floats, y: Floats, x: Floats) -> Floats:
    """(R, N) weights times p(y | x), each row summing to one; y (R, 1), x (R, N)."""
    return Weights(-((y - x * x / 20) ** 2), weights, 0.5 / MEASUREMENT_VARIANCE).W


def resampled(x: Floats, weights: Floats, rng: np.random.Generator) -> Floats:
    """(R, N) systematic resampling of each row."""
    return np.repeat(x.ravel(), systematic_copies(weights, rng).ravel()).reshape(x.shape)


def rmse(growth: Growth, filtered: Filtered) -> Floats:
    """(runs,) root of the mean squared error over the steps of each run."""
    roots: Floats = np.sqrt(np.mean((filtered.estimates - growth.states) ** 2, axis=1))
    return roots
