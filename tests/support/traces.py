"""Traces by hand: a target followed at given distances."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irtrack.metrics import ATTRIBUTES, Trace


def trace_at(offsets: Any, size: tuple[float, float] = (6.0, 8.0), **arrays: Any) -> Trace:
    """Return a track with these errors (n, 2) px to a stationary target; other arrays of the trace by name."""
    n = len(offsets)
    truth = arrays.pop("truth_centers", np.full((n, 2), 50.0))
    nothing = np.full(n, np.nan)
    return Trace(
        **{
            "indices": np.arange(n),
            "centers": truth + offsets,
            "sizes": np.tile(size, (n, 1)),
            "statuses": np.full(n, "tracking"),
            "scores": nothing,
            "neffs": nothing,
            "covariances": np.full((n, 2, 2), np.nan),
            "truth_centers": truth,
            "truth_sizes": np.tile(size, (n, 1)),
            "visible": np.ones(n),
            "accuracy": np.zeros(n),
            "marks": np.zeros((n, len(ATTRIBUTES)), dtype=bool),
            "step_ms": np.ones(n),
            "cpu_ms": np.ones(n),
            **arrays,
        }
    )


def trace(errors: Sequence[float], visible: Sequence[float] | None = None, says: Sequence[str] | None = None) -> Trace:
    """Return a track with these centre errors to a stationary target of 3 x 4 px (off beyond 5 px)."""
    arrays: dict[str, Any] = {} if visible is None else {"visible": np.array(visible, dtype=float)}
    arrays |= {} if says is None else {"statuses": np.array(says)}
    return trace_at(np.column_stack([errors, np.zeros(len(errors))]), (3.0, 4.0), **arrays)
