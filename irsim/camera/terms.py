"""Terms of noise: what has a number of its own in a picture."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from irsim.camera.noise_base import read_only
from irsim.rng import normals
from irsim.types import Floats

Over = Literal["pixel", "row", "column", "frame"]

Term = tuple[str, Over, float]
"""Its name, what has a number of its own in it, and its sigma."""


def over(shape: tuple[int, int], what: Over) -> tuple[int, int]:
    """The shape of numbers for each pixel, row or column of a picture, or for it as a whole."""
    rows, columns = shape
    return {"pixel": (rows, columns), "row": (rows, 1), "column": (1, columns), "frame": (1, 1)}[what]


@lru_cache(maxsize=8)
def staying(shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], number: int = 0) -> Floats:
    """The sum of terms that stay, (rows, cols) float32, in the order given; each `number` has another. Read only."""
    after = (number,) if number else ()
    pattern = np.zeros(shape, np.float32)
    for term, what, sigma in terms:
        pattern += normals(over(shape, what), seed, "noise", name, term, *after) * np.float32(sigma)
    return read_only(pattern)
