"""What lies on the ground: fields with lanes between them, roads and water; clutter has a file of its own.

Each is painted on a periodic map of px, (rows, columns), and gives its cover (0..1, of each pixel) and
its temperature less the ground's, K. What is of one temperature has an edge, too, which is sharp
however large the map is drawn.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.config.base import Part, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Feature, KelvinDifference, KelvinSpread, NotNegative, Positive
from irsim.geometry.random_fields import spectral
from irsim.rng import stream
from irsim.types import Floats

Shape = tuple[int, int]
"""Rows and columns."""

Painted = tuple[Floats, Floats]
"""Cover, 0..1, and temperature less the ground's, K."""

LYING = ("fields", "water", "roads", "clutter")
"""Keys of what lies on the ground, the lowest first."""


class Fields(Part):
    """A patchwork of fields, each of one temperature, with lanes between them."""

    switches: ClassVar[Switches] = {"lanes": ("lane_mrad", 0.0)}

    size_mrad: Feature = 60.0
    """Side of a field, mrad; they vary by a factor of two about it."""
    spread_k: KelvinSpread | None = None
    """Standard deviation between fields, K; by the ground's `hour` where not given, else 3."""
    lane_mrad: Annotated[NotNegative, Plausible(0, 300, "mrad")] = 1.5
    """Width of the lanes, mrad."""
    lane_k: KelvinDifference = 3.0
    """Temperature of the lanes less the ground's mean, K."""

    def paint(self, shape: Shape, px_per_mrad: float, spread_k: float, seed: int) -> Painted:
        """The map is split until its parts are of the wanted size, then bent so that no edge is straight for long."""
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
            if half:  # or a trace of them would be left, where a seam goes through a pixel
                along = _within(np.arange(float(columns.start), columns.stop), x, x + w, half)
                down = _within(np.arange(float(rows.start), rows.stop), y, y + h, half)
                lanes[rows, columns] = 1 - down[:, None] * along
        bent = _bend((offsets * spread_k) * (1 - lanes) + self.lane_k * lanes, self.size_mrad * px_per_mrad, seed)
        return np.ones_like(bent), bent


def _within(pixels: Floats, low: float, high: float, edge: float) -> Floats:
    """Share of each pixel that lies more than `edge` inside (low, high)."""
    inside = np.minimum(pixels + 0.5 - low, high - pixels - 0.5) - edge
    return np.asarray(np.clip(inside + 0.5, 0, 1), dtype=np.float32)


def _bend(texture: Floats, size_px: float, seed: int) -> Floats:
    """A periodic texture displaced smoothly, by a tenth of `size_px`."""
    height, width = shape = texture.shape[0], texture.shape[1]
    across, down = (spectral(shape, 4.5, None, 2 * size_px, 1.0, seed, "bend", axis) for axis in ("x", "y"))
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    columns, rows = np.mod(x + 0.1 * size_px * across, width), np.mod(y + 0.1 * size_px * down, height)
    wide = cv2.copyMakeBorder(texture, 0, 1, 0, 1, cv2.BORDER_WRAP)
    return np.asarray(cv2.remap(wide, columns.astype(np.float32), rows.astype(np.float32), cv2.INTER_LINEAR))


class Even(Part):
    """Something of one temperature."""

    @abstractmethod
    def inside(self, shape: Shape, px_per_mrad: float, seed: int) -> Floats:
        """(rows, columns): how far each pixel's middle is inside of its edge, px; outside, below 0."""

    def paint(self, shape: Shape, px_per_mrad: float, contrast_k: float, seed: int) -> Painted:
        cover = np.clip(self.inside(shape, px_per_mrad, seed) + 0.5, 0, 1).astype(np.float32)
        return cover, np.full_like(cover, contrast_k)


class Roads(Even):
    """Winding roads across the picture."""

    count: Annotated[int, Field(ge=1, le=50)] = 2
    """How many on a map of 1024 px."""
    width_mrad: Annotated[Positive, Plausible(0.05, 300, "mrad", "a track of 2 m is 0.1 mrad wide 20 km away")] = 2.0
    """Width, mrad."""
    contrast_k: KelvinDifference | None = None
    """Temperature less the ground's mean, K; by the ground's `hour` where not given, else 6."""

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


class Water(Even):
    """Ponds and lakes: smooth, and of one temperature."""

    share: Annotated[float, Field(gt=0, lt=1)] = 0.1
    """Share of the ground."""
    size_mrad: Feature = 80.0
    """Size of the largest, mrad."""
    contrast_k: KelvinDifference | None = None
    """Temperature less the ground's mean, K; by the ground's `hour` where not given, else -8."""

    def inside(self, shape: Shape, px_per_mrad: float, seed: int) -> Floats:
        field = spectral(shape, 4.2, None, self.size_mrad * px_per_mrad, 1.3, seed, "water")
        shore = float(np.quantile(field, 1 - self.share))
        steep = np.hypot(*np.gradient(field)) + 1e-6
        return np.asarray((field - shore) / steep)
