"""Addressed random streams: a stream is named by a seed and an address instead of being drawn from global state.

``stream(seed, "clouds", 3)`` is the same stream in any process and in any order of calls; another address gives
independent numbers. Standard normal deviates (random numbers of mean 0 and variance 1) are looked up in a table by raw
16-bit words, which are the same in all versions of numpy. The normal distribution is defined here too, as importing
scipy takes longer than rendering a frame.
"""

from __future__ import annotations

import hashlib
import math
import operator
from functools import cache
from statistics import NormalDist
from typing import TypeVar, cast

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats, read_only

Address = str | int
Entry = TypeVar("Entry", np.uint8, np.float32)
Tables = tuple[npt.NDArray[np.int16], Floats, int]

CELLS = 65_536
"""Number of cells of equal probability in the table of normal deviates: one for each 16-bit word."""

REFINED = 16
"""Number of cells at each end of the table in which deviates follow the exact tail instead of the cell's mean. The
outermost cell extends from 4.17 sigma to infinity."""

UNIT_BITS = 13
"""Means of cells are multiples of 2^-UNIT_BITS: those of the inner cells, within 3.5 sigma, fit 16 bits."""

PIECES = 32
"""Number of polynomial pieces that give the means of cells: two for each doubling of the cell's number m. The lowest
bits of the exponent of float(m), with the highest bit of its mantissa, select the piece; half of the pieces contain no
cell."""

_POWERS = 5
"""Number of coefficients of each piece, the constant first. The remaining error is 4e-6 sigma."""

_BELOW_PIECE = 22
"""Number of bits of a float32 below the bits that select the polynomial piece."""

DEPTH_BITS = 8
"""The tail table has 2^DEPTH_BITS steps for each halving of the probability."""

_BELOW_STEP = 52 - DEPTH_BITS
"""Number of bits of a float64 below the bits that select the step of the tail table."""

_DEEPEST = 2.0**-82
"""First probability of the tail table, below the lowest one that a tail cell refined by 64 bits can give."""

_CV2_TAKES_16_BITS = int(cv2.__version__.split(".")[0]) >= 5
"""True if OpenCV looks up 16-bit words. OpenCV 4 has 8-bit tables only; numpy, which widens the words, takes about
twice the time of OpenCV 5."""

# Rational approximation of Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988) 477-484, for |p - 1/2| <=
# 0.425: (numerator, denominator) of each power, highest first. `statistics.NormalDist`, the same
# algorithm, computes the tails.
_CENTRE = np.array(
    [
        [2.5090809287301226727e3, 5.2264952788528545610e3],
        [3.3430575583588128105e4, 2.8729085735721942674e4],
        [6.7265770927008700853e4, 3.9307895800092710610e4],
        [4.5921953931549871457e4, 2.1213794301586595867e4],
        [1.3731693765509461125e4, 5.3941960214247511077e3],
        [1.9715909503065514427e3, 6.8718700749205790830e2],
        [1.3314166789178437745e2, 4.2313330701600911252e1],
        [3.3871328727963666080e0, 1.0],
    ]
)
_tail_quantile = np.frompyfunc(NormalDist().inv_cdf, 1, 1)


def bit_generator(seed: int, *address: Address) -> np.random.SFC64:
    """Return the bit generator of an address. Its raw words are stable across numpy versions."""
    return np.random.SFC64(np.frombuffer(_digest(seed, *address), np.uint32))


def stream(seed: int, *address: Address) -> np.random.Generator:
    """Return the random generator of a seed and an address (names and frame numbers)."""
    return np.random.Generator(bit_generator(seed, *address))


def uniforms(count: int, seed: int, *address: Address) -> npt.NDArray[np.float64]:
    """Draw (count,) uniform numbers, 0 <= u < 1: the first numbers of `stream(seed, *address).random`."""
    return stream(seed, *address).random(count)


def normals(
    shape: tuple[int, ...], seed: int, *address: Address, out: npt.NDArray[np.float32] | None = None
) -> npt.NDArray[np.float32]:
    """Draw independent standard normal deviates of an address, float32 of `shape`, with exact tails.

    A table gives each deviate as the normal quantile of a 16-bit word. Words of the table's outer cells are refined by
    another 64-bit word, which reaches 10 sigma. `out` is a C-contiguous float32 array of `shape` to fill and return.
    """
    source, count = bit_generator(seed, *address), math.prod(shape)
    words = source.random_raw(-(-count // 4)).view(np.uint16)[:count].reshape(shape)
    values = lookup(cell_means(), words, out)
    words += np.uint16(REFINED)  # uint16 wraps: both ends become small words
    refined = np.flatnonzero(words < 2 * REFINED)
    if refined.size:
        values.reshape(-1)[refined] = _tail_normals(words.reshape(-1)[refined], source.random_raw(refined.size))
    return values


def kernel_arguments(seed: int, *address: Address) -> tuple[bytes, *Tables]:
    """Return the arguments from which compiled kernels draw the normal deviates of an address."""
    return _digest(seed, *address), *_tables()


def lookup(
    table: npt.NDArray[Entry], words: npt.NDArray[np.uint16], out: npt.NDArray[Entry] | None = None
) -> npt.NDArray[Entry]:
    """Return table[words]: table (65536,), words any shape; out a C-contiguous array of the table's type and shape."""
    if _CV2_TAKES_16_BITS and words.ndim == 2 and words.size:
        return cast(npt.NDArray[Entry], cv2.LUT(words, table.reshape(1, -1), dst=out))
    # With the default mode, numpy would copy through a buffer where `out` is given.
    return np.take(table, words, out=out, mode="clip")


def normal_quantile(p: float | Floats) -> Floats:
    """Return the quantile of the standard normal distribution at probability p (any shape, 0 < p < 1), float64.

    Relative error about 1e-15 (Wichura, AS 241, 1988).
    """
    p = np.asarray(p, dtype=np.float64)
    q = p - 0.5
    found = np.empty(p.shape)
    inner = np.abs(q) <= 0.425
    r = 0.425**2 - q[inner] ** 2
    numerator, denominator = (np.polyval(each, r) for each in _CENTRE.T)
    found[inner] = q[inner] * (numerator / denominator)
    found[~inner] = _tail_quantile(p[~inner])
    return found


def deep_quantile(p: Floats) -> Floats:
    """Return the standard normal quantile for 2^-82 <= p <= REFINED / CELLS (any shape) by table, with an error below
    6e-7.

    The table has equal steps within each halving of p, as floats do: the bits of p select the step. A logarithm, whose
    last digit depends on the platform, is not needed.
    """
    bits = np.asarray(p, np.float64).view(np.int64)
    place = (bits >> _BELOW_STEP) - (int(np.float64(_DEEPEST).view(np.int64)) >> _BELOW_STEP)
    share = (bits & ((1 << _BELOW_STEP) - 1)) * 2.0**-_BELOW_STEP
    table = _deep_table()
    return np.asarray(table[place] + share * (table[place + 1] - table[place]))


@cache
def cell_means() -> Floats:
    """Return the approximate mean of a standard normal deviate within each cell, rising, (CELLS,) float32, read-only.

    The error is below 7e-5. Means are multiples of 1.2e-4, so that the table fits into the processor's first cache.
    They follow the polynomials of `_cell_pieces`, so that kernels can compute them where a table is slow to read.
    """
    cells = np.arange(REFINED, CELLS // 2).astype(np.float32).view(np.int32)
    pieces = _cell_pieces()[:, (cells >> _BELOW_PIECE) % PIECES]
    within = ((cells & 0x7FFFFF) | 0x3F800000).view(np.float32)  # the mantissa of m, from 1 to 2
    lower = pieces[-1]
    for each in pieces[-2::-1]:  # float64 holds all digits of product and sum, rounded once like a fused operation
        lower = (lower.astype(np.float64) * within + each).astype(np.float32)
    outer = np.diff(_density(normal_quantile(np.arange(1, REFINED + 1) / CELLS)), prepend=0.0) * -CELLS
    lower = np.rint(np.concatenate([outer.astype(np.float32), lower]) * np.float32(2**UNIT_BITS))
    return read_only(np.concatenate([lower, -lower[::-1]]) * np.float32(2.0**-UNIT_BITS))


def _digest(seed: int, *address: Address) -> bytes:
    text = str(operator.index(seed))
    for part in address:  # a numpy integer is the same address as the int it equals
        text += f"\x1fstr:{part}" if isinstance(part, str) else f"\x1fint:{operator.index(part)}"
    return hashlib.blake2b(text.encode(), digest_size=32).digest()


def _tail_normals(words: npt.NDArray[np.uint16], fractions: npt.NDArray[np.uint64]) -> Floats:
    """Return normal deviates of the outer cells: words 0 .. REFINED-1 from the upper end on, then those of the lower
    end; `fractions` give the position of each within its cell."""
    upper = words < REFINED
    from_end = np.where(upper, (REFINED - 1) - words, words - REFINED)
    within = (fractions.astype(np.float64) + 0.5) * 2.0**-64
    tail = deep_quantile((from_end + within) / CELLS)
    return np.where(upper, -tail, tail)


@cache
def _tables() -> Tables:
    return _cell_words(), _deep_table(), REFINED


def _cell_words() -> npt.NDArray[np.int16]:
    """Return `cell_means` in units of 2^-UNIT_BITS, (CELLS,) int16, read-only.

    Tail cells contain codes instead of means: consecutive numbers from -32768 on, for the upper tail first.
    """
    marks = np.arange(2 * REFINED) - 2**15
    inner = cell_means()[REFINED:-REFINED] * 2**UNIT_BITS
    return read_only(np.concatenate([marks[REFINED:], inner, marks[:REFINED]]).astype(np.int16))


@cache
def _cell_pieces() -> Floats:
    """Return polynomials of the means of cells, (_POWERS, PIECES) float32, read-only.

    The mean within cell m from the lower end on, REFINED <= m < CELLS / 2, is the sum of piece[power] x^power, x = m /
    2^floor(log2 m), by Horner's rule with fused multiply-add. As means vary less than the deviates that they replace,
    they are scaled so that together with the exact tails the variance is 1, within 3e-7 after rounding.
    """
    pieces = np.zeros((_POWERS, PIECES))
    nodes = np.cos(np.pi * (np.arange(_POWERS) + 0.5) / _POWERS)  # Chebyshev nodes: nearly equal error
    for doubling in range(int(math.log2(REFINED)), int(math.log2(CELLS // 2))):
        for half in (0, 1):
            x = 1.25 + half / 2 + nodes / 4
            piece = int(np.float32(2.0**doubling * (1 + half / 2)).view(np.int32)) >> _BELOW_PIECE
            pieces[:, piece % PIECES] = _newton_polynomial(x, _mean_within(x * 2.0**doubling))
    edge = float(normal_quantile(REFINED / CELLS))
    tail = REFINED / CELLS - edge * float(_density(edge))  # E[x^2; x < edge], by parts
    inner = np.square(_mean_within(np.arange(REFINED, CELLS // 2, dtype=np.float64))).sum() / CELLS
    return read_only((pieces * math.sqrt((0.5 - tail) / inner)).astype(np.float32))


@cache
def _deep_table() -> Floats:
    """Return the quantiles of p = _DEEPEST (1 + j / 2^DEPTH_BITS) 2^i, read-only, float64; the last one is repeated, as
    rounding of p may select the step after it."""
    halvings = round(math.log2(REFINED / CELLS / _DEEPEST))
    within = 1 + np.arange(1 << DEPTH_BITS) / (1 << DEPTH_BITS)
    p = (_DEEPEST * 2.0 ** np.arange(halvings)[:, None] * within).ravel()
    tail = _tail_quantile(np.append(p, 2 * [REFINED / CELLS]))
    return read_only(np.asarray(tail, np.float64))


def _density(x: float | Floats) -> Floats:
    """Return the density of the standard normal distribution at x (any shape)."""
    return np.asarray(np.exp(-np.square(x) / 2) / math.sqrt(2 * math.pi))


def _mean_within(cell: Floats) -> Floats:
    """Return E[x | a < x < b] = (density(a) - density(b)) / P(a < x < b) of the cells that begin at `cell` / CELLS."""
    return (_density(normal_quantile(cell / CELLS)) - _density(normal_quantile((cell + 1) / CELLS))) * CELLS


def _newton_polynomial(x: Floats, y: Floats) -> Floats:
    """Return the coefficients, constant first, of the polynomial through the points (x, y): Newton's form, expanded."""
    slopes = np.array(y)
    for order in range(1, len(x)):
        slopes[order:] = (slopes[order:] - slopes[order - 1 : -1]) / (x[order:] - x[:-order])
    factors = np.zeros(len(x))
    for order in range(len(x) - 1, -1, -1):
        factors[1:], factors[0] = factors[:-1] - x[order] * factors[1:], slopes[order] - x[order] * factors[0]
    return factors
