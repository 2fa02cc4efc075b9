"""Layers that modify others: clouds cut off by the horizon, motion blur, and crops to a region of the frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from irsim.backgrounds.air import AttenuatedClouds
from irsim.backgrounds.base import (
    Layer,
    LayerWrapper,
    SemiTransparentLayer,
    ViewDirection,
    blend_over,
    is_semi_transparent,
    opaque_error,
)
from irsim.backgrounds.cloud_drift import EvolvingCloud
from irsim.types import Floats, Slices


class SkyMask(Protocol):
    """Ground or sea that covers the lower part of the sky."""

    def sky_share(self, view_direction: ViewDirection) -> Floats:
        """Return the share of each pixel that is sky, (rows, cols)."""
        ...


@dataclass(frozen=True, eq=False)
class MaskedClouds(LayerWrapper):
    """Cloud layer that ends at the ground or the sea."""

    mask: SkyMask

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        transmittance, emission = self.layer.light(view_direction)
        assert transmittance is not None
        share = self.mask.sky_share(view_direction)
        return 1 - (1 - transmittance) * share, emission * share


@dataclass(frozen=True, eq=False)
class BlendedMaskedClouds(MaskedClouds):
    """`MaskedClouds` of a layer with a `blend` of its own."""

    layer: SemiTransparentLayer

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Blend as in `SemiTransparentLayer.blend`, weighting the change of the light by the share of sky."""
        filled, share = np.empty_like(light), self.mask.sky_share(view_direction)
        patches = self.layer.blend(under, filled, view_direction, behind)
        filled -= under
        filled *= share
        np.add(under, filled, out=light)
        return [1 - (1 - part) * share[patch] for part, patch in zip(patches, behind, strict=True)]


def masked_clouds(layers: Sequence[Layer], mask: SkyMask) -> Sequence[Layer]:
    """Return cloud layers that end at the ground or the sea."""
    return [
        BlendedMaskedClouds(layer, mask) if is_semi_transparent(layer) else MaskedClouds(layer, mask)
        for layer in layers
    ]


@dataclass(frozen=True, eq=False)
class MotionBlurredLayer(LayerWrapper):
    """Mean of a layer over several views of one exposure, evenly spaced in time."""

    views: tuple[ViewDirection, ...]

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        transmittance, emission, _ = self.parts([])
        return transmittance, emission

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Blend as in `SemiTransparentLayer.blend`; the transmittance in a slice is (n, rows, columns), one for each
        view."""
        transmittance, emission, patches = self.parts(behind)
        if transmittance is None:
            raise opaque_error(self.name)
        blend_over(under, light, transmittance, emission, ())
        return patches

    def parts(self, behind: Sequence[Slices]) -> tuple[Floats | None, Floats, list[Floats]]:
        """Return mean transmittance, mean emission, and the transmittance in the slices `behind` at each view."""
        weight = np.float32(1 / len(self.views))
        transmittance: Floats | None = None
        emission: Floats | None = None
        patches: list[list[Floats]] = [[] for _ in behind]
        for each in self.views:
            through, own = self.layer.light(each)
            emission = own * weight if emission is None else emission + own * weight
            if through is not None:
                transmittance = through * weight if transmittance is None else transmittance + through * weight
                for kept, patch in zip(patches, behind, strict=True):
                    kept.append(through[patch].copy())
        assert emission is not None
        return transmittance, emission, [np.stack(kept) for kept in patches if kept]


@dataclass(frozen=True, eq=False)
class CroppedLayer(LayerWrapper):
    """Region of a layer in one frame.

    transmittance, emission: (rows, columns) of the region. patch_transmittance: (rows, columns), or (n, rows, columns)
    at n instants of an exposure.
    """

    transmittance: Floats | None
    emission: Floats
    patch_transmittance: Floats | None

    @classmethod
    def of(cls, layer: Layer, view_direction: ViewDirection, region: Slices) -> CroppedLayer:
        if isinstance(layer, MotionBlurredLayer):
            through, emission, patches = layer.parts([region])
        else:
            (through, emission), patches = layer.light(view_direction), []
        within = None if through is None else through[region].copy()
        return cls(layer, within, emission[region].copy(), patches[0] if patches else within)

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        return self.transmittance, self.emission

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Blend as in `SemiTransparentLayer.blend`."""
        if self.transmittance is None or self.patch_transmittance is None:
            raise opaque_error(self.name)
        blend_over(under, light, self.transmittance, self.emission, ())
        return [self.patch_transmittance[(..., *patch)] for patch in behind]


@dataclass(frozen=True, eq=False)
class _CroppedMask:
    """Region of a sky mask in one frame."""

    share: Floats

    def sky_share(self, view_direction: ViewDirection) -> Floats:
        return self.share


def crop(layer: Layer, view_direction: ViewDirection, region: Slices) -> Layer | None:
    """Return a layer cropped to a region (rows, columns) of one frame; None if it has its own, unknown `blend`.

    On float64 light its result is that of the full frame to the last bit.
    """
    if isinstance(layer, BlendedMaskedClouds):
        within = crop(layer.layer, view_direction, region)
        mask = _CroppedMask(layer.mask.sky_share(view_direction)[region].copy())
        return BlendedMaskedClouds(within, mask) if isinstance(within, CroppedLayer) else None
    known = isinstance(layer, EvolvingCloud | AttenuatedClouds | MotionBlurredLayer)
    return CroppedLayer.of(layer, view_direction, region) if known or not is_semi_transparent(layer) else None
