"""Which of the two levels of a pixel that blinks is its own: that of the pixels around it."""

from __future__ import annotations

import numpy as np

from irsim.measure.defects import scatter_around, without_lines
from irsim.measure.two_levels import TwoLevels
from irsim.types import Bools, Floats

_CLEAR = 4.0
"""Robust sigmas of the place by which a pixel's own level is nearer than the other to what is around: of a jump hardly
higher, a fixed pattern of that sigma, or texture, turns 1 in 40."""


def high_is_away(level: Floats, places: Bools, blinking: TwoLevels) -> Floats:
    """Whether pixels that blink are off their own level while they are high: 1, while they are low: -1, or 0 where
    nobody can tell.

    level   (rows, columns) means of all pixels
    places  (rows, columns) of those, in the order of their levels

    Their own is the level nearer to the median of the 5 x 5 px around and what rows and columns have in common, if it
    is so by far beside what good pixels there are apart from that.
    """
    apart = without_lines(level)
    around = (level - apart)[places]
    upper, lower = (np.abs(mean - around) for mean in (blinking.upper, blinking.lower))
    told = np.abs(upper - lower) > _CLEAR * scatter_around(apart)[places]
    return np.where(told, np.sign(upper - lower), 0.0)
