"""How likely what goes to and fro between two levels is on each for as long as it takes to be seen."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats, Indices

LEAST_LIKELY = 1e-9
"""What is less likely is taken for this: rounding of what is left of 1 would decide, and of times at which no pixel is
likely to be found it need not be known how little."""


def log_occupied(passed: Floats, asked: Indices, on: Floats, off: Floats) -> Floats:
    """(N,) the sum, over pixels, of the logarithm of how likely each is on both levels at as many looks as are asked
    for, for N pairs of mean times `on` and `off`.

    passed   (T - 1,) time from each look to the next
    asked    (pixels,) looks, 1 or more each

    By counting how often a two-state Markov chain is on one level, look by look: it takes T times the most that is
    asked for.
    """
    times, which = np.unique(passed, return_inverse=True)
    kept = np.exp(-times[:, None] * (1 / on + 1 / off))
    share, most = on / (on + off), int(asked.max())
    rarely = np.cumsum(_often(kept, which, share, most) + _often(kept, which, 1 - share, most), axis=0)
    pixels = np.bincount(asked - 1, minlength=most).astype(np.float64)
    return np.asarray(pixels @ np.log(np.maximum(1 - rarely, LEAST_LIKELY)))


def _often(kept: Floats, which: Indices, share: Floats, most: int) -> Floats:
    """(most, N) how likely it is on a level, on which it is for that `share` of the time, at just 0 .. most - 1 looks.

    kept    (times, N) what is left over each time of where it was
    which   (looks - 1,) of these times is that from one look to the next
    """
    here, away = np.zeros((2, most, len(share)))
    away[0] = 1 - share
    here[1:2] = share
    for each in which:
        left = kept[each]
        came, went = share * (1 - left), (1 - share) * (1 - left)
        stays = here * (1 - went) + away * came
        away = away * (1 - came) + here * went
        here = np.concatenate([np.zeros_like(stays[:1]), stays[:-1]])
    return here + away
