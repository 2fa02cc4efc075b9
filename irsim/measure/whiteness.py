"""Whether what a frame, its rows and its columns have in common is drawn anew in each frame, as 3-D noise takes it."""

from __future__ import annotations

import numpy as np

from irsim.measure.memory import LEAST_FRAMES, Memory
from irsim.measure.noise_3d import Noise3dTerms
from irsim.measure.repeats import Indices
from irsim.types import Floats

ALIKE = 0.3
"""Correlation from frame to frame from which a term is said to remember: of series that are drawn anew, each of the 64
rows or columns of a window in 60 frames, the mean scatters by 0.02; of the one series of levels in so many by 0.13."""

_AXES = {"tv": (2,), "th": (1,), "t": (1, 2)}
"""Of frames (T, rows, columns), those over which each term is a mean."""


def remembering(frames: Floats, number: Indices, terms: Noise3dTerms, memory: Memory | None) -> dict[str, float]:
    """Correlation from frame to frame of those of t, tv and th, of frames (T, rows, columns) taken at `number`, that
    are surely there and are not drawn anew in each. What pixels' own noise has of it is taken out. Of t nothing is told
    beside the others: the mean of rows that remember does, too."""
    after = np.flatnonzero(np.diff(number) == 1)
    if len(after) < LEAST_FRAMES:
        return {}
    level = frames.mean(axis=(1, 2), keepdims=True)
    found: dict[str, float] = {}
    for term, axes in _AXES.items():
        sigma = getattr(terms, term)
        if sigma.low <= 0 or (term == "t" and found):
            continue
        series = level if term == "t" else frames.mean(axis=axes, keepdims=True) - level
        series = series - series.mean(axis=0)
        pixels = np.prod([frames.shape[axis] for axis in axes])
        theirs = 0.0 if memory is None else memory.correlated.value**2 * memory.rho.value / pixels
        alike = (float((series[after] * series[after + 1]).mean()) - theirs) / sigma.value**2
        if alike > ALIKE:
            found[term] = min(alike, 1.0)
    return found
