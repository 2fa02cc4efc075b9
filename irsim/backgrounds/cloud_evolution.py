"""States of an evolving cloud: random fields that change smoothly in time, and tiles of cloud painted on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.backgrounds.texture import shrunk, window
from irsim.geometry.random_fields import Betas, amplitudes
from irsim.rng import normals
from irsim.types import Floats

STEPS = 8
"""States per `period` of an evolving field. Frames between two states are their linear mix, whose standard deviation is
smaller by at most 0.16 % (correlation 0.9936 over a step)."""

STRIP = 64
"""Rows of a field per pass, so that they stay in the processor's cache."""

TILE = 128
"""Side of a painted tile, px: its working set stays in the processor's cache."""

WINDOW_MARGIN = 16
"""Margin of the cached window around a frame, px, so that it serves the next frames too."""

GREATEST = 65535
"""Value of the greatest 16-bit word, 32767, in units of `CloudState`; the least word, -32768, stands for 0."""

DARKEST = 1e-30
"""Radiance below which a layer emits nothing, W/m2/sr."""

DerivedField = Callable[[Floats], Floats]
"""Linear function of the first field of a pair, (side, side, 2) float32."""

PaintTile = Callable[[slice, slice], tuple[Floats, Floats]]
"""Function from slices of rows and columns, within the period, to transmittance and emission there, float32."""

Words = npt.NDArray[np.int16]


def weights(place: float) -> list[tuple[int, float]]:
    """Return (number, share) of the independent fields whose weighted sum is an evolving field at the time `place`,
    periods.

    The shares are a raised cosine over four fields, cos^2(pi/4 (place - j)) / sqrt(3/2). Their squares add up to one at
    any time (cos^4 at steps of pi/4 sums to 3/2), so the variance is constant; the shares are smooth in time.
    """
    first = int(np.floor(place)) - 1
    shares = ((j, np.cos(np.pi / 4 * (place - j)) ** 2 / np.sqrt(1.5)) for j in range(first, first + 4))
    return [(j, float(share)) for j, share in shares]


def first_of(pair: Floats, coarse: int) -> Floats:
    """Return the first of two interleaved fields, reduced in size by the factor `coarse`, float32."""
    return np.ascontiguousarray(shrunk(pair, coarse)[..., 0])


class _FieldPair:
    """Two independent periodic fields of mean 0, interleaved, (side, side, 2) float32: real and imaginary part of one
    Fourier transform."""

    def __init__(self, values: Floats, derived: DerivedField | None) -> None:
        self.values = values
        self.derived = None if derived is None else derived(values)

    def products(self, other: _FieldPair) -> Floats:
        """Return, for each field of this pair, its inner product with the same field of the other pair, (2,)."""
        strips = (slice(row, row + STRIP) for row in range(0, len(self.values), STRIP))
        products = (cv2.multiply(self.values[strip], other.values[strip]) for strip in strips)
        return np.asarray(np.sum([cv2.sumElems(product)[:2] for product in products], axis=0))


@dataclass(frozen=True, eq=False)
class Mixture:
    """Two periodic fields at one time: weighted sums of field pairs."""

    pairs: Sequence[_FieldPair]
    shares: tuple[float, ...]
    scales: tuple[float, float]
    """Factors that give each sum a variance of 1."""

    def over(self, rows: slice, columns: slice) -> tuple[Floats, Floats]:
        """Return a part of both fields, float32; past their edges they repeat."""
        if COMPILED:
            side, shape = len(self.pairs[0].values), (rows.stop - rows.start, columns.stop - columns.start)
            found = np.empty(shape, np.float32), np.empty(shape, np.float32)
            place = rows.start % side, columns.start % side
            kernels.mixed(self.shares, self.scales, side, *place, *found, *(pair.values for pair in self.pairs))
            return found
        both = _weighted_sum([window(pair.values, rows, columns) for pair in self.pairs], self.shares)
        first, second = cv2.split(both)
        return first * np.float32(self.scales[0]), second * np.float32(self.scales[1])

    @property
    def derived(self) -> Floats | None:
        """Derived field of the mixture, float32; None without one."""
        parts = [pair.derived for pair in self.pairs if pair.derived is not None]
        return _weighted_sum(parts, self.shares) * np.float32(self.scales[0]) if parts else None


def _weighted_sum(parts: Sequence[Floats], shares: Sequence[float]) -> Floats:
    total = parts[0] * np.float32(shares[0])
    for part, share in zip(parts[1:], shares[1:], strict=True):
        cv2.scaleAdd(part, share, total, dst=total)
    return total


class EvolvingFields:
    """Two independent periodic Gaussian fields of one spectrum, mean 0 and variance 1, that change in time.

    The correlation is 2/3 after one period and 0 after four. Fields depend on the time only, not on earlier calls;
    caches only save time.

    derived: linear function of the first field, evaluated once for each pair.
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
        derived: DerivedField | None = None,
    ) -> None:
        self.side, self.seed, self.name = side, seed, name
        self._derived = derived
        frequencies = np.fft.fftfreq(side)
        fx, fy = frequencies[None, :], frequencies[:, None]
        amplitude = amplitudes(fx, fy, beta, betas, correlation_px, stretch)
        # Scaled to a variance of about 1: products of fields of extreme slopes would overflow float32.
        # `np.linalg.norm` is avoided: its thread spins for longer than the backgrounds of a first frame take.
        self._amplitude = (amplitude / np.sqrt(np.sum(amplitude**2))).astype(np.float32)[..., None]
        self._pairs: dict[int, _FieldPair] = {}
        self._products: dict[tuple[int, int], Floats] = {}

    def at(self, place: float) -> Mixture:
        """Return both fields at a time in periods."""
        numbers, shares = zip(*weights(place), strict=True)
        # Caches are read and replaced once: another thread may replace them.
        drawn, known = self._pairs, self._products
        pairs = self._pairs = {j: drawn[j] if j in drawn else self._drawn(j) for j in numbers}
        between = [(i, j) for i in numbers for j in numbers if i <= j]
        of_two = self._products = {
            (i, j): known[i, j] if (i, j) in known else pairs[i].products(pairs[j]) for i, j in between
        }
        # Independent fields are correlated by chance; the scales correct for it.
        products = np.array([[of_two[min(i, j), max(i, j)] for j in numbers] for i in numbers])
        scales = self.side / np.sqrt(np.einsum("i,j,ijk->k", shares, shares, products))
        first, second = scales.tolist()
        return Mixture(list(pairs.values()), shares, (first, second))

    def _drawn(self, number: int) -> _FieldPair:
        white = normals((self.side, self.side, 2), self.seed, self.name, "evolving", number)
        white *= self._amplitude
        return _FieldPair(np.asarray(cv2.dft(white, dst=white, flags=cv2.DFT_INVERSE)), self._derived)


class CloudState:
    """Transmittance and emission of a cloud at one time, periodic in (side, side), a multiple of TILE.

    They are stored as 16-bit words, which a frame reads faster than floats: a word w stands for w + 32768 units, with
    an error of half a unit at most. A unit is 1/65535 of the transmittance 1, or of the greatest emission, W/m2/sr: an
    eighth of a count if the cloud spans the range of a 14-bit camera.

    Tiles are painted on first use. The last window is stored contiguously, so that it is read in half the time.
    """

    def __init__(self, side: int, brightest: float, paint: PaintTile) -> None:
        self.side = side
        self.units = 1 / GREATEST, max(brightest, DARKEST) / GREATEST
        self.paint = paint
        self._tiles: dict[tuple[int, int], tuple[Words, Words]] = {}
        nothing = np.empty((0, 0), np.int16)
        self._last: tuple[int, int, Words, Words] = 0, 0, nothing, nothing
        """First column and row of the last window, and its words."""

    def window(self, column: int, row: int, width: int, height: int) -> tuple[Words, Words]:
        """Return windows (height, width) of transmittance and emission from a column and a row on, periodic; read
        only."""
        first, top, passed, emitted = self._last  # read once: another thread may replace it
        rows, columns = passed.shape
        if not (0 <= column - first <= columns - width and 0 <= row - top <= rows - height):
            first, top = column - WINDOW_MARGIN, row - WINDOW_MARGIN
            size = width + 2 * WINDOW_MARGIN, height + 2 * WINDOW_MARGIN
            passed, emitted = self._assembled(first, top, *size)
            self._last = first, top, passed, emitted
        here = slice(row - top, row - top + height), slice(column - first, column - first + width)
        return passed[here], emitted[here]

    def _assembled(self, column: int, row: int, width: int, height: int) -> tuple[Words, Words]:
        """Return a window of transmittance and emission, assembled from tiles in contiguous memory."""
        joined = np.empty((height, width), np.int16), np.empty((height, width), np.int16)
        for i, down, rows in _tile_parts(row, height):
            for j, across, columns in _tile_parts(column, width):
                tile = self._tile(i * TILE % self.side, j * TILE % self.side)
                for picture, part in zip(joined, tile, strict=True):
                    picture[down, across] = part[rows, columns]
        return joined

    def _tile(self, row: int, column: int) -> tuple[Words, Words]:
        """Return the words of transmittance and emission of a tile, (TILE, TILE) each."""
        if (row, column) not in self._tiles:
            counts = np.empty((2, TILE, TILE), np.uint16)
            painted = self.paint(slice(row, row + TILE), slice(column, column + TILE))
            for field, unit, out in zip(painted, self.units, counts, strict=True):
                _to_units(field, unit, out)
            passed, emitted = _flipped(counts).view(np.int16)
            self._tiles[row, column] = passed, emitted
        return self._tiles[row, column]


def units_of(words: Words) -> npt.NDArray[np.uint16]:
    """Return the units that each stored 16-bit word stands for."""
    return _flipped(words.view(np.uint16))


def _flipped(words: npt.NDArray[np.uint16]) -> npt.NDArray[np.uint16]:
    """Convert words to units, or units to words. The processor multiplies two signed words in one instruction."""
    return words ^ np.uint16(0x8000)


def _to_units(field: Floats, unit: float, out: npt.NDArray[np.uint16]) -> None:
    """Write a field to `out`, rounded to units; negative values, from the kernel of a sharp lens, become 0."""
    if COMPILED:
        kernels.counts_of(np.ascontiguousarray(field), out, 1 / unit, 0.0, GREATEST, False, None, None)
        return
    levels = field * np.float32(1 / unit)
    np.rint(levels, out=levels)
    out[...] = np.clip(levels, 0, GREATEST, out=levels)


def _tile_parts(begin: int, length: int) -> Iterator[tuple[int, slice, slice]]:
    """Yield the tiles that an interval on one axis meets: number, and their overlap as slices of the interval and the
    tile."""
    end = begin + length
    for number in range(begin // TILE, -(-end // TILE)):
        edge = number * TILE
        first, last = max(begin, edge), min(end, edge + TILE)
        yield number, slice(first - begin, last - begin), slice(first - edge, last - edge)
