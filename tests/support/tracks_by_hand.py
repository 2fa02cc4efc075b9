"""Tracks and references of given places, and the places that Hypothesis draws."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from irsim.types import Floats
from irtrack.metrics import ATTRIBUTES, Reference
from irtrack.types import Estimate, Track


def track_of(centers: Floats, sizes: Floats, first: int = 0) -> Track:
    n = len(centers)
    estimates = tuple(Estimate(tuple(c), tuple(s)) for c, s in zip(centers.tolist(), sizes.tolist(), strict=True))
    return Track(
        source="s", source_hash="h", tracker="t", config={}, target="a", start=first, start_box=estimates[0].box,
        input="display", scene_seed=0, tracker_seed=0, indices=np.arange(first, first + n), times=np.arange(n) / 10,
        estimates=estimates, step_ms=np.array([100.0] + [1.0] * (n - 1)), cpu_ms=np.array([90.0] + [0.5] * (n - 1)),
    )  # fmt: skip


def reference_of(centers: Floats, sizes: Floats, visible: Floats | None = None, accuracy: float = 0.0) -> Reference:
    n = len(centers)
    unmarked = np.zeros((n, len(ATTRIBUTES)), bool)
    shown = np.ones(n) if visible is None else np.asarray(visible, dtype=float)
    return Reference(
        np.arange(n), np.asarray(centers, float), np.asarray(sizes, float), shown, np.full(n, accuracy), unmarked
    )


def pixels(n: int) -> st.SearchStrategy[Floats]:
    point = st.tuples(st.integers(-400, 400), st.integers(-400, 400))
    return st.lists(point, min_size=n, max_size=n).map(lambda rows: np.array(rows, dtype=float) / 4)
