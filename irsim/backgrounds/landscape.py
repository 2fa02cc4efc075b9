"""Open country under a sky: ground up to the horizon, trees and buildings at their ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np

from irsim.backgrounds.above import above
from irsim.backgrounds.air import ground_path
from irsim.backgrounds.base import ClearLayer, LandLight, Layer, Names, Shells
from irsim.backgrounds.buildings import Buildings
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.distant_trees import TALLEST, TREE_M, TYPICAL_MRAD, woods
from irsim.backgrounds.hours import Hour, by_hour, leaves_k, typical
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.panorama import Panorama, Sheet
from irsim.backgrounds.parallax import Cylinder
from irsim.backgrounds.patches import LYING, Fields, Roads, Water
from irsim.backgrounds.plane import VANISHING_PX, covered, laid
from irsim.backgrounds.sky import Sky
from irsim.backgrounds.structures import Trees
from irsim.backgrounds.terrain_layer import Country, Laid
from irsim.backgrounds.texture import TILE
from irsim.config.base import Several, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Feature, Height, Kelvin, KelvinSpread, NotNegative
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, profile, spectral
from irsim.physics.radiometry import radiance
from irsim.types import Floats

NEARER = 5.0
"""The ground's texture is drawn a second time this much finer, for what is near."""


class Landscape(Sky):
    """Country under a sky: ground to the horizon, rows of trees and buildings at their ranges."""

    switches: ClassVar[Switches] = {
        "texture": ("spread_k", 0.0),
        "hills": ("hills_mrad", 0.0),
        "far_woods": ("far_woods_mrad", 0.0),
    }

    camera_height_m: Height = 10.0
    """Height of the camera above the ground, m."""
    ground_k: Kelvin = 290.0
    """Mean temperature of the ground, K."""
    spread_k: KelvinSpread = 2.0
    """Standard deviation of the ground's temperature, K."""
    betas: Betas = (2.9, 4.0)
    """Slopes of the ground's spectrum along x and along y (real horizon and field: [2.9, 4.0])."""
    correlation_mrad: Feature = 30.0
    """Size of the largest features of the ground at the horizon, mrad; nearer ones are larger."""
    hills_mrad: Annotated[NotNegative, Plausible(0, 100, "mrad", "mountains of 3 km, 30 km away, are 100")] = 0.5
    """Standard deviation of the horizon's elevation, mrad."""
    far_woods_mrad: Annotated[NotNegative, Plausible(0, 30, "mrad", "trees of 30 m, 1 km away, are 30")] = 0.0
    """Mean height of the woods along the horizon, which are as warm as the first row of `trees`, mrad; 1.5 where not
    given and there are such rows: between their trees a bare horizon is a ruled line."""
    hour: Hour = "any"
    """day or night: temperatures that are not given are typical of it."""
    fields: Fields | None = None
    roads: Roads | None = None
    """Roads that narrow towards the horizon, where they have their width: one of w metres, seen from h metres up, has
    40 ifov_mrad w / h there."""
    water: Water | None = None
    """Ponds and lakes that lie flat; their size is that at the horizon, nearer ones are larger."""
    clutter: Clutter | None = None
    trees: Several[Trees] = ()
    """Rows of trees."""
    buildings: Several[Buildings] = ()
    """Rows of buildings."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Its temperature by the hour, and far woods behind trees."""
        behind_trees = {"far_woods_mrad": TYPICAL_MRAD} if given.get("trees") else {}
        return behind_trees | by_hour(given, {"ground_k": "ground", "spread_k": "spread"})

    @property
    def surface_m(self) -> float:
        return self.camera_height_m

    @property
    def leaves_k(self) -> float | None:
        return leaves_k(self.hour)

    def _below(self, sky: ClearLayer, context: SceneContext) -> float:
        return float(radiance(context.band, self.ground_k))

    @property
    def bare(self) -> Landscape:
        nothing: dict[str, Any] = dict.fromkeys(LYING) | dict.fromkeys(("clouds", "trees", "buildings"), ())
        nothing["far_woods_mrad"] = 0.0
        return self.model_copy(update=nothing)

    def land(self, context: SceneContext) -> LandLight:
        country = self.bare.layers(context)[0]
        assert isinstance(country, Country)
        return lambda view_direction: country.light(view_direction)[1][country.sky_left(view_direction) == 0]

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        sky, *clouds = super().layers(context)
        whole = Sheet.of(context.geometry)
        unit = context.geometry.ifov_rad
        high = 5 * self.hills_mrad + TALLEST * self.far_woods_mrad
        sheet = whole.between(whole.horizon - high * 1e-3 / unit, np.inf)
        edge = self._edge(sheet, context)
        kelvin, cover, below = self._ground(sheet, edge, context)
        far, glow = self._far_woods(sheet, edge, context)
        seen = cover * (1 - far)
        ground = self._through(sheet, seen, kelvin, context) + glow
        country = Country(sky, self._laid("ground", sheet, (1 - cover) * (1 - far), ground, context))
        lying = [
            self._laid(name, sheet, 1 - seen * part, self._through(sheet, seen * part, warmth, context), context)
            for name, part, warmth in self._lying(sheet, below, kelvin, context)
        ]
        standing = [
            part.paint(whole, self.camera_height_m, typical(part.temperature_k, self.hour, what), context)
            for parts, what in ((self.trees, "trees"), (self.buildings, "walls"))
            for part in parts
        ]
        return [country, *lying, *above(clouds, country), *standing]

    def names(self) -> Names:
        for name in LYING:
            if getattr(self, name) is not None:
                yield name, (name,)
        yield from super().names()
        for key in ("trees", "buildings"):
            for index, part in enumerate(getattr(self, key)):
                yield part.id, (key, index, "id")

    def shells(self) -> Shells:
        yield from super().shells()
        for key in ("trees", "buildings"):
            for index, part in enumerate(getattr(self, key)):
                yield part.id, (key, index), Cylinder(part.range_m)

    def _lying(
        self, sheet: Sheet, below: Floats, kelvin: Floats, context: SceneContext
    ) -> Iterator[tuple[str, Floats | float, Floats]]:
        """Name, cover and temperature of all that lies on ground of temperatures (rows, cols), the lowest first."""
        unit = context.geometry.ifov_rad
        px_per_mrad = 1e-3 / unit
        if self.fields is not None:
            spread = typical(self.fields.spread_k, self.hour, "fields")
            painted = self.fields.paint((TILE, TILE), px_per_mrad, spread, context.seed)[1]
            yield "fields", 1.0, laid(painted, sheet, below, 1.0, unit) + (kelvin + self.ground_k) / 2
        for name, even in (("water", self.water), ("roads", self.roads)):
            if even is not None:
                inside = even.inside((TILE, TILE), px_per_mrad, context.seed).astype(np.float32)
                warmth = self.ground_k + typical(even.contrast_k, self.hour, name)
                yield name, covered(inside, sheet, below, unit), np.full_like(kelvin, warmth)
        if self.clutter is not None:
            spots, offset = self.clutter.stand(below, px_per_mrad, context.seed)
            yield "clutter", spots, self.ground_k + offset

    def _edge(self, sheet: Sheet, context: SceneContext) -> Floats:
        """(cols,): the rows of the map where the ground ends."""
        px_per_mrad = 1e-3 / context.geometry.ifov_rad
        hills = profile(len(sheet.columns), 3.5, 4 * self.correlation_mrad * px_per_mrad, context.seed, "hills")
        return np.asarray(sheet.horizon - self.hills_mrad * px_per_mrad * hills)

    def _ground(self, sheet: Sheet, edge: Floats, context: SceneContext) -> tuple[Floats, Floats, Floats]:
        """Temperature, cover and px below its edge (0 above it), each (rows, cols) of the sheet."""
        unit = context.geometry.ifov_rad
        below = sheet.rows[:, None] - edge
        cover = np.clip(below + 0.5, 0, 1)
        below = np.maximum(below, 0)
        if self.spread_k == 0:  # no texture is drawn that would not show
            return np.full(below.shape, self.ground_k), cover, below
        size_px = self.correlation_mrad * 1e-3 / unit
        field = spectral((TILE, TILE), 3.0, self.betas, size_px, 3.0, context.seed, "ground")
        near = np.clip((below / VANISHING_PX - 1) / 4, 0, 1)
        # Finer by a factor n, a texture of slope beta is weaker by n^-(beta-2)/2.
        weaker = NEARER ** (1 - np.mean(self.betas) / 2)
        kelvin = laid(field, sheet, below, 1.0, unit) + near * weaker * laid(field, sheet, below, NEARER, unit)
        return self.ground_k + self.spread_k * kelvin, cover, below

    def _far_woods(self, sheet: Sheet, edge: Floats, context: SceneContext) -> tuple[Floats | float, Floats | float]:
        """What woods along the horizon cover, and their light as it arrives from where trees look as high as they do,
        no nearer than the rows of trees, (rows, cols) each; 0 where there are none."""
        if self.far_woods_mrad == 0:
            return 0.0, 0.0
        high_rad = self.far_woods_mrad * 1e-3
        row = self.trees[0] if self.trees else Trees()
        trees_k = typical(row.temperature_k, self.hour, "trees")
        cover, kelvin = woods(sheet, edge, high_rad / context.geometry.ifov_rad, row, trees_k, context.seed)
        away_m = max(TREE_M / high_rad, *(each.range_m for each in self.trees), 0.0)
        return cover, context.through(cover * radiance(context.band, np.maximum(kelvin, 1.0)), cover, away_m, 0.0)

    def _through(self, sheet: Sheet, cover: Floats, kelvin: Floats, context: SceneContext) -> Floats:
        """The light of what lies on the ground, (rows, cols), as it arrives."""
        light = cover * radiance(context.band, np.maximum(kelvin, 1.0))
        down = (sheet.rows - sheet.horizon) * context.geometry.ifov_rad
        return context.through(light, cover, *ground_path(self.camera_height_m, down[:, None]))

    def _laid(self, name: str, sheet: Sheet, left: Floats, emission: Floats, context: SceneContext) -> Laid:
        """left, emission  (rows, cols): what it leaves of the light behind it, and its own as it arrives"""
        pictures = tuple(Panorama.on(sheet, part, context.psf) for part in (left, emission))
        return Laid(name, Painting(pictures), self.camera_height_m)
