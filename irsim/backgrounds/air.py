"""Air in front of ground and clouds: tables of its transmittance and path radiance by the angle of the ray."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import cv2
import numpy as np

from irsim.backgrounds.base import AirBefore, Layer, LayerWrapper, ViewDirection, apply_air
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.cloud_drift import EvolvingCloud
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import EARTH_KM
from irsim.types import Floats, Slices

TABLE_STEPS = 4096
"""Steps of a table from the horizontal to the nadir, and to the zenith. Even steps are 0.38 mrad. Steps of
`GroundAirTable` grow with the angle below the horizontal, near which the distance of the ground changes fastest: at an
angle of 0.1 mrad a step is 0.006 mrad."""

CHECK_EVERY = 16
"""Stride, in rows and columns, of the pixels at which the smoothness of the air is checked."""

TOLERANCE = 2e-4
"""Largest allowed error of interpolated air at these pixels, as a share of the greatest transmittance or path radiance:
0.01 K for a body of 300 K in LWIR."""

FARTHEST_M = 100_000.0
"""Least distance to which ground is drawn, m: the limit of plausible ranges (`irsim.config.quantities`), at which air
is almost opaque (transmittance 0.01 in LWIR, US standard, 23 km). From a height of 780 m the horizon is as far."""


def horizon_m(height_m: float) -> float:
    """Return the distance, m, of the round Earth's horizon from a height, m: the length of a tangent."""
    return math.sqrt(height_m * (2e3 * EARTH_KM + height_m))


def ground_path(height_m: float, depression_rad: Floats) -> tuple[Floats, Floats]:
    """Return length, m, and elevation, rad, of rays to a plane `height_m` below, by their angle below the horizontal.

    Ground is drawn on this plane and targets with `ground_m` move on it, so the air before both is equal. Rays near and
    above the horizontal get the path to the farthest ground, as an infinite plane would leave the atmosphere of the
    round Earth.
    """
    farthest = max(horizon_m(height_m), FARTHEST_M)
    down = np.clip(depression_rad, math.asin(height_m / farthest), np.pi / 2)
    return height_m / np.sin(down), -down


@dataclass(frozen=True, eq=False)
class AirTable(ABC):
    """Table of transmittance and path radiance, (n, 1, 2) float32, by angle below the horizontal."""

    table: Floats

    @classmethod
    def of(cls, context: SceneContext, range_m: float | Floats, elevation_rad: Floats) -> Self:
        """Return the table of a scene's air on paths of given lengths and elevations (n,)."""
        path = context.air.path(context.band, range_m, elevation_rad)
        return cls(np.stack(path, axis=-1).astype(np.float32)[:, None])

    @abstractmethod
    def rows(self, depression_rad: Floats) -> Floats:
        """Return the fractional table rows of angles below the horizontal."""

    def at(self, depression_rad: Floats) -> tuple[Floats, Floats]:
        """Return (transmittance, path radiance) at angles below the horizontal (rows, cols), constant beyond the
        ends."""
        rows = self.rows(depression_rad).astype(np.float32)
        found = cv2.remap(self.table, np.zeros_like(rows), rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        tau, path = cv2.split(found)
        return np.asarray(tau, np.float32), np.asarray(path, np.float32)


class GroundAirTable(AirTable):
    """Table of the air down to the ground, from the horizontal to the nadir, in steps that grow with the angle."""

    @classmethod
    def to(cls, context: SceneContext, height_m: float) -> GroundAirTable:
        """Return the table for a height above the ground, m, of at least 1 m."""
        depression = np.linspace(0, 1, TABLE_STEPS) ** 2 * np.pi / 2
        return cls.of(context, *ground_path(max(height_m, 1.0), depression))

    def rows(self, depression_rad: Floats) -> Floats:
        return np.asarray(np.sqrt(np.maximum(depression_rad, 0) * (2 / np.pi)) * (TABLE_STEPS - 1))


class RangeAirTable(AirTable):
    """Table of the air up to one distance, from the zenith to the nadir, in even steps."""

    @classmethod
    def to(cls, context: SceneContext, range_m: float) -> RangeAirTable:
        """Return the table for a distance, m."""
        return cls.of(context, range_m, -np.linspace(-np.pi / 2, np.pi / 2, 2 * TABLE_STEPS - 1))

    def rows(self, depression_rad: Floats) -> Floats:
        return np.asarray((depression_rad + np.pi / 2) * ((2 * TABLE_STEPS - 2) / np.pi))


@dataclass(frozen=True, eq=False)
class AttenuatedLayer(LayerWrapper):
    """Layer attenuated by the air before it."""

    table: AirTable

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        transmittance, emission = self.layer.light(view_direction)
        return transmittance, apply_air(transmittance, emission, _air_before(self.table, view_direction.chart))


@dataclass(frozen=True, eq=False)
class AttenuatedClouds(AttenuatedLayer):
    """Evolving cloud attenuated by the air before it, blended in one step."""

    layer: EvolvingCloud

    def blend(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """Blend as in `SemiTransparentLayer.blend`."""
        return self.layer.blend(under, light, view_direction, behind, _air_before(self.table, view_direction.chart))


@lru_cache(maxsize=4)
def _air_before(table: AirTable, chart: Chart) -> AirBefore:
    """Return `AirTable.at` for the pixels of a chart, cached for all layers on one ground and for a camera at rest.

    Where transmittance and path radiance are smooth, they are interpolated from the chart's nodes in a third of the
    time.
    """
    down = -chart.elevation_rad(chart.v)
    at_nodes, exact = table.at(down), table.at(chart.at_pixels(down, CHECK_EVERY))
    interpolated = (chart.at_pixels(nodes, CHECK_EVERY) for nodes in at_nodes)
    if all(
        np.abs(one - other).max() <= TOLERANCE * other.max() for one, other in zip(interpolated, exact, strict=True)
    ):
        tau, path = at_nodes
        return chart.at_pixels(tau), chart.at_pixels(path)
    return table.at(chart.at_pixels(down))


def attenuated_ground(layers: Sequence[Layer], context: SceneContext, height_m: float | None = None) -> Sequence[Layer]:
    """Return layers on ground `height_m` below the camera, attenuated by air; unchanged in clear air.

    By default the ground is at sea level, below the camera by its altitude.
    """
    if context.air.is_clear:
        return layers
    table = GroundAirTable.to(context, context.air.altitude_m if height_m is None else height_m)
    return [AttenuatedLayer(layer, table) for layer in layers]


def attenuated_shells(layers: Sequence[Layer], context: SceneContext) -> Sequence[Layer]:
    """Return layers around the camera, each attenuated by the air up to its range; unchanged in clear air."""
    if context.air.is_clear:
        return layers
    tables = [(layer, RangeAirTable.to(context, layer.range_m)) for layer in layers]
    return [
        AttenuatedClouds(layer, table) if isinstance(layer, EvolvingCloud) else AttenuatedLayer(layer, table)
        for layer, table in tables
    ]
