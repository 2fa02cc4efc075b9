"""Traces by hand: a target that stands still, followed at given distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtrack.metrics import ATTRIBUTES, Trace


def trace(errors: Sequence[float], visible: Sequence[float] | None = None, says: Sequence[str] | None = None) -> Trace:
    """Return a track with these centre errors to a stationary target of 3 x 4 px (off beyond 5 px)."""
    n = len(errors)
    true = np.full((n, 2), 50.0)
    return Trace(
        indices=np.arange(n),
        centers=true + np.column_stack([errors, np.zeros(n)]),
        sizes=np.full((n, 2), 5.0),
        statuses=np.array(says or ["tracking"] * n, dtype=np.str_),
        scores=np.full(n, np.nan),
        neffs=np.full(n, np.nan),
        covariances=np.full((n, 2, 2), np.nan),
        truth_centers=true,
        truth_sizes=np.tile([3.0, 4.0], (n, 1)),
        visible=np.array(visible if visible is not None else [1.0] * n, dtype=float),
        accuracy=np.zeros(n),
        marks=np.zeros((n, len(ATTRIBUTES)), dtype=bool),
        step_ms=np.zeros(n),
        cpu_ms=np.zeros(n),
    )
