"""Numbers as a scenario has them."""

from __future__ import annotations

import math

from irsim.errors import decimal_text
from irsim.measure import Measured

_DUST = 1e-9
"""Smaller figures, in whatever unit, are of no camera."""


def plain(value: float, digits: int = 4) -> str:
    """So many digits, in a way that YAML takes for a number; what is but rounding of floats is 0."""
    return "0" if abs(value) < _DUST else decimal_text(value, digits)


def ranged(low: float, high: float, digits: int = 4) -> str:
    return f"{plain(low, digits)} to {plain(high, digits)}"


def interval(value: Measured, digits: int = 4) -> str:
    """In which it lies: between two ends, or below or above one."""
    if math.isinf(value.high):
        return f"{plain(value.low, digits)} or more"
    return f"at most {plain(value.high, digits)}" if value.bound else ranged(value.low, value.high, digits)
