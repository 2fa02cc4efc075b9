"""How many particles are enough, decided anew in each frame."""

from __future__ import annotations

from math import ceil

import numpy as np

from irsim.types import Floats


def kld_bound(cells: Floats, epsilon: float, z: float) -> Floats:
    """Particles needed so that the cloud's Kullback-Leibler distance to what it samples stays below epsilon.

        n = (k - 1) / (2 epsilon) (1 - 2 / (9 (k - 1)) + sqrt(2 / (9 (k - 1))) z)^3

    with a probability of which z is the normal quantile, for a cloud that fills k `cells` (...); one
    cell needs one particle (Fox, "Adapting the Sample Size in Particle Filters through KLD-Sampling",
    Int. J. Robotics Research 22(12), 2003, eq. 14).
    """
    free = np.maximum(cells - 1, 1)
    ninths = 2 / (9 * free)
    bound = free / (2 * epsilon) * (1 - ninths + np.sqrt(ninths) * z) ** 3
    return np.where(cells > 1, bound, 1.0)


def kld_count(positions: Floats, least: int, cell: float, epsilon: float, z: float) -> int:
    """How many of the moved particles (N, 2) px to keep: the first n that reach the bound.

    They must be in random order. A particle counts where it falls into a cell of `cell` px that was
    empty; `least` are kept in any case, N where the bound is not reached.
    """
    places = np.floor((positions - positions.min(axis=0)) / cell).astype(np.int64)
    _, firsts = np.unique(places @ np.array([2**31, 1]), return_index=True)
    new = np.zeros(len(positions))
    new[firsts] = 1
    enough = np.arange(1, len(positions) + 1) >= np.maximum(kld_bound(new.cumsum(), epsilon, z), least)
    return int(enough.argmax()) + 1 if enough.any() else len(positions)


def neff_count(count: int, neff: float, wanted: float, least: int, most: int) -> int:
    """The next frame's number of particles: that which would have had the effective number wanted."""
    return min(max(ceil(count * wanted / neff), least), most)
