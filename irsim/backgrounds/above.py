"""Cloud layers that the ground or the sea hides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irsim.backgrounds.base import Changed, Layer, SemiTransparentLayer, ViewDirection, is_veil
from irsim.types import Floats, Slices


class Hides(Protocol):
    """What hides the lower part of the sky."""

    def sky_left(self, view_direction: ViewDirection) -> Floats:
        """(rows, cols): the share of each pixel that it leaves to the sky."""
        ...


@dataclass(frozen=True, eq=False)
class Above(Changed):
    """A cloud layer that the ground or the sea hides."""

    country: Hides

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        transmittance, emission = self.layer.light(view_direction)
        assert transmittance is not None
        left = self.country.sky_left(view_direction)
        return 1 - (1 - transmittance) * left, emission * left


@dataclass(frozen=True, eq=False)
class VeilAbove(Above):
    """One that fills the picture by itself."""

    layer: SemiTransparentLayer

    def veil(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """See `SemiTransparentLayer`. Of what the layer changes in the light, the share that is not hidden."""
        filled, left = np.empty_like(light), self.country.sky_left(view_direction)
        passed = self.layer.veil(under, filled, view_direction, behind)
        filled -= under
        filled *= left
        np.add(under, filled, out=light)
        return [1 - (1 - part) * left[patch] for part, patch in zip(passed, behind, strict=True)]


def above(layers: Sequence[Layer], country: Hides) -> Sequence[Layer]:
    """Cloud layers, where the ground or the sea hides them."""
    return [VeilAbove(layer, country) if is_veil(layer) else Above(layer, country) for layer in layers]
