"""Layers of one frame, of which a region is wanted: the same to the last bit, without the rest of the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irsim.backgrounds.above import VeilAbove
from irsim.backgrounds.air import DriftingThroughAir
from irsim.backgrounds.base import Changed, Layer, ViewDirection, is_veil, opaque, veiled
from irsim.backgrounds.drifting import Drifting
from irsim.backgrounds.swept import Swept
from irsim.types import Floats, Slices


@dataclass(frozen=True, eq=False)
class Cut(Changed):
    """A layer in a region of one frame, which is the only one it is asked for.

    passed  its transmittance (rows, columns), or (n, rows, columns) at the instants of an exposure
    """

    through: Floats | None
    emission: Floats
    passed: Floats | None

    @classmethod
    def of(cls, layer: Layer, view_direction: ViewDirection, region: Slices) -> Cut:
        if isinstance(layer, Swept):
            through, emission, patches = layer.parts([region])
        else:
            (through, emission), patches = layer.light(view_direction), []
        within = None if through is None else through[region].copy()
        return cls(layer, within, emission[region].copy(), patches[0] if patches else within)

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        return self.through, self.emission

    def veil(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """See `SemiTransparentLayer`."""
        if self.through is None or self.passed is None:
            raise opaque(self.name)
        veiled(under, light, self.through, self.emission, ())
        return [self.passed[(..., *patch)] for patch in behind]


@dataclass(frozen=True, eq=False)
class _Left:
    """What a country leaves to the sky in that region."""

    share: Floats

    def sky_left(self, view_direction: ViewDirection) -> Floats:
        return self.share


def cut(layer: Layer, view_direction: ViewDirection, region: Slices) -> Layer | None:
    """What a layer does to light in float64 in a region (rows, columns) of one frame; None of a layer that fills the
    picture in a way of its own."""
    if isinstance(layer, VeilAbove):
        within = cut(layer.layer, view_direction, region)
        left = _Left(layer.country.sky_left(view_direction)[region].copy())
        return VeilAbove(within, left) if isinstance(within, Cut) else None
    by_light = not is_veil(layer) or isinstance(layer, Drifting | DriftingThroughAir | Swept)
    return Cut.of(layer, view_direction, region) if by_light else None
