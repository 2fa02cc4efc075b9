"""What rows, columns and the level of the frame remember, where they are not drawn anew in each frame."""

from __future__ import annotations

import numpy as np

from irsim.measure.cosines import Cosines
from irsim.measure.interval import Measured, exactly, mean_square, without
from irsim.measure.memory import LEAST_MEMORY_FRAMES, Memory, centred, memory_of
from irsim.measure.mixture import fit_mixture
from irsim.measure.noise_3d import Noise3dTerms
from irsim.types import Floats, Indices

ALIKE = 0.3
"""Correlation from frame to frame from which a term is said to remember: of series that are drawn anew, each of the 64
rows or columns of a window in 60 frames, the mean scatters by 0.02; of the one series of levels in so many by 0.13."""

_AXES = {"tv": 2, "th": 1}
"""Of frames (T, rows, columns), that over which each term is a mean."""


def remembering(frames: Floats, number: Indices, rate_hz: float, terms: Noise3dTerms) -> dict[str, Memory]:
    """Memory of those of tv and th, of frames (T, rows, columns) taken at `number`, that are surely there and are not
    drawn anew in each. What is in the mean of a row or column of its pixels' own noise is taken out."""
    if (np.diff(number) == 1).sum() < LEAST_MEMORY_FRAMES:
        return {}
    pixels = centred(frames)
    level = frames.mean(axis=(1, 2))[:, None]
    found: dict[str, Memory] = {}
    for term, axis in _AXES.items():
        sigma = getattr(terms, term)
        series = frames.mean(axis=axis) - level
        lines = series.shape[1]
        series *= (lines / (lines - 1)) ** 0.5
        theirs = pixels.swapaxes(1, 2) if term == "th" else pixels
        if sigma.low > 0 and _alike(series, number, theirs) * sigma.value**-2 > ALIKE:
            found[term] = _memory(series, theirs, number, rate_hz)
    return found


def level_remembers(frames: Floats, number: Indices, sigma: Measured) -> bool:
    """Whether the level of frames is surely there, a noise of its own with `sigma`, and not drawn anew in each."""
    if (np.diff(number) == 1).sum() < LEAST_MEMORY_FRAMES or sigma.low <= 0:
        return False
    return bool(_product(frames.mean(axis=(1, 2))[:, None], number) * sigma.value**-2 > ALIKE)


def _alike(series: Floats, number: Indices, pixels: Floats) -> float:
    """Covariance from frame to frame of series (T, lines), without that of their pixels (T, lines, N)."""
    theirs = _product(pixels.reshape(len(pixels), -1), number)
    beside: int = pixels.shape[2]
    return _product(series, number) - theirs / beside


def _product(series: Floats, number: Indices) -> float:
    after = np.flatnonzero(np.diff(number) == 1)
    series = series - series.mean(axis=0)
    return float(np.mean(series[after] * series[after + 1]))


def _memory(series: Floats, pixels: Floats, number: Indices, rate_hz: float) -> Memory:
    """Of series (T, lines), each with the mean of its pixels' (T, lines, N) own noise."""
    cosines = Cosines.of(number)
    beside = pixels.shape[2]
    known = cosines.squares(pixels).mean(axis=(1, 2)) / beside
    modes = cosines.squares(series).T
    mixture = fit_mixture(modes, series.shape[1] - 1, cosines, known)
    within, staying = (
        without(mean_square(lines), exactly(float(theirs.mean()) / beside))
        for lines, theirs in (
            (series.var(axis=0), pixels.var(axis=0)),
            (np.square(series.mean(axis=0)), np.square(pixels.mean(axis=0))),
        )
    )
    return memory_of(mixture, rate_hz, cosines, within, staying)
