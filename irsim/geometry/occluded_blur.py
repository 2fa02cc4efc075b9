"""Light that moves while a frame is exposed, and what is hidden of it meanwhile."""

from __future__ import annotations

from typing import NamedTuple

from irsim.geometry.sprite import During
from irsim.types import Floats, Slices

WHOLE = slice(None), slice(None)
"""All of a patch."""


class Unsteady(NamedTuple):
    """What light in a patch of the picture differs by from its mean over the exposure at each of its instants.

    What hides a thing while it moves, and moves itself, hides other light than its mean hides of the mean. Of targets
    and occluders: a background's own texture, of which no target's light is, counts as its mean.
    """

    patch: Slices
    light: Floats

    @classmethod
    def of(cls, during: During, light: Floats, within: tuple[Slices, Slices]) -> Unsteady:
        """What something that moves brings before so much light, (rows, cols)."""
        inner, outer = within
        alpha, emission = (each[(..., *inner)] for each in (during.alpha, during.emission))
        brought = emission - alpha * light[outer]
        return cls(outer, brought - brought.mean(axis=0))

    def hide(self, light: Floats, where: Slices, hidden: Floats) -> None:
        """Something nearer, laid over the mean `light` (rows, cols) already, hides so much, 0..1, of the pixels `where`
        of the patch, at each instant or at all of them."""
        own = self.light[(..., *where)]
        lost = hidden * own
        mean = lost.mean(axis=0)
        own += mean - lost
        rows, columns = self.patch
        down, across = where
        light[rows, columns][down, across] -= mean
