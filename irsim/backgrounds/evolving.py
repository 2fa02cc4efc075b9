"""Random fields that change smoothly in time, worked out where they are looked at."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.backgrounds.periodic import shrunk, window
from irsim.geometry.random_fields import Betas, amplitudes
from irsim.rng import normals
from irsim.types import Floats

STEPS = 8
"""States that are worked out in one `period` of an evolving field; frames between two are their
linear mix, whose standard deviation is smaller by 0.16 % at most (correlation 0.9936 over a step)."""

STRIP = 64
"""Rows of a field that are worked on at once, so that they stay in the processor's cache."""


def weights(place: float) -> list[tuple[int, float]]:
    """Numbers of the independent fields that make up an evolving one at time `place` (in periods), and their shares.

    A raised cosine over four of them, cos^2(pi/4 (place - j)) / sqrt(3/2): the squares add up to one
    at any time (cos^4 at steps of pi/4 sums to 3/2), so the variance is constant, and there is no
    kink where a field comes or goes.
    """
    first = int(np.floor(place)) - 1
    shares = ((j, np.cos(np.pi / 4 * (place - j)) ** 2 / np.sqrt(1.5)) for j in range(first, first + 4))
    return [(j, float(share)) for j, share in shares]


Aside = Callable[[Floats], Floats]
"""Two fields side by side, (side, side, 2) float32, to what is made of the first, float32."""


def first_of(pair: Floats, coarse: int) -> Floats:
    """The first of two fields side by side, `coarse` times smaller, float32."""
    return np.ascontiguousarray(shrunk(pair, coarse)[..., 0])


class _Pair:
    """Two independent periodic fields of mean 0, (side, side, 2) float32: the real and the imaginary part of one
    transform. They stay side by side: to take them apart as wholes costs more than to draw them."""

    def __init__(self, values: Floats, aside: Aside | None) -> None:
        self.values = values
        self.aside = None if aside is None else aside(values)

    def products(self, other: _Pair) -> Floats:
        """(2,) sums over all pixels of each field times the other pair's."""
        strips = (slice(row, row + STRIP) for row in range(0, len(self.values), STRIP))
        products = (cv2.multiply(self.values[strip], other.values[strip]) for strip in strips)
        return np.asarray(np.sum([cv2.sumElems(product)[:2] for product in products], axis=0))


@dataclass(frozen=True, eq=False)
class Mixture:
    """Two periodic fields at a moment: sums of others times their shares."""

    pairs: Sequence[_Pair]
    shares: tuple[float, ...]
    scales: tuple[float, float]
    """What brings each of the two sums to a variance of 1."""

    def over(self, rows: slice, columns: slice) -> tuple[Floats, Floats]:
        """A part of both, float32; it may reach past the edges."""
        if COMPILED:
            side, shape = len(self.pairs[0].values), (rows.stop - rows.start, columns.stop - columns.start)
            found = np.empty(shape, np.float32), np.empty(shape, np.float32)
            place = rows.start % side, columns.start % side
            kernels.mixed(self.shares, self.scales, side, *place, *found, *(pair.values for pair in self.pairs))
            return found
        both = _sum([window(pair.values, rows, columns) for pair in self.pairs], self.shares)
        first, second = cv2.split(both)
        return first * np.float32(self.scales[0]), second * np.float32(self.scales[1])

    @property
    def aside(self) -> Floats | None:
        """What the fields' own `aside` makes of the first one, float32."""
        parts = [pair.aside for pair in self.pairs if pair.aside is not None]
        return _sum(parts, self.shares) * np.float32(self.scales[0]) if parts else None


def _sum(parts: Sequence[Floats], shares: Sequence[float]) -> Floats:
    total = parts[0] * np.float32(shares[0])
    for part, share in zip(parts[1:], shares[1:], strict=True):
        cv2.scaleAdd(part, share, total, dst=total)
    return total


class Evolving:
    """Two independent periodic Gaussian fields of one spectrum, mean 0 and variance 1, that change in time.

    Only what it keeps for speed ever changes: a time asked for gives the same fields whatever was
    asked for before. `period`: a field one period later has a correlation of 2/3, four periods
    later none.

    aside: what else is made of the first one. It is worked out once for all mixtures: what it makes of a sum must be
    the sum of what it makes of each part.
    """

    def __init__(
        self,
        side: int,
        beta: float,
        betas: Betas | None,
        correlation_px: float,
        stretch: float,
        seed: int,
        name: str,
        aside: Aside | None = None,
    ) -> None:
        self.side, self.seed, self.name = side, seed, name
        self._aside = aside
        frequencies = np.fft.fftfreq(side)
        fx, fy = frequencies[None, :], frequencies[:, None]
        amplitude = amplitudes(fx, fy, beta, betas, correlation_px, stretch)
        # To a variance of about 1: products of fields whose slopes are extreme would not fit float32. Not by `norm`,
        # which wakes a thread that goes on spinning for longer than a first frame's backgrounds take.
        self._amplitude = (amplitude / np.sqrt(np.sum(amplitude**2))).astype(np.float32)[..., None]
        self._pairs: dict[int, _Pair] = {}
        self._products: dict[tuple[int, int], Floats] = {}

    def at(self, place: float) -> Mixture:
        """Both fields at a time in periods."""
        numbers, shares = zip(*weights(place), strict=True)
        # What is kept is read and put once: another thread may put its own there.
        drawn, known = self._pairs, self._products
        pairs = self._pairs = {j: drawn[j] if j in drawn else self._drawn(j) for j in numbers}
        between = [(i, j) for i in numbers for j in numbers if i <= j]
        of_two = self._products = {
            (i, j): known[i, j] if (i, j) in known else pairs[i].products(pairs[j]) for i, j in between
        }
        # Fields that are independent have something in common by chance: a variance of 1 takes it into account.
        products = np.array([[of_two[min(i, j), max(i, j)] for j in numbers] for i in numbers])
        scales = self.side / np.sqrt(np.einsum("i,j,ijk->k", shares, shares, products))
        first, second = scales.tolist()
        return Mixture(list(pairs.values()), shares, (first, second))

    def _drawn(self, number: int) -> _Pair:
        white = normals((self.side, self.side, 2), self.seed, self.name, "evolving", number)
        white *= self._amplitude
        return _Pair(np.asarray(cv2.dft(white, dst=white, flags=cv2.DFT_INVERSE)), self._aside)
