"""Open country under a sky: ground up to the horizon, with ground cover, trees and buildings at their ranges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import cv2
import numpy as np

from irsim.backgrounds.air import ground_path
from irsim.backgrounds.base import FARTHEST, ClearLayer, GroundRadiance, Layer, Names, Surfaces, ViewDirection
from irsim.backgrounds.clutter import Clutter
from irsim.backgrounds.ground_cover import COVER_KEYS, Fields, Hour, Roads, Water, by_hour, leaves_k, typical
from irsim.backgrounds.ground_texture import VANISHING_PX, perspective_cover, perspective_texture
from irsim.backgrounds.layers import masked_clouds
from irsim.backgrounds.panorama import Cylinder, Panorama, PanoramaGrid
from irsim.backgrounds.sky import Sky
from irsim.backgrounds.structures import Buildings
from irsim.backgrounds.texture import TILE, DriftingTextures
from irsim.backgrounds.trees import TALLEST, TREE_M, TYPICAL_MRAD, Trees, distant_woods
from irsim.config.base import Several, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Feature, Height, Kelvin, KelvinSpread, NotNegative
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, profile, spectral
from irsim.physics.radiometry import radiance
from irsim.types import Floats

FINER = 5.0
"""Ratio of the texels of the ground's texture to those of a second, finer one, which is added on near ground."""


@dataclass(frozen=True, eq=False)
class PlaneLayer:
    """Panorama of the ground plane, with the parallax of each pixel's distance."""

    name: str
    textures: DriftingTextures
    camera_height_m: float
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        if not any(view_direction.place):
            transmittance, emission = self.textures.sample(view_direction)
            return transmittance, emission
        columns, rows = self._places(view_direction)
        transmittance, emission = (tile.at(columns, rows) for tile in self.textures.tiles)
        return transmittance, emission

    def _places(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        """Return column and row of the ground point at each pixel, in the panorama painted from the first camera
        position."""
        chart, (x, y, z) = view_direction.chart, view_direction.place
        geometry, height = chart.geometry, self.camera_height_m
        unit, squeeze = geometry.ifov_rad, np.cos(geometry.elevation_rad)
        azimuth = chart.at_pixels(chart.u) * unit / squeeze
        down = chart.at_pixels(chart.v) * unit - geometry.elevation_rad  # angle below the horizon
        distance = max(height - y, 0.1) / np.tan(np.maximum(down, 1e-6))
        right, ahead = x + distance * np.sin(azimuth), z + distance * np.cos(azimuth)
        first = np.arctan2(height, np.hypot(right, ahead))
        picture = self.textures.tiles[0]
        assert isinstance(picture, Panorama)
        on_ground = down > 0
        u = np.where(on_ground, np.arctan2(right, ahead), azimuth) * squeeze / unit
        v = (np.where(on_ground, first, down) + geometry.elevation_rad) / unit
        rows = np.clip(v - picture.top, 0, picture.padded.shape[0] - 1)
        return (u - picture.left).astype(np.float32), rows.astype(np.float32)


class TerrainLayer:
    """Opaque layer: the clear sky, and the ground in front of it."""

    name = "country"
    range_m = FARTHEST

    def __init__(self, sky: Layer, ground: PlaneLayer) -> None:
        self._sky, self._ground = sky, ground
        self._last: tuple[ViewDirection, Floats] | None = None

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        transmittance, emission = self._ground.light(view_direction)
        self._last = view_direction, transmittance
        return None, cv2.multiply(self._sky.light(view_direction)[1], transmittance) + emission

    def sky_share(self, view_direction: ViewDirection) -> Floats:
        """Return the share of each pixel that is sky, (rows, cols)."""
        last = self._last  # read once: another thread may replace it
        if last is None or last[0] is not view_direction:
            last = self._last = view_direction, self._ground.light(view_direction)[0]
        return last[1]


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
    """Mean height of the woods along the horizon, mrad, at the temperature of the first row of `trees`. Default: 1.5
    with `trees`, else 0."""
    hour: Hour = "any"
    """Time of day that sets default temperatures, `day` or `night`; with `any`, each temperature has its own
    default."""
    fields: Fields | None = None
    roads: Roads | None = None
    """Roads that narrow towards the horizon, where their width is `width_mrad`: w metres seen from h metres above the
    ground are 40 ifov_mrad w / h wide there."""
    water: Water | None = None
    """Ponds and lakes on level ground; `size_mrad` holds at the horizon, and nearer ones appear larger."""
    clutter: Clutter | None = None
    trees: Several[Trees] = ()
    """Rows of trees."""
    buildings: Several[Buildings] = ()
    """Rows of buildings."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the given keys, the temperatures that follow from the hour, and distant woods if there are trees."""
        behind_trees = {"far_woods_mrad": TYPICAL_MRAD} if given.get("trees") else {}
        return behind_trees | by_hour(given, {"ground_k": "ground", "spread_k": "spread"})

    @property
    def surface_m(self) -> float:
        return self.camera_height_m

    @property
    def leaves_k(self) -> float | None:
        return leaves_k(self.hour)

    def _ground_light(self, sky: ClearLayer, context: SceneContext) -> float:
        return float(radiance(context.band, self.ground_k))

    @property
    def bare(self) -> Landscape:
        nothing: dict[str, Any] = dict.fromkeys(COVER_KEYS) | dict.fromkeys(("clouds", "trees", "buildings"), ())
        nothing["far_woods_mrad"] = 0.0
        return self.model_copy(update=nothing)

    def ground_radiance(self, context: SceneContext) -> GroundRadiance:
        terrain = self.bare.layers(context)[0]
        assert isinstance(terrain, TerrainLayer)
        return lambda view_direction: terrain.light(view_direction)[1][terrain.sky_share(view_direction) == 0]

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        sky, *clouds = super().layers(context)
        whole = PanoramaGrid.of(context.geometry)
        unit = context.geometry.ifov_rad
        high = 5 * self.hills_mrad + TALLEST * self.far_woods_mrad
        grid = whole.between(whole.horizon - high * 1e-3 / unit, np.inf)
        edge = self._edge(grid, context)
        kelvin, cover, below = self._ground(grid, edge, context)
        woods, woods_light = self._distant_woods(grid, edge, context)
        seen = cover * (1 - woods)
        ground = self._light_at_camera(grid, seen, kelvin, context) + woods_light
        terrain = TerrainLayer(sky, self._plane_layer("ground", grid, (1 - cover) * (1 - woods), ground, context))
        covers = [
            self._plane_layer(
                name, grid, 1 - seen * part, self._light_at_camera(grid, seen * part, warmth, context), context
            )
            for name, part, warmth in self._covers(grid, below, kelvin, context)
        ]
        standing = [
            part.paint(whole, self.camera_height_m, typical(part.temperature_k, self.hour, kind), context)
            for parts, kind in ((self.trees, "trees"), (self.buildings, "walls"))
            for part in parts
        ]
        return [terrain, *covers, *masked_clouds(clouds, terrain), *standing]

    def names(self) -> Names:
        for name in COVER_KEYS:
            if getattr(self, name) is not None:
                yield name, (name,)
        yield from super().names()
        for key in ("trees", "buildings"):
            for index, part in enumerate(getattr(self, key)):
                yield part.id, (key, index, "id")

    def parallax_surfaces(self) -> Surfaces:
        yield from super().parallax_surfaces()
        for key in ("trees", "buildings"):
            for index, part in enumerate(getattr(self, key)):
                yield part.id, (key, index), Cylinder(part.range_m)

    def _covers(
        self, grid: PanoramaGrid, below: Floats, kelvin: Floats, context: SceneContext
    ) -> Iterator[tuple[str, Floats | float, Floats]]:
        """Yield name, cover and temperature of each ground cover, the lowest first; `kelvin`: the ground's, (rows,
        cols)."""
        unit = context.geometry.ifov_rad
        px_per_mrad = 1e-3 / unit
        if self.fields is not None:
            spread = typical(self.fields.spread_k, self.hour, "fields")
            painted = self.fields.paint((TILE, TILE), px_per_mrad, spread, context.seed)[1]
            yield "fields", 1.0, perspective_texture(painted, grid, below, 1.0, unit) + (kelvin + self.ground_k) / 2
        for name, cover in (("water", self.water), ("roads", self.roads)):
            if cover is not None:
                inside = cover.inside((TILE, TILE), px_per_mrad, context.seed).astype(np.float32)
                warmth = self.ground_k + typical(cover.contrast_k, self.hour, name)
                yield name, perspective_cover(inside, grid, below, unit), np.full_like(kelvin, warmth)
        if self.clutter is not None:
            spots, offset = self.clutter.paint_perspective(below, px_per_mrad, context.seed)
            yield "clutter", spots, self.ground_k + offset

    def _edge(self, grid: PanoramaGrid, context: SceneContext) -> Floats:
        """Return the map rows at which the ground ends, (cols,)."""
        px_per_mrad = 1e-3 / context.geometry.ifov_rad
        hills = profile(len(grid.columns), 3.5, 4 * self.correlation_mrad * px_per_mrad, context.seed, "hills")
        return np.asarray(grid.horizon - self.hills_mrad * px_per_mrad * hills)

    def _ground(self, grid: PanoramaGrid, edge: Floats, context: SceneContext) -> tuple[Floats, Floats, Floats]:
        """Return temperature, cover and px below the edge (0 above it), (rows, cols) each."""
        unit = context.geometry.ifov_rad
        below = grid.rows[:, None] - edge
        cover = np.clip(below + 0.5, 0, 1)
        below = np.maximum(below, 0)
        if self.spread_k == 0:
            return np.full(below.shape, self.ground_k), cover, below
        size_px = self.correlation_mrad * 1e-3 / unit
        field = spectral((TILE, TILE), 3.0, self.betas, size_px, 3.0, context.seed, "ground")
        near = np.clip((below / VANISHING_PX - 1) / 4, 0, 1)
        # To continue a spectrum of slope beta, a texture finer by a factor n is weaker by n^((beta - 2) / 2).
        weaker = FINER ** (1 - np.mean(self.betas) / 2)
        kelvin = perspective_texture(field, grid, below, 1.0, unit) + near * weaker * perspective_texture(
            field, grid, below, FINER, unit
        )
        return self.ground_k + self.spread_k * kelvin, cover, below

    def _distant_woods(
        self, grid: PanoramaGrid, edge: Floats, context: SceneContext
    ) -> tuple[Floats | float, Floats | float]:
        """Return cover, and cover times radiance at the camera, (rows, cols) each, of woods along the horizon; 0
        without them.

        They lie at the range at which trees have the given apparent height, and not nearer than the rows of trees.
        """
        if self.far_woods_mrad == 0:
            return 0.0, 0.0
        high_rad = self.far_woods_mrad * 1e-3
        row = self.trees[0] if self.trees else Trees()
        trees_k = typical(row.temperature_k, self.hour, "trees")
        cover, kelvin = distant_woods(grid, edge, high_rad / context.geometry.ifov_rad, row, trees_k, context.seed)
        away_m = max(TREE_M / high_rad, *(each.range_m for each in self.trees), 0.0)
        return cover, context.through(cover * radiance(context.band, np.maximum(kelvin, 1.0)), cover, away_m, 0.0)

    def _light_at_camera(self, grid: PanoramaGrid, cover: Floats, kelvin: Floats, context: SceneContext) -> Floats:
        """Return cover times radiance of the ground at the camera, W/m2/sr, (rows, cols)."""
        light = cover * radiance(context.band, np.maximum(kelvin, 1.0))
        down = (grid.rows - grid.horizon) * context.geometry.ifov_rad
        return context.through(light, cover, *ground_path(self.camera_height_m, down[:, None]))

    def _plane_layer(
        self, name: str, grid: PanoramaGrid, transmittance: Floats, emission: Floats, context: SceneContext
    ) -> PlaneLayer:
        pictures = tuple(Panorama.on(grid, part, context.psf) for part in (transmittance, emission))
        return PlaneLayer(name, DriftingTextures(pictures), self.camera_height_m)
