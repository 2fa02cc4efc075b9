"""Spread that few outliers hardly move."""

from __future__ import annotations

MEDIAN_TO_SIGMA = 1.4826
"""Sigma of what is normally distributed over its median distance from the median: 1 / Phi^-1(3/4). F. R. Hampel, "The
influence curve and its role in robust estimation", J. Am. Stat. Assoc. 69, 383 (1974)."""
