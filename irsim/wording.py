"""Words that several messages share."""

from __future__ import annotations

from decimal import Decimal


def counted(count: int, noun: str) -> str:
    """'1 frame', '2 frames'."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def plain(value: float, digits: int) -> str:
    """So many digits, never with an exponent: 100, where `g` has 1e+02."""
    text = f"{value:.{digits}g}"
    return f"{Decimal(text):f}" if "e" in text else text
