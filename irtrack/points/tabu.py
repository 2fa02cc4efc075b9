"""Tabu search of particles, and the Metropolis-Hastings steps that take its place without a bias.

F. Glover, "Tabu search, part I", ORSA J. Computing 1(3), 1989. Each particle searches by itself, all of them at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from irsim.types import Floats
from irtrack.points.world import Draws

Accept = Literal["off", "greedy", "metropolis"]


@dataclass(frozen=True)
class Tabu:
    """Search settings; the source (a digest) states none of them.

    accept      greedy: a better posterior density is accepted, if its cell is not tabu or the density is the best of
                all particles (aspiration). That moves particles to modes: means are biased, covariances too small.
                metropolis: moves of the Metropolis-Hastings algorithm after resampling, which leave the posterior
                unchanged (W. Gilks, C. Berzuini, "Following a moving target", J. R. Stat. Soc. B 63(1), 2001)
    share       share of the particles that search, those of least weight; metropolis: of all
    spread      h: candidates are N(x, h P), P the covariance of the proposal
    rounds      number of candidates of each particle
    cell        side of a cell, px
    memory      number of last cells of a particle that are tabu
    """

    accept: Accept = "greedy"
    share: float = 0.25
    spread: float = 0.5
    rounds: int = 4
    cell: float = 0.5
    memory: int = 7


def search(
    x: Floats, roots: Floats, score: Callable[[Floats], Floats], best: Floats, tabu: Tabu, draws: Draws
) -> tuple[Floats, Floats]:
    """Return particles (R, n, d) after the search, and the gain in their scores (R, n).

    roots    (R, n, d, d) square roots of the covariances of the proposals
    score    function from particles to log posterior densities (R, n)
    best     (R, 1) largest score of all particles of a run
    """
    runs, n, d = x.shape
    greedy = tabu.accept == "greedy"
    numbers = np.sqrt(tabu.spread) * draws.normal(tabu.rounds, n, d)
    uniforms = draws.uniform(tabu.rounds, n)
    first = now = score(x)
    memory = np.full((runs, n, tabu.memory, 2), np.iinfo(np.int64).min)
    memory[:, :, 0] = _cells(x, tabu.cell)
    for turn in range(tabu.rounds):
        candidates = x + np.matmul(roots, numbers[:, turn, :, :, None])[..., 0]
        found = score(candidates)
        if greedy:
            cells = _cells(candidates, tabu.cell)
            forbidden = (memory == cells[:, :, None]).all(axis=-1).any(axis=-1)
            taken = (found > now) & (~forbidden | (found > best))
            place = (turn + 1) % tabu.memory
            memory[:, :, place] = np.where(taken[..., None], cells, memory[:, :, place])
        else:
            taken = np.log(np.maximum(uniforms[:, turn], 1e-300)) < found - now
        x = np.where(taken[..., None], candidates, x)
        now = np.where(taken, found, now)
        best = np.maximum(best, now.max(axis=1, keepdims=True))
    return x, now - first


def _cells(x: Floats, side: float) -> np.ndarray:
    cells: np.ndarray = np.floor(np.clip(x[..., :2] / side, -1e15, 1e15)).astype(np.int64)
    return cells
