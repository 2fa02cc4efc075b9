"""Numbers as a scenario has them."""

from __future__ import annotations

import numpy as np


def plain(value: float, digits: int = 4) -> str:
    """So many digits, in a way that YAML takes for a number."""
    return np.format_float_positional(float(f"{value:.{digits}g}"), trim="-")


def ranged(low: float, high: float) -> str:
    return f"{plain(low)} to {plain(high)}"
