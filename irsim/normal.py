"""The normal distribution without scipy (whose import costs more than a frame's worth of rendering)."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from irsim.types import Floats

CELLS = 65_536
"""Cells of equal probability in the table: one for each 16-bit word."""

REFINED = 16
"""Cells at each end that a table cannot stand for: the last one alone runs from 4.17 sigma to infinity."""

# Rational approximations of Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988)
# 477-484, highest power first: centre |p - 1/2| <= 0.425, tail down to p = exp(-25), far tail.
_CENTRE = np.transpose(
    (
        (
            2.5090809287301226727e3,
            3.3430575583588128105e4,
            6.7265770927008700853e4,
            4.5921953931549871457e4,
            1.3731693765509461125e4,
            1.9715909503065514427e3,
            1.3314166789178437745e2,
            3.3871328727963666080e0,
        ),
        (
            5.2264952788528545610e3,
            2.8729085735721942674e4,
            3.9307895800092710610e4,
            2.1213794301586595867e4,
            5.3941960214247511077e3,
            6.8718700749205790830e2,
            4.2313330701600911252e1,
            1.0,
        ),
    )
)
_TAIL = np.transpose(
    (
        (
            7.74545014278341407640e-4,
            2.27238449892691845833e-2,
            2.41780725177450611770e-1,
            1.27045825245236838258e0,
            3.64784832476320460504e0,
            5.76949722146069140550e0,
            4.63033784615654529590e0,
            1.42343711074968357734e0,
        ),
        (
            1.05075007164441684324e-9,
            5.47593808499534494600e-4,
            1.51986665636164571966e-2,
            1.48103976427480074590e-1,
            6.89767334985100004550e-1,
            1.67638483018380384940e0,
            2.05319162663775882187e0,
            1.0,
        ),
    )
)
_FAR_TAIL = np.transpose(
    (
        (
            2.01033439929228813265e-7,
            2.71155556874348757815e-5,
            1.24266094738807843860e-3,
            2.65321895265761230930e-2,
            2.96560571828504891230e-1,
            1.78482653991729133580e0,
            5.46378491116411436990e0,
            6.65790464350110377720e0,
        ),
        (
            2.04426310338993978564e-15,
            1.42151175831644588870e-7,
            1.84631831751005468180e-5,
            7.86869131145613259100e-4,
            1.48753612908506148525e-2,
            1.36929880922735805310e-1,
            5.99832206555887937690e-1,
            1.0,
        ),
    )
)


def _ratio(coefficients: Floats, r: Floats) -> Floats:
    """Ratio of two polynomials, coefficients (power, above or below), at r (any shape)."""
    value = np.zeros((2, r.size))
    for pair in coefficients:
        value = value * r.ravel() + pair[:, None]
    return np.asarray(value[0] / value[1]).reshape(r.shape)


def quantile(p: float | Floats) -> Floats:
    """The x below which a unit normal lies with probability p (any shape, 0 < p < 1), float64.

    Relative error about 1e-15 (Wichura, AS 241, 1988).
    """
    p = np.asarray(p, dtype=np.float64)
    q = p - 0.5
    centre = q * _ratio(_CENTRE, 0.425**2 - q * q)
    return np.where(np.abs(q) <= 0.425, centre, np.copysign(tail_quantile(np.minimum(p, 1 - p)), q))


def tail_quantile(p: Floats) -> Floats:
    """The same for p <= 0.075 only (any shape), which is quicker."""
    r = np.sqrt(-np.log(p))
    return np.where(r <= 5, -_ratio(_TAIL, r - 1.6), -_ratio(_FAR_TAIL, r - 5))


DEPTH_BITS = 8
"""The tails' table has two to so many steps to a halving of the probability."""

_BELOW = 52 - DEPTH_BITS
"""Bits of a float64 below those that tell the step."""

_DEEPEST = 2.0**-82
"""The probability that the tails' table begins with: less than the lowest cell and 64 further bits can tell."""


def deep_quantile(p: Floats) -> Floats:
    """The same for 2^-82 <= p <= REFINED / CELLS only (any shape), by table: within 6e-7.

    The table has equal steps within each halving of p, as a float has: a number's own bits tell its place, and no
    logarithm is taken, whose last digit would depend on who takes it.
    """
    bits = np.asarray(p, np.float64).view(np.int64)
    place = (bits >> _BELOW) - (int(np.float64(_DEEPEST).view(np.int64)) >> _BELOW)
    share = (bits & ((1 << _BELOW) - 1)) * 2.0**-_BELOW
    table = deep_table()
    return np.asarray(table[place] + share * (table[place + 1] - table[place]))


@lru_cache
def deep_table() -> Floats:
    """The quantiles of p = _DEEPEST (1 + j / 2^DEPTH_BITS) 2^i, read-only, float64; the last one twice, for p rounded
    up to it."""
    halvings = round(math.log2(REFINED / CELLS / _DEEPEST))
    within = 1 + np.arange(1 << DEPTH_BITS) / (1 << DEPTH_BITS)
    p = (_DEEPEST * 2.0 ** np.arange(halvings)[:, None] * within).ravel()
    table = tail_quantile(np.append(p, 2 * [REFINED / CELLS]))
    table.flags.writeable = False
    return table


def density(x: float | Floats) -> Floats:
    """Density of the unit normal at x (any shape)."""
    return np.asarray(np.exp(-np.square(x) / 2) / math.sqrt(2 * math.pi))


UNIT_BITS = 13
"""Means of cells are whole numbers of 2^-UNIT_BITS: those of the inner cells, within 3.5 sigma, fit 16 bits."""


@lru_cache
def cell_means() -> Floats:
    """(CELLS,) float32: about the mean of a unit normal within each cell, in rising order, read-only.

    Within 7e-5 of it: whole numbers of a unit of 1.2e-4, so that the processor's nearest caches hold the table, by the
    polynomials of `cell_pieces`, so that it can be worked out where a table is slow to read.
    """
    cells = np.arange(REFINED, CELLS // 2).astype(np.float32).view(np.int32)
    pieces = cell_pieces()[:, (cells >> _BELOW_PIECE) % PIECES]
    within = ((cells & 0x7FFFFF) | 0x3F800000).view(np.float32)  # its digits alone: 1 to 2
    lower = pieces[-1]
    for each in pieces[-2::-1]:  # float64 holds all digits of product and sum, which are rounded once, as if fused
        lower = (lower.astype(np.float64) * within + each).astype(np.float32)
    outer = np.diff(density(quantile(np.arange(1, REFINED + 1) / CELLS)), prepend=0.0) * -CELLS
    lower = np.rint(np.concatenate([outer.astype(np.float32), lower]) * np.float32(2**UNIT_BITS))
    means = np.concatenate([lower, -lower[::-1]]) * np.float32(2.0**-UNIT_BITS)
    means.flags.writeable = False
    return means


@lru_cache
def cell_words() -> npt.NDArray[np.int16]:
    """(CELLS,) int16, read-only: the same in units of 2^-UNIT_BITS; each of the outer cells, which are drawn from the
    true tail, has a mark of its own instead: from -32768 on, those of the upper end in rising order, then those of the
    lower one."""
    marks = np.arange(2 * REFINED) - 2**15
    inner = cell_means()[REFINED:-REFINED] * 2**UNIT_BITS
    words = np.concatenate([marks[REFINED:], inner, marks[:REFINED]]).astype(np.int16)
    words.flags.writeable = False
    return words


PIECES = 32
"""Pieces in which the means of cells are told: two to each doubling of a cell's number, by the last bits of a float's
exponent and the first of its digits. Half of them are of no cell."""

_POWERS = 5
"""Powers of each piece, from the constant on: so many leave 4e-6 of a standard deviation."""

_BELOW_PIECE = 22
"""Bits of a float32 below those that tell the piece."""


@lru_cache
def cell_pieces() -> Floats:
    """(_POWERS, PIECES) float32, read-only: the mean within cell m from the lower end on, REFINED <= m < CELLS / 2, is
    the sum of piece[power] x^power, x = m / 2^floor(log2 m), by Horner's rule with sums and products rounded together.

    Means of cells vary less than what they stand for. They are scaled such that the variance is 1 where the outer
    REFINED cells are drawn from the true tail; within 3e-7 of it once they are rounded.
    """
    pieces = np.zeros((_POWERS, PIECES))
    nodes = np.cos(np.pi * (np.arange(_POWERS) + 0.5) / _POWERS)  # Chebyshev's: the error is nearly even
    for doubling in range(int(math.log2(REFINED)), int(math.log2(CELLS // 2))):
        for half in (0, 1):
            x = 1.25 + half / 2 + nodes / 4
            piece = int(np.float32(2.0**doubling * (1 + half / 2)).view(np.int32)) >> _BELOW_PIECE
            pieces[:, piece % PIECES] = _through(x, _mean_within(x * 2.0**doubling))
    edge = float(quantile(REFINED / CELLS))
    tail = REFINED / CELLS - edge * float(density(edge))  # E[x^2; x < edge], by parts
    told = np.square(_mean_within(np.arange(REFINED, CELLS // 2, dtype=np.float64))).sum() / CELLS
    pieces = (pieces * math.sqrt((0.5 - tail) / told)).astype(np.float32)
    pieces.flags.writeable = False
    return pieces


def _mean_within(cell: Floats) -> Floats:
    """E[x | a < x < b] = (density(a) - density(b)) / P(a < x < b) of the cells that begin at `cell` / CELLS."""
    return (density(quantile(cell / CELLS)) - density(quantile((cell + 1) / CELLS))) * CELLS


def _through(x: Floats, y: Floats) -> Floats:
    """The powers' factors, from the constant on, of the polynomial through the points (x, y): Newton's."""
    slopes = np.array(y)
    for order in range(1, len(x)):
        slopes[order:] = (slopes[order:] - slopes[order - 1 : -1]) / (x[order:] - x[:-order])
    factors = np.zeros(len(x))
    for order in range(len(x) - 1, -1, -1):
        factors[1:], factors[0] = factors[:-1] - x[order] * factors[1:], slopes[order] - x[order] * factors[0]
    return factors
