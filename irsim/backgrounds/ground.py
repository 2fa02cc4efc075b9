"""Ground seen from above: a temperature field, in angle or on a plane below the camera, and ground cover."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from irsim.backgrounds.air import attenuated_ground
from irsim.backgrounds.base import FARTHEST, Background, GroundRadiance, Layer, Names, ViewDirection
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.ground_cover import (
    COVER_KEYS,
    Fields,
    Hour,
    Painted,
    Roads,
    Water,
    by_hour,
    leaves_k,
    typical,
)
from irsim.backgrounds.ground_texture import GroundPlane, GroundTexture
from irsim.backgrounds.texture import DriftingTextures, PeriodicTexture, TextureSampler, tile_shape
from irsim.config.base import Switches
from irsim.config.quantities import Feature, Height, Kelvin, KelvinSpread
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, Histogram, spectral, with_histogram
from irsim.physics.radiometry import radiance
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class GroundLayer:
    """Opaque layer of the ground."""

    textures: TextureSampler
    name: str = "ground"
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, self.textures.sample(view_direction)[0]


@dataclass(frozen=True, eq=False)
class CoverLayer:
    """Layer of ground cover: transmittance (1 - cover) and emission."""

    name: str
    textures: TextureSampler
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        transmittance, emission = self.textures.sample(view_direction)
        return transmittance, emission


class Ground(Background):
    """Terrain whose temperature varies about a mean; with `spread_k: 0` and no cover it is uniform."""

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"betas": ("beta",)}
    switches: ClassVar[Switches] = {"texture": ("spread_k", 0.0)}
    endless: ClassVar[bool] = True

    mean_k: Kelvin = 290.0
    """Mean temperature, K."""
    spread_k: KelvinSpread = 3.0
    """Standard deviation of temperature, K."""
    beta: Annotated[float, Field(ge=0, le=6)] = 2.6
    """Slope of the 2-D power spectrum f^-beta (real ground: 2.2 to 3)."""
    correlation_mrad: Feature = 20.0
    """Size of the largest features, mrad."""
    stretch: Annotated[float, Field(ge=0.1, le=10)] = 1.5
    """Ratio of width to height of features."""
    betas: Betas | None = None
    """Slopes along x and along y if they differ; replaces `beta`."""
    histogram: Histogram = ()
    """Temperatures at evenly spaced quantiles of the ground, least to greatest, in any unit; Gaussian if empty."""
    height_m: Height | None = None
    """Height of the camera above the ground, m. The ground is then a plane in perspective with parallax, and sizes in
    mrad hold where the first pointing meets it. Default: infinitely far ground of uniform scale."""
    hour: Hour = "any"
    """Time of day that sets default temperatures, `day` or `night`; with `any`, each temperature has its own
    default."""
    fields: Fields | None = None
    roads: Roads | None = None
    water: Water | None = None
    clutter: Clutter | None = None

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the given keys and the temperatures that follow from the hour."""
        return by_hour(given, {"mean_k": "ground", "spread_k": "spread"})

    @property
    def has_poles(self) -> bool:
        return self.height_m is None

    @property
    def surface_m(self) -> float | None:
        return self.height_m

    @property
    def leaves_k(self) -> float | None:
        return leaves_k(self.hour)

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        field = self._texture(context)
        kelvin = np.maximum(self.mean_k + self.spread_k * field, 1.0)
        light = radiance(context.band, kelvin).astype(np.float32)
        ground = GroundLayer(self._on_ground((light,), context))
        # Fields have half of the ground's texture; roads and water are smooth.
        texture_k = {"fields": 0.5 * self.spread_k * field}
        layers: list[Layer] = [
            ground,
            *(
                self._cover_layer(name, cover, kelvin + texture_k.get(name, 0.0), context)
                for name, cover, kelvin in self._covers(context)
            ),
        ]
        return attenuated_ground(layers, context, self.height_m)

    def ambient(self, context: SceneContext) -> float:
        """Return the radiance of the ground's mean temperature, since this background has no sky to reflect."""
        return float(radiance(context.band, self.mean_k))

    @property
    def bare(self) -> Ground:
        return self.model_copy(update=dict.fromkeys(COVER_KEYS))

    def ground_radiance(self, context: SceneContext) -> GroundRadiance:
        ground = self.bare.layers(context)[0]
        return lambda view_direction: ground.light(view_direction)[1].ravel()

    def names(self) -> Names:
        for name in COVER_KEYS:
            if getattr(self, name) is not None:
                yield name, (name,)

    def _texture(self, context: SceneContext) -> Floats:
        """Return the temperature field, (rows, cols) float32 of mean 0 and variance 1; zeros if `spread_k` is 0."""
        geometry = context.geometry
        shape = tile_shape(geometry.size)
        if self.spread_k == 0:
            return np.zeros(shape, np.float32)
        size_px = self.correlation_mrad * 1e-3 / geometry.ifov_rad
        field = spectral(shape, self.beta, self.betas, size_px, self.stretch, context.seed, "ground")
        return with_histogram(field, self.histogram)

    def _covers(self, context: SceneContext) -> list[tuple[str, Floats, Floats]]:
        """Return name, cover and temperature minus the ground's of all ground cover, the lowest first."""
        shape, px_per_mrad = tile_shape(context.geometry.size), 1e-3 / context.geometry.ifov_rad
        found: list[tuple[str, Painted]] = []
        if self.fields is not None:
            spread = typical(self.fields.spread_k, self.hour, "fields")
            found.append(("fields", self.fields.paint(shape, px_per_mrad, spread, context.seed)))
        for name, cover in (("water", self.water), ("roads", self.roads)):
            if cover is not None:
                contrast = typical(cover.contrast_k, self.hour, name)
                found.append((name, cover.paint(shape, px_per_mrad, contrast, context.seed)))
        if self.clutter is not None:
            found.append(("clutter", self.clutter.paint(shape, px_per_mrad, context.seed)))
        return [(name, *painted) for name, painted in found]

    def _cover_layer(self, name: str, cover: Floats, offset_k: Floats, context: SceneContext) -> CoverLayer:
        emission = cover * radiance(context.band, np.maximum(self.mean_k + offset_k, 1.0))
        return CoverLayer(name, self._on_ground((1 - cover, emission), context))

    def _on_ground(self, textures: tuple[Floats, ...], context: SceneContext) -> TextureSampler:
        """Return the sampler of periodic textures, (rows, cols), in angle or on the ground plane."""
        geometry = context.geometry
        if self.height_m is None:
            return DriftingTextures(
                tuple(PeriodicTexture.of(texture, geometry.size, context.psf) for texture in textures)
            )
        rows, columns = textures[0].shape
        return GroundTexture(GroundPlane(geometry, self.height_m, (rows, columns)), textures, context)
