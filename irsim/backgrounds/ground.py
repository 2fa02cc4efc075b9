"""Ground seen from above: a temperature field, in angle or on a plane of a height, and what lies on it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from irsim.backgrounds.air import through_air
from irsim.backgrounds.base import FARTHEST, Background, LandLight, Layer, Names, ViewDirection
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.ground_texture import Carpet, Level
from irsim.backgrounds.hours import Hour, by_hour, leaves_k, typical
from irsim.backgrounds.painting import Painting, Seen
from irsim.backgrounds.patches import LYING, Fields, Painted, Roads, Water
from irsim.backgrounds.texture import Tile, tile_shape
from irsim.config.base import Switches
from irsim.config.quantities import Feature, Height, Kelvin, KelvinSpread
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, Histogram, shaped, spectral
from irsim.physics.radiometry import radiance
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Terrain:
    """The opaque layer of the ground."""

    painting: Seen
    name: str = "ground"
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, self.painting.seen(view_direction)[0]


@dataclass(frozen=True, eq=False)
class Patches:
    """What lies on the ground: its transmittance (1 less its cover) and its emission."""

    name: str
    painting: Seen
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        transmittance, emission = self.painting.seen(view_direction)
        return transmittance, emission


class Ground(Background):
    """Terrain whose temperature varies about a mean; with `spread_k: 0` and nothing on it it is flat."""

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
    """How much wider than high features are."""
    betas: Betas | None = None
    """Slopes along x and along y, where they differ; in place of `beta`."""
    histogram: Histogram = ()
    """Temperatures at evenly spaced shares of the ground, least to greatest, in any unit; Gaussian where empty."""
    height_m: Height | None = None
    """Height of the camera above the ground, m: it is seen in perspective, passes by as the camera is carried, and
    sizes in mrad are those where the first pointing meets it. Without it the ground is far off, of one scale all over,
    and stays."""
    hour: Hour = "any"
    """day or night: temperatures that are not given are typical of it."""
    fields: Fields | None = None
    roads: Roads | None = None
    water: Water | None = None
    clutter: Clutter | None = None

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Its temperature by the hour."""
        return by_hour(given, {"mean_k": "ground", "spread_k": "spread"})

    @property
    def folds(self) -> bool:
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
        terrain = Terrain(self._lain((light,), context))
        # Fields are made of the ground that they lie on, roads and water are smooth.
        rough = {"fields": 0.5 * self.spread_k * field}
        layers: list[Layer] = [
            terrain,
            *(
                self._patches(name, cover, kelvin + rough.get(name, 0.0), context)
                for name, cover, kelvin in self._on(context)
            ),
        ]
        return through_air(layers, context, self.height_m)

    def ambient(self, context: SceneContext) -> float:
        """It has no sky: all around is as warm as it is in the mean."""
        return float(radiance(context.band, self.mean_k))

    @property
    def bare(self) -> Ground:
        return self.model_copy(update=dict.fromkeys(LYING))

    def land(self, context: SceneContext) -> LandLight:
        terrain = self.bare.layers(context)[0]
        return lambda view_direction: terrain.light(view_direction)[1].ravel()

    def names(self) -> Names:
        for name in LYING:
            if getattr(self, name) is not None:
                yield name, (name,)

    def _texture(self, context: SceneContext) -> Floats:
        """(rows, cols) float32 of mean 0 and variance 1; nothing where none of it would show."""
        geometry = context.geometry
        shape = tile_shape(geometry.size)
        if self.spread_k == 0:
            return np.zeros(shape, np.float32)
        size_px = self.correlation_mrad * 1e-3 / geometry.ifov_rad
        field = spectral(shape, self.beta, self.betas, size_px, self.stretch, context.seed, "ground")
        return shaped(field, self.histogram)

    def _on(self, context: SceneContext) -> list[tuple[str, Floats, Floats]]:
        """Name, cover and temperature less the ground's of all that lies on it, the lowest first."""
        shape, px_per_mrad = tile_shape(context.geometry.size), 1e-3 / context.geometry.ifov_rad
        found: list[tuple[str, Painted]] = []
        if self.fields is not None:
            spread = typical(self.fields.spread_k, self.hour, "fields")
            found.append(("fields", self.fields.paint(shape, px_per_mrad, spread, context.seed)))
        for name, even in (("water", self.water), ("roads", self.roads)):
            if even is not None:
                contrast = typical(even.contrast_k, self.hour, name)
                found.append((name, even.paint(shape, px_per_mrad, contrast, context.seed)))
        if self.clutter is not None:
            found.append(("clutter", self.clutter.paint(shape, px_per_mrad, context.seed)))
        return [(name, *painted) for name, painted in found]

    def _patches(self, name: str, cover: Floats, offset_k: Floats, context: SceneContext) -> Patches:
        emission = cover * radiance(context.band, np.maximum(self.mean_k + offset_k, 1.0))
        return Patches(name, self._lain((1 - cover, emission), context))

    def _lain(self, textures: tuple[Floats, ...], context: SceneContext) -> Seen:
        """Periodic textures, (rows, cols), as they lie on the ground."""
        geometry = context.geometry
        if self.height_m is None:
            return Painting(tuple(Tile.of(texture, geometry.size, context.psf) for texture in textures))
        rows, columns = textures[0].shape
        return Carpet(Level(geometry, self.height_m, (rows, columns)), textures, context)
