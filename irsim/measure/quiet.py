"""Noise told from what moves: where a scene slides, each of its frequencies in space has but few in time."""

from __future__ import annotations

import itertools
import math

import numpy as np

from irsim.measure.given import Values
from irsim.measure.picked import middle
from irsim.types import Floats, Indices

_WIDEST, _LONGEST = 128, 64
"""px of the middle of a picture, and frames, that are looked at: more changes little but the time that it takes."""
_LEAST_SIDE, _LEAST_FRAMES = 64, 32
"""Of less the quietest are so by chance."""
_CELLS = 8
"""Parts of the frequencies along each axis: of 8 x 8 some are free of a scene's texture."""
_SLOWEST = 3
"""Frequencies in time, the lowest above 0, that are left out: what stays is in them under a Hann window."""
_QUIETEST = 0.25
"""Share of the frequencies in time, and then of the cells, that noise is read off as the quietest.

Of a textured ground that slides by 2.3 px a frame under noise of 1/75 it makes sigma 18 % too large, where the median
of both makes it 40 % too large."""
_BY_CHANCE = 12.0
"""Of white noise alone the quietest cells are so by chance: sigma comes out too small by this over the root of the
number of values (10 to 14 in 16 x 32 x 32 to 64 x 128 x 128 of them, 12 draws each)."""


def quiet_sigma(frames: Values) -> float:
    """Sigma of noise in frames (T, rows, columns) that is white in time and place, at most; inf where they are too few.

    What slides by v px a frame has at each frequency k in space the one frequency -k v in time, and what stays has 0
    (and those beside them, by the window and by how motion varies); white noise has all alike. So in
    cells of frequencies in space the power is read off the quietest in time, as a quantile of an exponential
    distribution, which a periodogram of noise has, and then off the quietest of these cells.
    """
    if len(frames) < _LEAST_FRAMES or min(frames.shape[1:]) < _LEAST_SIDE:
        return math.inf
    values = middle(frames[:_LONGEST], _WIDEST).astype(np.float64)
    values -= values.mean(axis=0)
    windows = [np.hanning(length + 2)[1:-1] for length in values.shape]
    window = windows[0][:, None, None] * windows[1][:, None] * windows[2]
    power = np.square(np.abs(np.fft.rfftn(values * window))) / np.square(window).sum()
    power = power[_SLOWEST + 1 : len(power) - _SLOWEST]  # 0 and the lowest, above and below it
    down = np.abs(np.fft.fftfreq(values.shape[1]))
    across = np.fft.rfftfreq(values.shape[2])
    cells = [np.quantile(power[:, y][:, :, x], _QUIETEST) for y, x in itertools.product(_parts(down), _parts(across))]
    sigma = math.sqrt(float(np.quantile(cells, _QUIETEST)) / -math.log1p(-_QUIETEST))
    return sigma * (1 + _BY_CHANCE / math.sqrt(values.size))


def _parts(frequencies: Floats) -> list[Indices]:
    """Where frequencies lie that are above 0, in equal parts up to 0.5 cycles a px; at 0 lines of the camera are."""
    ends = np.linspace(0, 0.5, _CELLS + 1)
    return [np.flatnonzero((frequencies > low) & (frequencies <= high)) for low, high in itertools.pairwise(ends)]
