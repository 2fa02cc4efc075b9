"""Sigmas of noise without that of rounding to whole counts, which may hide it."""

from __future__ import annotations

from dataclasses import replace

from irsim.measure.interval import Measured, exactly, less

ROUNDING = 1 / 12
"""Variance of rounding to whole counts, which every measured white noise holds."""
_ROUNDED = exactly(ROUNDING)
HIDDEN = 0.4
"""Counts: noise up to this, or a pattern of pixels, may be measured as less than `irsim.measure.defects.ROUNDED`, or as
none: where all pixels lie in the middle of a count, a sigma of 0.37 is."""


def without_rounding(sigma: Measured, hides: bool) -> Measured:
    """A measured sigma of white noise without rounding's own, where rounding `hides` noise or not."""
    return perhaps_hidden(less(sigma, _ROUNDED), hides)


def perhaps_hidden(sigma: Measured, hides: bool) -> Measured:
    """A sigma of what differs from pixel to pixel, told as it is, or, where rounding `hides` such things, as anything
    from 0 to all that it may hide."""
    return replace(sigma, low=0.0, high=max(sigma.high, HIDDEN)) if hides else sigma
