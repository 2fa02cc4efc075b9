"""Growth model of Li and Li 2014 (section 5.1): the standard particle filter and weight selection, many runs at once.

    x_k = x_{k-1} / 2 + 25 x_{k-1} / (1 + x_{k-1}^2) + 8 cos(1.2 k) + w_k,   y_k = x_k^2 / 20 + v_k

(Gordon, Salmond, Smith, IEE Proceedings F 140, 1993, section 4.1, with k - 1 in the cosine.) The paper prints only the
variances of w, 10, and of v, 1. Here k counts from 1, and x_0 is normal with variance 2 for truth and particles.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, replace

import numpy as np

from irsim.rng import stream
from irsim.types import Floats
from irtrack.filters.particle import Weights, ess, normalise
from irtrack.filters.resampling import Restoring, after_selection, largest_first, systematic_copies
from irtrack.papers.verdicts import Verdict, judge

PROCESS_VARIANCE, MEASUREMENT_VARIANCE, START_VARIANCE = 10.0, 1.0, 2.0


@dataclass(frozen=True, slots=True)
class GrowthFilter:
    """Particle filter with systematic resampling; by default the bootstrap filter.

    particles  N
    share      Np / N: share of the particles that are averaged and resampled, those of largest weight (Li, Li 2014,
               section 2: .56); 1: all particles
    threshold  Nth / N: particles are resampled where Neff is below Nth (section 4.3: 2/3); 1: at every step, 0: never
    restoring  weights after resampling, see `irtrack.filters.resampling.after_selection`
    """

    particles: int = 100
    share: float = 1.0
    threshold: float = 1.0
    restoring: Restoring = "own"


BOOTSTRAP = GrowthFilter()
WSPF = GrowthFilter(share=0.56, threshold=2 / 3)
PARTICLES = (50, 100, 200, 500)
SHARES = (0.1, 0.2, 0.3, 0.4, 0.56, 0.7, 0.85, 1.0)
STANDARDS = {"SIR": BOOTSTRAP, "SIS": replace(BOOTSTRAP, threshold=0)}
"""Readings of the standard particle filter: resampled at every step, or never."""
SELECTIONS = {"WSPF, own weights": WSPF, "WSPF, equal weights": replace(WSPF, restoring="equal")}
"""Readings of Step 6: particles set aside keep their weights, or all get the same."""
FILTERS = STANDARDS | SELECTIONS
SHARED = 100
"""Number of particles N in the sweep over the share Np / N."""
RUNS_A_SEED = 20
"""Number of runs of the model per seed of the other experiments: a thousand for 50 seeds."""


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """Truth of many runs of the model: states x and measurements y, (runs, steps) each, k = 1 .. steps."""

    states: Floats
    measurements: Floats

    @classmethod
    def of(cls, runs: int, seed: int, steps: int = 100) -> Growth:
        """Draw independent runs; the values of run i depend on the seed and on the number of runs."""
        rng = stream(seed, "growth", "truth")
        states = np.empty((runs, steps))
        x = np.sqrt(START_VARIANCE) * rng.standard_normal(runs)
        for k in range(1, steps + 1):
            x = transition(x, k) + np.sqrt(PROCESS_VARIANCE) * rng.standard_normal(runs)
            states[:, k - 1] = x
        noise = np.sqrt(MEASUREMENT_VARIANCE) * rng.standard_normal(states.shape)
        return cls(states, states**2 / 20 + noise)


@dataclass(frozen=True, slots=True, eq=False)
class Estimates:
    """Estimated states (runs, steps), and effective sample sizes (runs, steps) of all particles before resampling."""

    estimates: Floats
    neff: Floats


def transition(x: Floats, k: int) -> Floats:
    """Return the next state without its noise."""
    after: Floats = x / 2 + 25 * x / (1 + x * x) + 8 * np.cos(1.2 * k)
    return after


def run(growth: Growth, filter: GrowthFilter, seed: int) -> Estimates:
    """Run the filter on all runs at once: predict, weigh, select, estimate, resample."""
    runs, steps = growth.measurements.shape
    n = filter.particles
    count = max(1, round(filter.share * n))
    estimates, neff = np.empty((runs, steps)), np.empty((runs, steps))
    rng = stream(seed, "growth", "filter")
    x = np.sqrt(START_VARIANCE) * rng.standard_normal((runs, n))
    weights = np.full((runs, n), 1 / n)
    for k in range(1, steps + 1):
        x = transition(x, k)
        x += np.sqrt(PROCESS_VARIANCE) * rng.standard_normal((runs, n))
        weights = reweight(weights, growth.measurements[:, k - 1, None], x)
        if count < n:
            order = largest_first(weights, count)
            x, weights = np.take_along_axis(x, order, axis=1), np.take_along_axis(weights, order, axis=1)
        kept = normalise(weights[:, :count])
        estimates[:, k - 1] = np.einsum("rn,rn->r", kept, x[:, :count])
        neff[:, k - 1] = ess(weights)
        due = neff[:, k - 1] < filter.threshold * n
        copies = systematic_copies(kept[due], rng)
        x[due, :count] = np.repeat(x[due, :count].ravel(), copies.ravel()).reshape(copies.shape)
        weights[due] = after_selection(weights[due], count, filter.restoring)
    return Estimates(estimates, neff)


def reweight(weights: Floats, y: Floats, x: Floats) -> Floats:
    """Return (R, N) weights times p(y | x), each row with sum one; y (R, 1), x (R, N)."""
    return Weights(-((y - x * x / 20) ** 2), weights, 0.5 / MEASUREMENT_VARIANCE).W


def rmse(growth: Growth, filtered: Estimates) -> Floats:
    """Return the root mean square error over the steps of each run, (runs,)."""
    roots: Floats = np.sqrt(np.mean((filtered.estimates - growth.states) ** 2, axis=1))
    return roots


@dataclass(frozen=True, eq=False)
class FilterRuns:
    """Results of one filter: rmse (runs,), mean Neff over the steps (runs,), CPU time of one step of one run, µs."""

    rmse: Floats
    neff: Floats
    us: float

    @property
    def error(self) -> float:
        """Standard error of the mean of rmse."""
        return float(self.rmse.std(ddof=1) / np.sqrt(len(self.rmse)))

    @classmethod
    def of(cls, truth: Growth, filter: GrowthFilter, seed: int) -> FilterRuns:
        """Run a filter on all runs and measure its CPU time."""
        begin = time.process_time()
        done = run(truth, filter, seed)
        took = time.process_time() - begin
        return cls(rmse(truth, done), done.neff.mean(axis=1), 1e6 * took / truth.states.size)


@dataclass(frozen=True, eq=False)
class GrowthResult:
    """Results by filter and N, and results of weight selection at N = SHARED by share Np / N."""

    by_particles: dict[str, dict[int, FilterRuns]]
    by_share: dict[float, FilterRuns]
    runs: int

    def verdicts(self) -> list[Verdict]:
        """Judge the claims of sections 2 and 5.1, run by run on the same truth."""
        found = []
        for label, standard, n in itertools.product(SELECTIONS, STANDARDS, PARTICLES):
            ours, theirs = self.by_particles[label][n], self.by_particles[standard][n]
            than, place = f"that of {standard}, N = {n}", "section 5.1, table 1"
            neff, error = f"mean Neff of {label} above {than}", f"RMSE of {label} below {than}"
            found += [
                _verdict("Weight selection raises Neff.", place, neff, ours.neff > theirs.neff),
                _verdict("It lowers the root mean square error.", place, error, ours.rmse < theirs.rmse),
            ]
        for share, text in (
            (SHARES[0], "Selecting too few makes the estimate inaccurate."),
            (SHARES[-1], "Selecting nearly all impoverishes the particles."),
        ):
            rule = f"RMSE at Np / N = {WSPF.share} below that at {share:g}, N = {SHARED}"
            better = self.by_share[WSPF.share].rmse < self.by_share[share].rmse
            found.append(_verdict(text, "section 2", rule, better))
        return found


def _verdict(text: str, place: str, rule: str, answers: np.ndarray) -> Verdict:
    return Verdict(text, place, "growth model", rule, judge(answers.tolist()))


def growth_result(runs: int, seed: int = 0) -> GrowthResult:
    """Run all filters on the same runs of the model."""
    truth = Growth.of(runs, seed)
    by_particles = {
        label: {n: FilterRuns.of(truth, replace(filter, particles=n), seed) for n in PARTICLES}
        for label, filter in FILTERS.items()
    }
    by_share = {share: FilterRuns.of(truth, replace(WSPF, share=share, particles=SHARED), seed) for share in SHARES}
    return GrowthResult(by_particles, by_share, runs)
