"""Addressed randomness: a stream is named, not consumed from a global state.

``stream(seed, "clouds", 3)`` is the same stream in any process and in any order of calls; another
name gives independent numbers.
"""

from __future__ import annotations

import hashlib
import math
import operator
from functools import cache

import numpy as np
import numpy.typing as npt

from irsim._native import COMPILED, kernels
from irsim.types import Floats

Address = str | int


def bits(seed: int, *address: Address) -> np.random.SFC64:
    """The bit generator of an address. Its raw words are stable across numpy versions."""
    return np.random.SFC64(np.frombuffer(_digest(seed, *address), np.uint32))


def _digest(seed: int, *address: Address) -> bytes:
    text = str(operator.index(seed))
    for part in address:  # a numpy integer is the same address as the int it equals
        text += f"\x1fstr:{part}" if isinstance(part, str) else f"\x1fint:{operator.index(part)}"
    return hashlib.blake2b(text.encode(), digest_size=32).digest()


def stream(seed: int, *address: Address) -> np.random.Generator:
    """A generator of its own for each (seed, names, frame)."""
    return np.random.Generator(bits(seed, *address))


def uniforms(count: int, seed: int, *address: Address) -> npt.NDArray[np.float64]:
    """(count,) numbers spread evenly over 0 <= u < 1, by an address: what its `stream` draws first by `random`."""
    if COMPILED:
        values = np.empty(count)
        kernels.uniforms(_digest(seed, *address), values)
        return values
    return stream(seed, *address).random(count)


def normals(
    shape: tuple[int, ...], seed: int, *address: Address, out: npt.NDArray[np.float32] | None = None
) -> npt.NDArray[np.float32]:
    """Independent unit normals of an address: `shape` float32, mean 0, variance 1, true tails.

    Each is the inverse of the normal distribution at a 16-bit word, by table (raw words, unlike
    numpy's own normals, stay the same from version to version); words of the table's outer cells
    are refined by a further 64-bit word, which reaches 10 sigma. `out`: a C-contiguous float32
    array of that shape to be filled and returned.
    """
    if COMPILED:
        values = np.empty(shape, np.float32) if out is None else out
        kernels.normals(*begun(seed, *address), values)
        return values
    return _normals_plain(shape, bits(seed, *address), out)


def _normals_plain(
    shape: tuple[int, ...], source: np.random.SFC64, out: npt.NDArray[np.float32] | None
) -> npt.NDArray[np.float32]:
    from irsim.lookup import lookup
    from irsim.normal import REFINED, cell_means

    count = math.prod(shape)
    words = source.random_raw(-(-count // 4)).view(np.uint16)[:count].reshape(shape)
    values = lookup(cell_means(), words, out)
    words += np.uint16(REFINED)  # both ends at once: the sum wraps
    refined = np.flatnonzero(words < 2 * REFINED)
    if refined.size:
        values.reshape(-1)[refined] = _tails(words.reshape(-1)[refined], source.random_raw(refined.size))
    return values


Tables = tuple[npt.NDArray[np.int16], npt.NDArray[np.float32], Floats, int]


def begun(seed: int, *address: Address) -> tuple[bytes, *Tables]:
    """What the compiled loops draw the normals of an address from."""
    return _digest(seed, *address), *_tables()


@cache
def _tables() -> Tables:
    from irsim.normal import REFINED, cell_pieces, cell_words, deep_table

    return cell_words(), cell_pieces(), deep_table(), REFINED


def _tails(words: npt.NDArray[np.uint16], further: npt.NDArray[np.uint64]) -> Floats:
    """Normals of the outer cells: words 0 .. REFINED-1 from the upper end on, then those of the lower end;
    `further` places each within its cell."""
    from irsim.normal import CELLS, REFINED, deep_quantile

    upper = words < REFINED
    from_end = np.where(upper, (REFINED - 1) - words, words - REFINED)
    within = (further.astype(np.float64) + 0.5) * 2.0**-64
    tail = deep_quantile((from_end + within) / CELLS)
    return np.where(upper, -tail, tail)
