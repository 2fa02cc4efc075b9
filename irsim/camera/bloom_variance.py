"""How much what pixels hold varies where they spill: the gains of all whose charge runs there count."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import cv2
import numpy as np

from irsim.camera.bloom import Bloom
from irsim.camera.noise_base import read_only
from irsim.rng import normals
from irsim.types import Floats, Slices

DRAWS = 512
"""So many draws of the gains: where they are of one pixel or of hundreds, what runs on evenly varies by just what it
should; where ends of streaks move by pixels, to within some 15 % at single ones."""
_FARTHEST = 4.0
"""Sigmas of all gains at once that what spills reaches farther than in any draw by."""


def spread(signal: Floats, gain: float, zero: float, top: float, bloom: Bloom) -> tuple[Slices, Floats] | None:
    """Where pixels spill, and there the mean square of what they hold about what they hold with all gains 1, in squared
    units of the signal; None where nothing spills.

    signal  (rows, cols) float32 before it spills, where all gains are 1; `zero`, what it is without light
    gain    the variance of pixels' gains, which are independent
    """
    light, sigma = signal - np.float32(zero), np.float32(np.sqrt(gain))
    region = _reached(signal + np.float32(_FARTHEST) * sigma * light, top, bloom)
    if region is None:
        return None
    mean = signal[region].copy()
    bloom.spill(mean, top)
    squares = np.zeros(mean.shape)
    for drawn in _draws(light[region]):
        held = signal[region] + sigma * light[region] * drawn
        bloom.spill(held, top)
        squares += (held - mean) ** 2
    return region, squares / DRAWS


def _reached(signal: Floats, top: float, bloom: Bloom) -> Slices | None:
    """The rows and columns in which a signal changes as it spills."""
    spilled = signal.copy()
    bloom.spill(spilled, top)
    left, above, columns, rows = cv2.boundingRect((spilled != signal).view(np.uint8))
    return (slice(above, above + rows), slice(left, left + columns)) if columns else None


def _draws(light: Floats) -> Iterator[Floats]:
    """Unit normals for each pixel, (rows, cols) float32, DRAWS times: the brightest pixels, which spill most, are
    uncorrelated exactly over all draws, the others by chance.

    Of variances where what a spot spilled ends, 2 % remain by chance with plain draws and 0.4 % with these, along
    lines; 7 % and 4 % all around.
    """
    brightest = np.argsort(-light, axis=None, kind="stable")
    rows = _uncorrelated()
    many = np.resize(rows, (DRAWS + light.size // DRAWS + 1, DRAWS)).ravel()
    drawn = np.empty(light.shape, np.float32)
    for first in range(0, DRAWS * DRAWS, DRAWS):
        drawn.reshape(-1)[brightest] = many[first : first + light.size]
        yield drawn


@lru_cache(maxsize=1)
def _uncorrelated() -> Floats:
    """(DRAWS, DRAWS) float32: columns of mean square 1 without any correlation, each nearly normal. Read only."""
    axes, _ = np.linalg.qr(normals((DRAWS, DRAWS), 0, "gains where pixels spill").astype(np.float64))
    return read_only((axes * np.sqrt(DRAWS)).astype(np.float32))
