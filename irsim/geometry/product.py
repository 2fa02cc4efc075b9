"""Matrix products on one thread."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats

ALONE = 2**18
"""Multiplications of one product up to which OpenBLAS, numpy's library, starts no further threads
(SMP_THRESHOLD_MIN times GEMM_MULTITHREAD_THRESHOLD in its interface/gemm.c). These wait on each other for
milliseconds wherever several processes share the cores."""

FEWEST = 8
"""Rows that are worked out at once at least: fewer would take longer than the threads."""


def product(left: Floats, right: Floats) -> Floats:
    """(..., m, n): left (..., m, k) @ right (..., k, n), a few rows at a time."""
    rows, step = left.shape[-2], max(ALONE // max(right.shape[-2] * right.shape[-1], 1), FEWEST)
    if rows <= step:
        return np.asarray(left @ right)
    stack = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    out = np.empty((*stack, rows, right.shape[-1]), np.result_type(left, right))
    for begin in range(0, rows, step):
        block = slice(begin, begin + step)
        np.matmul(left[..., block, :], right, out=out[..., block, :])
    return out
