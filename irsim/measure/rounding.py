"""Sigmas of noise without that of rounding to whole counts, which may hide it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from irsim.measure.interval import Measured, exactly, less, root, square
from irsim.types import Floats

ROUNDING = 1 / 12
"""Variance of rounding to whole counts, which every measured white noise holds."""
_ROUNDED = exactly(ROUNDING)
_SEEN = 1.0
"""Variance, counts^2, from which on rounding's is 1/12 wherever the mean lies, within 10^-8."""
HIDDEN = 0.4
"""Counts: noise up to this, or a pattern of pixels, may be measured as less than `irsim.measure.defects.ROUNDED`, or as
none: where all pixels lie in the middle of a count, a sigma of 0.37 is."""


def without_rounding(sigma: Measured, hides: bool) -> Measured:
    """A measured sigma of white noise without rounding's own, where rounding `hides` noise or not."""
    return perhaps_hidden(_anywhere(less(sigma, _ROUNDED)), hides)


def _anywhere(sigma: Measured) -> Measured:
    """With ends as wide as they may be wherever between two counts the mean lies: the least variance that may be
    measured as the lower end, and the greatest that may be as the upper one."""
    variances = np.linspace(0, _SEEN, 2000)
    off = _off(variances)
    low, high = square(max(sigma.low, 0.0)), square(max(sigma.high, 0.0))
    if low < _SEEN:
        low = float(np.interp(low, variances + off, variances))
    if high < _SEEN:
        high = float(variances[variances - off <= high][-1])
    return replace(sigma, low=min(root(low), sigma.low), high=max(root(high), sigma.high))


def _off(variances: Floats) -> Floats:
    """By how much at most the variance of rounded normal values differs from theirs and 1/12: the first harmonic, that
    W. F. Sheppard's corrections leave out (B. Widrow, I. Kollar, "Quantization Noise", 2008, section 5.2)."""
    return np.asarray((1 / math.pi**2 + 4 * variances) * np.exp(-2 * math.pi**2 * variances))


def perhaps_hidden(sigma: Measured, hides: bool) -> Measured:
    """A sigma of what differs from pixel to pixel, told as it is, or, where rounding `hides` such things, as anything
    from 0 to all that it may hide."""
    return replace(sigma, low=0.0, high=max(sigma.high, HIDDEN)) if hides else sigma
