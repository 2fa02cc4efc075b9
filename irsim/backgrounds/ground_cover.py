"""Ground cover: fields with lanes, roads and water; temperatures by day and by night.

Each kind has two periodic maps, (rows, columns): the covered fraction 0..1 of each pixel, and the difference of its
temperature from the ground's, K. Roads and water also have a map of the signed distance to their edge, so the edge is
sharp at any magnification.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.texture import closed
from irsim.config.base import Part, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Feature, KelvinDifference, KelvinSpread, NotNegative, Positive
from irsim.geometry.random_fields import spectral
from irsim.rng import stream
from irsim.types import Floats

Hour = Literal["any", "day", "night"]
"""`any`: no hour, each temperature has its own default."""

TEMPERATURES: dict[str, dict[str, float]] = {
    "any": {"fields": 3.0, "roads": 6.0, "water": -8.0, "trees": 288.0, "walls": 290.0},
    "day": {
        "fields": 4.0,
        "roads": 9.0,
        "water": -11.0,
        "trees": 297.0,
        "walls": 304.0,
        "ground": 303.0,
        "spread": 4.0,
    },
    "night": {
        "fields": 1.0,
        "roads": 4.0,
        "water": 5.0,
        "trees": 285.5,
        "walls": 287.0,
        "ground": 283.0,
        "spread": 1.2,
    },
}
"""Temperatures by hour, K. Values of ground, trees and walls are absolute. A spread is the standard deviation of the
ground or between fields. Values of roads and water are differences from the ground. Values under `any` are chosen; the
others are round figures for a clear summer day and night at mid latitudes: bare soil and asphalt vary most between day
and night, water least, tree crowns stay near the air temperature (Oke, Boundary Layer Climates, 2nd ed. 1987, chapters
2 to 4). Water is therefore coldest by day and warm by night."""

Shape = tuple[int, int]
"""Rows and columns."""

Painted = tuple[Floats, Floats]
"""Cover, 0..1, and temperature minus the ground's, K."""

COVER_KEYS = ("fields", "water", "roads", "clutter")
"""Keys of ground cover, the lowest first."""


def by_hour(given: Mapping[str, Any], keys: Mapping[str, str]) -> dict[str, Any]:
    """Return the keys of a part and missing temperatures by its `hour`; `keys`: key of the part to key of the table."""
    hour = given.get("hour")
    table = TEMPERATURES.get(hour, {}) if isinstance(hour, str) else {}
    return {**{key: table[name] for key, name in keys.items() if name in table}, **given}


def leaves_k(hour: Hour) -> float | None:
    """Return the temperature of foliage at an hour, K; None without an hour."""
    return None if hour == "any" else TEMPERATURES[hour]["trees"]


def typical(given: float | None, hour: Hour, name: str) -> float:
    """Return the given value, or the one in TEMPERATURES for the hour if it is None, K."""
    return given if given is not None else TEMPERATURES[hour][name]


class Fields(Part):
    """Patchwork of fields, each of one temperature, with lanes between them."""

    switches: ClassVar[Switches] = {"lanes": ("lane_mrad", 0.0)}

    size_mrad: Feature = 60.0
    """Side of a field, mrad; sides vary by a factor of two."""
    spread_k: KelvinSpread | None = None
    """Standard deviation between fields, K; by default that of the ground's `hour`, or 3 with `any`."""
    lane_mrad: Annotated[NotNegative, Plausible(0, 300, "mrad")] = 1.5
    """Width of the lanes, mrad."""
    lane_k: KelvinDifference = 3.0
    """Temperature of the lanes minus the ground's mean, K."""

    def paint(self, shape: Shape, px_per_mrad: float, spread_k: float, seed: int) -> Painted:
        """Return fields painted by splitting the map down to `size_mrad` and bending it, so that edges are not
        straight."""
        draw = stream(seed, "fields")
        offsets, lanes = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        half = self.lane_mrad * px_per_mrad / 2
        todo = [(0.0, 0.0, float(shape[1]), float(shape[0]))]
        while todo:
            x, y, w, h = todo.pop()
            limit = self.size_mrad * px_per_mrad * np.exp(draw.uniform(-0.4, 0.4))
            if max(w, h) > 1.4 * limit and min(w, h) > 4:
                cut = draw.uniform(0.35, 0.65)
                if w > h * draw.uniform(0.7, 1.4):
                    todo += [(x, y, w * cut, h), (x + w * cut, y, w * (1 - cut), h)]
                else:
                    todo += [(x, y, w, h * cut), (x, y + h * cut, w, h * (1 - cut))]
                continue
            rows, columns = slice(round(y), round(y + h)), slice(round(x), round(x + w))
            offsets[rows, columns] = draw.standard_normal()
            if half:  # without lanes, seams inside pixels would be visible
                along = _inner_share(np.arange(float(columns.start), columns.stop), x, x + w, half)
                down = _inner_share(np.arange(float(rows.start), rows.stop), y, y + h, half)
                lanes[rows, columns] = 1 - down[:, None] * along
        bent = _bend((offsets * spread_k) * (1 - lanes) + self.lane_k * lanes, self.size_mrad * px_per_mrad, seed)
        return np.ones_like(bent), bent


def _inner_share(pixels: Floats, low: float, high: float, edge: float) -> Floats:
    """Return the share of each pixel that lies more than `edge` inside (low, high)."""
    inside = np.minimum(pixels + 0.5 - low, high - pixels - 0.5) - edge
    return np.asarray(np.clip(inside + 0.5, 0, 1), dtype=np.float32)


def _bend(texture: Floats, size_px: float, seed: int) -> Floats:
    """Return a periodic texture bent by smooth random displacements, of a tenth of `size_px` rms."""
    height, width = shape = texture.shape[0], texture.shape[1]
    across, down = (spectral(shape, 4.5, None, 2 * size_px, 1.0, seed, "bend", axis) for axis in ("x", "y"))
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    columns, rows = np.mod(x + 0.1 * size_px * across, width), np.mod(y + 0.1 * size_px * down, height)
    return np.asarray(cv2.remap(closed(texture), columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR))


class UniformCover(Part):
    """Ground cover of one temperature."""

    @abstractmethod
    def inside(self, shape: Shape, px_per_mrad: float, seed: int) -> Floats:
        """Return the signed distance of each pixel's centre from the edge, (rows, columns) px; negative outside."""

    def paint(self, shape: Shape, px_per_mrad: float, contrast_k: float, seed: int) -> Painted:
        cover = np.clip(self.inside(shape, px_per_mrad, seed) + 0.5, 0, 1).astype(np.float32)
        return cover, np.full_like(cover, contrast_k)


class Roads(UniformCover):
    """Winding roads across the image."""

    count: Annotated[int, Field(ge=1, le=50)] = 2
    """Number of roads on a map of 1024 px."""
    width_mrad: Annotated[Positive, Plausible(0.05, 300, "mrad", "a track of 2 m is 0.1 mrad wide 20 km away")] = 2.0
    """Width of a road, mrad."""
    contrast_k: KelvinDifference | None = None
    """Temperature minus the ground's mean, K; by default that of the ground's `hour`, or 6 with `any`."""

    def inside(self, shape: Shape, px_per_mrad: float, seed: int) -> Floats:
        distance = np.full(shape, np.inf)
        for number in range(round(self.count * max(shape) / 1024) or 1):
            side, length = shape if number % 2 else shape[::-1]
            if number >= (round(self.count * side / 1024) or 1):
                continue
            along, draw = np.arange(length), stream(seed, "roads", number)
            waves = np.arange(1, 6)
            amplitude = draw.standard_normal((2, 5)) * length * 0.05 / waves**1.5
            phase = 2 * np.pi * np.outer(along / length, waves)
            course = np.cos(phase) @ amplitude[0] + np.sin(phase) @ amplitude[1]
            slope = np.gradient(course)
            middle = draw.uniform(0, side) + course
            off = np.abs((np.arange(side)[:, None] - middle + side / 2) % side - side / 2) / np.hypot(1, slope)
            distance = np.minimum(distance, off if number % 2 else off.T)
        return np.asarray(self.width_mrad * px_per_mrad / 2 - distance)


class Water(UniformCover):
    """Ponds and lakes of one temperature."""

    share: Annotated[float, Field(gt=0, lt=1)] = 0.1
    """Share of the ground covered by water."""
    size_mrad: Feature = 80.0
    """Size of the largest ponds and lakes, mrad."""
    contrast_k: KelvinDifference | None = None
    """Temperature minus the ground's mean, K; by default that of the ground's `hour`, or -8 with `any`."""

    def inside(self, shape: Shape, px_per_mrad: float, seed: int) -> Floats:
        field = spectral(shape, 4.2, None, self.size_mrad * px_per_mrad, 1.3, seed, "water")
        shore = float(np.quantile(field, 1 - self.share))
        steep = np.hypot(*np.gradient(field)) + 1e-6
        return np.asarray((field - shore) / steep)
