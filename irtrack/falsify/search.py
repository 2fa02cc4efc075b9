"""Searches of the unit cube for a point with a margin below 0: random, Sobol points, CMA-ES."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np

from irsim.rng import stream
from irsim.types import Floats

BATCH = 16
"""Points per batch of the non-adaptive searches; a power of two, as Sobol points need."""

STEP = 0.25
"""Initial standard deviation of CMA-ES, in sides of the unit cube."""

Searcher = Generator[Floats, Floats, None]
"""Generator that yields batches of points (n, dimension) of the unit cube, and is sent their margins (n,)."""


@dataclass(frozen=True, slots=True, eq=False)
class SearchPoint:
    """Point of a search with the number of its run, from 1, and its margin."""

    run: int
    shares: Floats
    margin: float


def search(
    kind: str, dimension: int, seed: int, budget: int, margins: Callable[[Floats], Iterator[float]]
) -> Iterator[SearchPoint]:
    """Yield the points of a search, at most `budget`, in an order that depends on the margins alone.

    kind      one of `SEARCHES`
    margins   function that yields the margins of a batch of points (n, dimension), in order
    """
    searcher = SEARCHES[kind](dimension, seed)
    batch, run = next(searcher), 0
    while True:
        found = []
        for shares, margin in zip(batch[: budget - run], margins(batch[: budget - run]), strict=True):
            found.append(margin)
            yield SearchPoint(run + len(found), shares, margin)
        run += len(found)
        if run == budget:
            return
        batch = searcher.send(np.array(found))


def random_search(dimension: int, seed: int) -> Searcher:
    """Yield uniform random points, the baseline of searches."""
    for batch in count():
        yield stream(seed, "falsify/random", batch).random((BATCH, dimension))


def sobol_search(dimension: int, seed: int) -> Searcher:
    """Yield a scrambled Sobol sequence (Owen, J. Complexity 14 (1998) 466), by scipy."""
    from scipy.stats.qmc import Sobol

    sequence = Sobol(dimension, scramble=True, seed=stream(seed, "falsify/sobol", 0))
    while True:
        yield np.asarray(sequence.random(BATCH))


def cma_search(dimension: int, seed: int) -> Searcher:
    """Run CMA-ES (Hansen, arXiv:1604.00772), by the package cmaes, from the best of a batch of Sobol points.

    When it has converged, or all margins are equal, it restarts from the best of the next batch: margins have
    plateaus, such as severities without an effect on the tracker, and local minima above 0.
    """
    from cmaes import CMA

    sobol = sobol_search(dimension, seed)
    for begin in count():
        batch = next(sobol)
        margins = yield batch
        strategy = CMA(
            _padded(batch[np.argmin(margins)]),
            STEP,
            bounds=np.tile([0.0, 1.0], (max(dimension, 2), 1)),
            seed=int(stream(seed, "falsify/cma", begin).integers(2**32)),
        )
        level = False
        while not (level or strategy.should_stop()):
            points = np.array([strategy.ask() for _ in range(strategy.population_size)])
            margins = yield points[:, :dimension]
            level = bool(np.ptp(margins) == 0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # nearly equal margins
                strategy.tell(list(zip(points, margins.tolist(), strict=True)))


def _padded(point: Floats) -> Floats:
    """Return the point; one of a single axis gets a second one, which is ignored, since CMA-ES needs two."""
    return point if len(point) > 1 else np.array([point[0], 0.5])


SEARCHES: dict[str, Callable[[int, int], Searcher]] = {
    "cma": cma_search,
    "sobol": sobol_search,
    "random": random_search,
}
"""Searches by name, each a function of dimension and seed."""
