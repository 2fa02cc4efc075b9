"""Searches of a unit cube for a point whose margin is below 0: by chance, evenly, or down the slope."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from irsim.rng import stream
from irsim.types import Floats

BATCH = 16
"""Points asked for at a time by searches that learn nothing from them; a power of two, as Sobol's points need."""

STEP = 0.25
"""Standard deviation at which CMA-ES begins, in a cube of side 1. A quarter of the range: chosen here."""

Searcher = Generator[Floats, Floats, None]
"""Gives batches of points (n, dimension) of the unit cube, and is sent their margins (n,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """The run-th point that a search asked for (from 1), and its margin."""

    run: int
    shares: Floats
    margin: float


def search(
    kind: str, dimension: int, seed: int, budget: int, margins: Callable[[Floats], Iterator[float]]
) -> Iterator[Tried]:
    """The points that a search tries, at most `budget`, in an order that depends on the margins alone.

    kind      one of `SEARCHES`
    margins   of a batch of points (n, dimension), in their order; they may be worked out side by side
    """
    searcher = SEARCHES[kind](dimension, seed)
    batch, run = next(searcher), 0
    while True:
        found = []
        for shares, margin in zip(batch[: budget - run], margins(batch[: budget - run]), strict=True):
            found.append(margin)
            yield Tried(run + len(found), shares, margin)
        run += len(found)
        if run == budget:
            return
        batch = searcher.send(np.array(found))


def random_search(dimension: int, seed: int) -> Searcher:
    """Points drawn by chance, each as likely: the yardstick."""
    for batch in count():
        yield stream(seed, "falsify/random", batch).random((BATCH, dimension))


def sobol_search(dimension: int, seed: int) -> Searcher:
    """Points spread evenly: a scrambled Sobol sequence (Owen, J. Complexity 14 (1998) 466), by scipy."""
    from scipy.stats.qmc import Sobol

    sequence = Sobol(dimension, scramble=True, seed=stream(seed, "falsify/sobol", 0))
    while True:
        yield np.asarray(sequence.random(BATCH))


def cma_search(dimension: int, seed: int) -> Searcher:
    """CMA-ES (Hansen, arXiv:1604.00772), by the package cmaes, from the best of some even points.

    When it has converged, or sees no slope, it begins again from the best of the next even points: margins have
    plateaus, such as severities that a tracker does not notice, and minima that are not below 0.
    """
    from cmaes import CMA

    even = sobol_search(dimension, seed)
    for begin in count():
        batch = next(even)
        margins = yield batch
        strategy = CMA(
            _padded(batch[np.argmin(margins)]),
            STEP,
            bounds=np.tile([0.0, 1.0], (max(dimension, 2), 1)),
            seed=int(stream(seed, "falsify/cma", begin).integers(2**32)),
        )
        level = False
        while not (level or strategy.should_stop()):
            asked = np.array([strategy.ask() for _ in range(strategy.population_size)])
            margins = yield asked[:, :dimension]
            level = bool(np.ptp(margins) == 0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # of margins that are all but the same
                strategy.tell(list(zip(asked, margins.tolist(), strict=True)))


def _padded(point: Floats) -> Floats:
    """The point with a second axis that nobody looks at where it has one: CMA-ES turns axes into each other."""
    return point if len(point) > 1 else np.array([point[0], 0.5])


SEARCHES: dict[str, Callable[[int, int], Searcher]] = {
    "cma": cma_search,
    "sobol": sobol_search,
    "random": random_search,
}
"""Searches by name; each takes the dimension and a seed."""
