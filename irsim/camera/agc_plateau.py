"""Plateau equalisation: histogram equalisation that large even areas do not take over."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.camera.agc import Look, Picture, Pixels, Ranking

_LEVELS = np.arange(1, 256) - 0.5
"""From where on the curve rounds to each grey but the first."""

_NO_LIMIT = 2 * 255.0
"""A gain, greys per count, that no curve of 255 greys reaches."""


class Plateau(Ranking):
    """Plateau equalisation: the curve is as steep at a count as pixels have it, up to a plateau.

    With p(x) pixels of count x and the plateau T, the curve rises from one count to the next by
    d(x) = 255 min(p(x), T) / sum min(p, T), the darkest count left out of the sum, as it is where the
    curve begins (Vickers, "Plateau equalization algorithm for real-time display of high-quality
    infrared imagery", Opt. Eng. 35, 1996). The gain limit G makes that min(d(x), G), and what
    the curve then spans less than 255 is left half dark and half bright of it.
    """

    plateau: Annotated[float, Field(ge=1e-6, le=1)] = 0.001
    """Share of the pixels above which a count weighs no more. 1 is histogram equalisation; towards 0 all
    counts that there are weigh the same (histogram projection)."""
    gain_limit: Annotated[float, Field(ge=0.001, le=255)] | None = 2.0
    """How many greys the curve may rise from one count to the next: an even scene's noise is not blown up;
    null: no limit."""

    def asked(self, pixels: Pixels, size: int) -> Look:
        """(255,) the counts from which on each grey but black begins.

        Beyond the counts that there are, the curve goes on as steeply as the limit allows.
        """
        weights = np.minimum(pixels, self.plateau * size)
        present = np.flatnonzero(weights)
        if not present.size:  # all counts lie beyond their depth
            return np.full(255, float(pixels.size))
        first, last = int(present[0]), int(present[-1])
        gain = _NO_LIMIT if self.gain_limit is None else self.gain_limit
        rises = weights[first : last + 1]
        rises[0] = 0
        if first < last:
            rises = np.minimum(rises * (255 / rises.sum()), gain)
        curve = np.cumsum(rises)
        dark = (255 - curve[-1]) / 2
        curve += dark
        begins = first + np.searchsorted(curve, _LEVELS).astype(np.float64)
        darker, brighter = curve[0] > _LEVELS, curve[-1] < _LEVELS
        begins[darker] = first - (dark - _LEVELS[darker]) / gain
        begins[brighter] = last + (_LEVELS[brighter] - curve[-1]) / gain
        return begins

    def greys(self, look: Look, bits: int) -> Picture:
        levels = 2**bits
        greys = np.full(65_536, 255, np.uint8)
        first_counts = np.clip(np.ceil(look), 0, levels).astype(np.int64)
        greys[:levels] = np.cumsum(np.bincount(first_counts, minlength=levels + 1)[:levels])
        return greys
