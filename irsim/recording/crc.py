"""CRC-32s joined, so that what has one of its own need not be read again for that of the whole file."""

from __future__ import annotations

from functools import lru_cache

POLYNOMIAL = 0xEDB88320
"""That of CRC-32, lowest power in the highest bit (RFC 1952, section 8)."""

_ONE = 1 << 31
_X_8 = 1 << 23


def joined(first: int, second: int, length: int) -> int:
    """The CRC-32 of bytes with `length` others behind them, of the CRC-32s of both.

    Each byte behind them multiplies what was before by x^8 modulo the polynomial. zlib knows it as crc32_combine,
    which Python does not pass on.
    """
    return _product(_shift(length), first) ^ second


@lru_cache(maxsize=64)
def _shift(length: int) -> int:
    """x^(8 length) modulo the polynomial. It takes 0.1 ms; the chunks of a recording have few lengths."""
    power, square = _ONE, _X_8
    while length:
        if length & 1:
            power = _product(square, power)
        square = _product(square, square)
        length >>= 1
    return power


def _product(a: int, b: int) -> int:
    product = 0
    while a:
        if a & _ONE:
            product ^= b
        a = a << 1 & 0xFFFFFFFF
        b = b >> 1 ^ (POLYNOMIAL if b & 1 else 0)
    return product
