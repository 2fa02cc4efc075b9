"""Objects on a landscape's ground: the canvas they are drawn on, their feet on uneven ground, and buildings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.panorama import Cylinder, Panorama, PanoramaGrid, PanoramicLayer
from irsim.backgrounds.texture import TILE, DriftingTextures
from irsim.config.base import Name, Part, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Kelvin, KelvinDifference, KelvinSpread, Metres, NotNegative, Range, Rising
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import profile, spectral
from irsim.physics.radiometry import radiance
from irsim.rng import stream
from irsim.types import Bools, Floats

Spacing = Annotated[float, Field(ge=0.5, le=100_000)]
"""Mean distance between neighbours, m; the lower limit bounds the number of objects."""
Wall = Annotated[Metres, Plausible(1, 900, "m")]
"""Size of a building, m: from a shed to the highest tower (Burj Khalifa, 828 m)."""

FINE = 2
"""Supersampling factor of outlines, which are drawn on a finer grid and then averaged."""

FARTHEST_PX = 2.0**20
"""Corners are clipped to this distance, px, far outside any grid."""

NEAREST_PX = 0.25
"""Least distance between trees or buildings, px: denser objects would be indistinguishable and slow to draw."""

RELIEF_M = 80.0
"""Length of the largest undulations of the ground, m."""
RELIEF_BETA = 3.5
"""Spectral slope of the undulations of the ground, equal to that of the hills at the horizon."""
MOST_RELIEF = 4.0
"""Largest height of the undulations, in units of `relief_m`."""
STAGGERED = 0.35
"""Standard deviation of the height of each foot, as a share of `relief_m`: objects of a row are not equally far."""

FLOOR_M, WINDOW_M = 3.0, 2.8
"""Distances between floors and between windows, m."""

WINDOW_SHARES = (0.3, 1.3)
"""Least and greatest temperature of a window minus the wall's, in units of `windows_k`, chosen by eye: rooms are heated
or aired at different times."""


class Canvas:
    """Cover and temperature, drawn on a fine grid over a panorama grid."""

    def __init__(self, grid: PanoramaGrid) -> None:
        rows, columns = grid.shape
        self.grid = grid
        self.cover = np.zeros((rows * FINE, columns * FINE), np.uint8)
        self.kelvin = np.zeros((rows * FINE, columns * FINE), np.float32)

    def polygon(self, points: Floats, kelvin: float) -> None:
        """Draw a polygon of one temperature, whose corners are map positions (n, 2)."""
        origin = np.array([self.grid.columns[0], self.grid.rows[0]])
        within = np.clip(np.asarray(points) - origin, -FARTHEST_PX, FARTHEST_PX)
        fine = np.rint((within + 0.5) * FINE * 16 - 8).astype(np.int32)
        cv2.fillPoly(self.cover, [fine], 1, shift=4)
        cv2.fillPoly(self.kelvin, [fine], kelvin, shift=4)

    def stamp(self, foot: tuple[float, float], middle: float, hides: Bools, kelvin: Floats, coarser: int) -> None:
        """Draw a picture with the column `middle` of its last row at the map position `foot` (x, y).

        hides, kelvin: (rows, cols) mask and temperatures; each pixel is `coarser` pixels of the fine grid wide.
        """
        left = round((foot[0] - self.grid.columns[0] + 0.5) * FINE - middle * coarser)
        top = round((foot[1] - self.grid.rows[0] + 0.5) * FINE) - len(hides) * coarser
        rows, columns = (
            slice(max(begin, 0), max(min(begin + length * coarser, whole), 0))
            for begin, length, whole in zip((top, left), hides.shape, self.cover.shape, strict=True)
        )
        here = np.ix_(
            *((np.arange(span.start, span.stop) - begin) // coarser for span, begin in ((rows, top), (columns, left)))
        )
        self.cover[rows, columns][hides[here]] = 1
        self.kelvin[rows, columns][hides[here]] = kelvin[here][hides[here]]

    def layer(self, name: str, range_m: float, texture_k: Floats | float, context: SceneContext) -> PanoramicLayer:
        """Return the drawn layer; texture_k (rows, cols) is added to its temperatures, K."""
        size = self.grid.shape[::-1]
        cover: Floats = np.asarray(
            cv2.resize(self.cover.astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32
        )
        mean = cv2.resize(self.kelvin * self.cover, size, interpolation=cv2.INTER_AREA) / np.maximum(cover, 1e-6)
        kelvin = np.maximum(mean + texture_k, 1.0)
        emission = context.through(cover * radiance(context.band, kelvin), cover, range_m, 0.0)
        pictures = tuple(Panorama.on(self.grid, np.asarray(part), context.psf) for part in (1 - cover, emission))
        return PanoramicLayer(name, Cylinder(range_m), DriftingTextures(pictures))


def texture_on(grid: PanoramaGrid, beta: float, size_px: float, seed: int, *address: str) -> Floats:
    """Return a random field over a grid, (rows, cols), of mean 0 and variance 1."""
    field = spectral((TILE, TILE), beta, None, size_px, 1.0, seed, *address)
    rows, columns = (np.mod(np.arange(length), TILE) for length in grid.shape)
    return np.asarray(field[np.ix_(rows, columns)])


class Structure(Part):
    """Row of objects on the ground, all around the first camera position."""

    id: Name
    """Name for --without, and as an occluder in the ground truth."""
    range_m: Range = 800.0
    """Range, m; targets farther away are behind it."""
    relief_m: Annotated[NotNegative, Plausible(0, 50, "m", "500 m along a slope of 1 in 10 are 50 m")] = 0.0
    """Standard deviation of the ground's height along the row, m; adjacent feet differ by about a third as much. At 0
    all feet stand on one straight line."""

    def base(self, grid: PanoramaGrid, height_m: float, ifov_rad: float) -> float:
        """Return the map row of the objects' feet on level ground, seen from `height_m` above it."""
        return float(grid.horizon + np.arctan(height_m / self.range_m) / ifov_rad)

    def feet(
        self, grid: PanoramaGrid, base: float, columns: Floats, context: SceneContext, kind: str
    ) -> list[tuple[float, float]]:
        """Return the map positions (x, y) of the feet of a kind of object at map columns; `base` is their row on level
        ground."""
        rows = np.full(len(columns), base)
        if self.relief_m:
            px_per_m = 1 / (self.range_m * context.geometry.ifov_rad)
            waves = profile(len(grid.columns), RELIEF_BETA, RELIEF_M * px_per_m, context.seed, self.id, "relief")
            staggered = STAGGERED * stream(context.seed, self.id, kind, "feet").standard_normal(len(columns))
            rows = base - self.relief_m * px_per_m * (np.interp(columns, grid.columns, waves) + staggered)
        return list(zip(columns.tolist(), rows.tolist(), strict=True))


class Buildings(Structure):
    """Houses and blocks with roofs and rows of windows."""

    switches: ClassVar[Switches] = {
        "texture": ("spread_k", 0.0),
        "windows": ("windows_k", 0.0),
        "roofs": ("roof_k", 0.0),
        "relief": ("relief_m", 0.0),
    }

    id: Name = "buildings"
    """Name for --without, and as an occluder in the ground truth."""
    spacing_m: Spacing = 60.0
    """Mean distance between two buildings, m."""
    width_m: Annotated[tuple[Wall, Wall], Field(strict=False), Rising] = (10.0, 30.0)
    """[least, greatest] width, m."""
    height_m: Annotated[tuple[Wall, Wall], Field(strict=False), Rising] = (5.0, 14.0)
    """[least, greatest] height of the walls, m."""
    temperature_k: Kelvin | None = None
    """Mean temperature of the walls, K; by default that of the landscape's `hour`, or 290 with `any`."""
    spread_k: KelvinSpread = 2.0
    """Standard deviation of temperature between buildings, K."""
    windows_k: KelvinDifference = 3.0
    """Temperature of the windows minus the wall's, K. For each window it is multiplied by a random factor of 0.3 to
    1.3."""
    roof_k: KelvinDifference = -4.0
    """Temperature of the roof minus the wall's, K."""

    def paint(self, grid: PanoramaGrid, height_m: float, temperature_k: float, context: SceneContext) -> PanoramicLayer:
        """Return the buildings, seen from `height_m` above the ground."""
        ifov, draw = context.geometry.ifov_rad, stream(context.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base = self.base(grid, height_m, ifov)
        rises = MOST_RELIEF * self.relief_m
        grid = grid.between(base - (self.height_m[1] + 4 + rises) * px_per_m, base + rises * px_per_m)
        canvas = Canvas(grid)
        first, last = float(grid.columns[0]), float(grid.columns[-1])
        count = max(1, round((last - first) / max(self.spacing_m * px_per_m, NEAREST_PX)))
        drawn = [(float(draw.uniform(first, last)), list(self._outlines(temperature_k, draw))) for _ in range(count)]
        feet = self.feet(grid, base, np.array([x for x, _ in drawn]), context, "buildings")
        # The nearest, whose feet are the lowest, cover the others.
        for foot, (_, outlines) in sorted(zip(feet, drawn, strict=True), key=lambda each: each[0][1]):
            for corners, kelvin in outlines:
                canvas.polygon(np.array(foot) + corners * [px_per_m, -px_per_m], kelvin)
        texture = texture_on(grid, 2.4, 20.0, context.seed, self.id, "grain")
        return canvas.layer(self.id, self.range_m, 0.15 * self.spread_k * texture, context)

    def windows(self, context: SceneContext) -> float:
        """Return the approximate number of windows, which take nearly all the drawing time."""
        px_per_m = 1 / (self.range_m * context.geometry.ifov_rad)
        count = len(PanoramaGrid.of(context.geometry).columns) / max(self.spacing_m * px_per_m, NEAREST_PX)
        across, up = (float(np.mean(ends)) for ends in (self.width_m, self.height_m))
        return count * (across / WINDOW_M) * (up / FLOOR_M)

    def _outlines(self, kelvin: float, draw: np.random.Generator) -> Iterator[tuple[Floats, float]]:
        """Yield polygons (n, 2) of a building, m right of its centre and above its foot, and temperatures, K, from back
        to front."""
        width, height = (float(draw.uniform(*ends)) for ends in (self.width_m, self.height_m))
        wall, half = kelvin + self.spread_k * float(draw.standard_normal()), width / 2
        if draw.random() < 0.5:
            yield _box(-half, 0, half, height + 0.6), wall + self.roof_k
        else:
            ridge = [[-half - 0.5, height], [half + 0.5, height], [half * 0.7, height + 3], [-half * 0.7, height + 3]]
            yield np.array(ridge), wall + self.roof_k
        yield _box(-half, 0, half, height), wall
        for floor in np.arange(1.0, height - 1.7, FLOOR_M):
            for left in np.arange(-half + 1.0, half - 1.7, WINDOW_M):
                pane = _box(left, floor, left + 1.3, floor + 1.5)
                yield pane, wall + self.windows_k * float(draw.uniform(*WINDOW_SHARES))


def _box(left: float, low: float, right: float, high: float) -> Floats:
    """Return the corners of a rectangle, (4, 2)."""
    return np.array([[left, low], [right, low], [right, high], [left, high]])
