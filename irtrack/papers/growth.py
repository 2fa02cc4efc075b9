"""The growth model of Li and Li 2014 (section 5.1): the standard filter and weight selection on the same runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irsim.types import Floats
from irtrack.papers import growth_model as growth
from irtrack.papers.growth_model import BOOTSTRAP, WSPF, Growth, GrowthFilter
from irtrack.papers.verdicts import Verdict, judged

PARTICLES = (50, 100, 200, 500)
SHARES = (0.1, 0.2, 0.3, 0.4, 0.56, 0.7, 0.85, 1.0)
FILTERS = {"standard PF": BOOTSTRAP, "WSPF": WSPF, "WSPF, equal weights set aside": replace(WSPF, restoring="equal")}
CHOSEN = 0.56
"""The share that the paper finds suitable (section 2)."""
SHARED = 100
"""N where the share varies."""
RUNS_A_SEED = 20
"""Runs of the model for each seed of the scenes: a thousand for 50."""


@dataclass(frozen=True, eq=False)
class Filtering:
    """A filter on all runs: rmse (runs,), neff (runs,) mean over the steps, and CPU time of a run's step, us."""

    rmse: Floats
    neff: Floats
    us: float

    @property
    def error(self) -> float:
        """Standard error of the mean of rmse."""
        return float(self.rmse.std(ddof=1) / np.sqrt(len(self.rmse)))


def filtering(truth: Growth, filter: GrowthFilter, seed: int) -> Filtering:
    begin = time.process_time()
    done = growth.run(truth, filter, seed)
    took = time.process_time() - begin
    return Filtering(growth.rmse(truth, done), done.neff.mean(axis=1), 1e6 * took / truth.states.size)


@dataclass(frozen=True, eq=False)
class GrowthResult:
    """By filter and N; and WSPF at N = SHARED by share Np / N."""

    by_particles: dict[str, dict[int, Filtering]]
    by_share: dict[float, Filtering]
    runs: int

    def verdicts(self) -> list[Verdict]:
        """The claims of sections 2 and 5.1, run by run on the same truth."""
        standard, selected = self.by_particles["standard PF"], self.by_particles["WSPF"]
        found = []
        for n in PARTICLES:
            answers: dict[str, tuple[str, Sequence[bool]]] = {
                "Weight selection raises the number of effective particles.": (
                    "mean Neff over all N above",
                    (selected[n].neff > standard[n].neff).tolist(),
                ),
                "It lowers the root mean square error.": ("RMSE below", (selected[n].rmse < standard[n].rmse).tolist()),
            }
            for text, (words, each) in answers.items():
                rule = f"{words} that of the standard PF, N = {n}"
                found.append(Verdict(text, "section 5.1, table 1", "growth model", rule, judged(each)))
        chosen = self.by_share[CHOSEN].rmse
        for share, text in (
            (SHARES[0], "Selecting too few makes the estimate inaccurate."),
            (SHARES[-1], "Selecting nearly all impoverishes the particles."),
        ):
            rule = f"RMSE at Np / N = {CHOSEN} below that at {share:g}, N = {SHARED}"
            better = (chosen < self.by_share[share].rmse).tolist()
            found.append(Verdict(text, "section 2", "growth model", rule, judged(better)))
        return found


def growth_result(runs: int, seed: int = 0) -> GrowthResult:
    """All filters on the same runs of the model."""
    truth = Growth.of(runs, seed)
    by_particles = {
        label: {n: filtering(truth, replace(filter, particles=n), seed) for n in PARTICLES}
        for label, filter in FILTERS.items()
    }
    by_share = {share: filtering(truth, replace(WSPF, share=share, particles=SHARED), seed) for share in SHARES}
    return GrowthResult(by_particles, by_share, runs)
