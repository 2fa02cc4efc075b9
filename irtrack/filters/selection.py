"""Weight selection: only the particles of large weight speak for the state (Li, Li 2014, section 2).

The functions work on one set of particles or on many at once: weights (..., N), each row summing to
one. Rows are first put in order, so that the Np chosen stand in front.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

Restoring = Literal["own", "equal"]


def largest_first(weights: Floats, count: int) -> npt.NDArray[np.intp]:
    """(..., N) indices with those of the `count` largest weights in front, in no order among themselves (Step 3)."""
    n = weights.shape[-1]
    if count >= n:
        return np.broadcast_to(np.arange(n), weights.shape)
    front_last: npt.NDArray[np.intp] = weights.argpartition(n - count, axis=-1)[..., ::-1]
    return front_last


def chosen(weights: Floats, count: int) -> Floats:
    """(..., Np) weights of the `count` in front, summing to one again (Step 3)."""
    front = weights[..., :count]
    whole: Floats = front / front.sum(axis=-1, keepdims=True)
    return whole


def restored(weights: Floats, count: int, restoring: Restoring) -> Floats:
    """(..., N) weights after the `count` in front have been resampled among themselves (Step 6).

    The formula is lost in print. `own`: those in front share what they held together, and those set
    aside keep what they had, so that the whole still stands for the same distribution. `equal`: 1/N
    for all, which gives those set aside a share that they have not earned: at Np = .56 N, 44 %.
    """
    if restoring == "equal":
        return np.full(weights.shape, 1 / weights.shape[-1])
    after = weights.copy()
    after[..., :count] = weights[..., :count].mean(axis=-1, keepdims=True)
    return after
