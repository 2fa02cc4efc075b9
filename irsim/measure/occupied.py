"""How likely what goes to and fro between two levels is on each for as long as it takes to be seen."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

LONGEST = 0.25
"""Greatest share of the time that can be asked for."""
_LOOKS = 128
"""Of more looks than about so many, evenly spread ones stand for all."""
_TINY = np.finfo(np.float64).tiny


def log_occupied(passed: Floats, least: Floats, on: Floats, off: Floats) -> Floats:
    """(N,) the sum, over pixels, of the logarithm of how likely each is on both levels for at least its share of looks,
    and once, for N pairs of mean times `on` and `off`.

    passed   (T - 1,) time from each look to the next
    least    (pixels,) shares, up to LONGEST

    By counting how often a two-state Markov chain is on one level, a look after the other.
    """
    when = np.concatenate([[0.0], np.cumsum(passed)])
    looked = np.unique(np.linspace(0, len(when) - 1, min(len(when), _LOOKS)).round().astype(int))
    counts = np.maximum(np.ceil(least * len(looked)), 1).astype(np.intp)
    kept = np.exp(-np.diff(when[looked])[:, None] * (1 / on + 1 / off))
    share = on / (on + off)
    most = int(counts.max())
    rarely = np.cumsum(_often(kept, share, most), axis=0) + np.cumsum(_often(kept, 1 - share, most), axis=0)
    logs: Floats = np.log(np.maximum(1 - rarely, _TINY))
    return logs.T @ np.bincount(counts - 1, minlength=most)


def _often(kept: Floats, share: Floats, most: int) -> Floats:
    """(most, N) how likely it is on a level, on which it is for that `share` of the time, at just 0 .. most - 1 looks;
    kept (looks - 1, N) what is left of where it was from one to the next."""
    here, away = np.zeros((2, most, len(share)))
    away[0] = 1 - share
    here[1:2] = share
    for left in kept:
        came, went = share * (1 - left), (1 - share) * (1 - left)
        here, away = here * (1 - went) + away * came, away * (1 - came) + here * went
        here[1:] = here[:-1].copy()
        here[0] = 0.0
    return here + away
