"""Ground and clouds as they are seen through the air."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import cv2
import numpy as np

from irsim.backgrounds.base import AirBefore, Changed, Layer, ViewDirection, in_air
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.drifting import Drifting
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import EARTH_KM
from irsim.types import Floats, Slices

COLUMN = 4096
"""Steps of the table between the level and straight down, and up. In even steps 0.38 mrad each; for ground, whose range
rises the faster the nearer it is to the level, in squares: 0.006 mrad each where they are 0.1 mrad below it."""

LOOKED = 16
"""Of so many rows and columns of a picture one is looked at, to see how smooth the air in it is."""

EVEN = 2e-4
"""Share of the greatest transmittance, and of the greatest light of the path, that may be missed there: of a body at
300 K in LWIR 0.01 K."""

FARTHEST_M = 100_000.0
"""Ground is seen up to here at least, m: ranges up to here are plausible (`irsim.config.quantities`), and the air before it is
all but opaque (of LWIR 0.01 passes, US standard, 23 km). On the round Earth it is seen as far from 780 m up."""


def horizon_m(height_m: float) -> float:
    """Range, m, of the round Earth's horizon from a height, m: a tangent's length."""
    return math.sqrt(height_m * (2e3 * EARTH_KM + height_m))


def ground_path(height_m: float, depression_rad: Floats) -> tuple[Floats, Floats]:
    """Range, m, and elevation, rad, at which rays at angles below the level meet level ground a height below, m.

    It is the plane that is drawn, and that paths with `ground_m` lie on: what stands there has the air of the ground.
    Nearer to the level than the farthest ground, and above the level, all have that one's: a plane that went on would
    rise out of the round Earth's air.
    """
    farthest = max(horizon_m(height_m), FARTHEST_M)
    down = np.clip(depression_rad, math.asin(height_m / farthest), np.pi / 2)
    return height_m / np.sin(down), -down


@dataclass(frozen=True, eq=False)
class Column(ABC):
    """Transmittance and light of the path, (n, 1, 2) float32, at angles below the level."""

    table: Floats

    @classmethod
    def of(cls, context: SceneContext, range_m: float | Floats, elevation_rad: Floats) -> Self:
        """What the air of a stage does on paths (n,)."""
        path = context.air.path(context.band, range_m, elevation_rad)
        return cls(np.stack(path, axis=-1).astype(np.float32)[:, None])

    @abstractmethod
    def rows(self, depression_rad: Floats) -> Floats:
        """Where the table has angles below the level, in rows of it."""

    def at(self, depression_rad: Floats) -> tuple[Floats, Floats]:
        """(transmittance, light of the path) at angles below the level (rows, cols); beyond its ends as there."""
        rows = self.rows(depression_rad).astype(np.float32)
        found = cv2.remap(self.table, np.zeros_like(rows), rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        tau, path = cv2.split(found)
        return np.asarray(tau, np.float32), np.asarray(path, np.float32)


class Below(Column):
    """Down to ground, from the level to straight down in squares of even steps."""

    @classmethod
    def to(cls, context: SceneContext, height_m: float) -> Below:
        """To ground as seen from a height above it, m, in which none is below a metre."""
        depression = np.linspace(0, 1, COLUMN) ** 2 * np.pi / 2
        return cls.of(context, *ground_path(max(height_m, 1.0), depression))

    def rows(self, depression_rad: Floats) -> Floats:
        return np.asarray(np.sqrt(np.maximum(depression_rad, 0) * (2 / np.pi)) * (COLUMN - 1))


class Around(Column):
    """In all directions to one range, from straight up to straight down in even steps."""

    @classmethod
    def to(cls, context: SceneContext, range_m: float) -> Around:
        """To a range, m."""
        return cls.of(context, range_m, -np.linspace(-np.pi / 2, np.pi / 2, 2 * COLUMN - 1))

    def rows(self, depression_rad: Floats) -> Floats:
        return np.asarray((depression_rad + np.pi / 2) * ((2 * COLUMN - 2) / np.pi))


@dataclass(frozen=True, eq=False)
class ThroughAir(Changed):
    """A layer with the air before it."""

    column: Column

    def light(self, view_direction: ViewDirection) -> tuple[Floats | None, Floats]:
        passed, emission = self.layer.light(view_direction)
        return passed, in_air(passed, emission, _seen(self.column, view_direction.chart))


@dataclass(frozen=True, eq=False)
class DriftingThroughAir(ThroughAir):
    """A layer that fills the picture by itself, with the air before it at once."""

    layer: Drifting

    def veil(
        self, under: Floats, light: Floats, view_direction: ViewDirection, behind: Sequence[Slices]
    ) -> list[Floats]:
        """See `SemiTransparentLayer`."""
        return self.layer.veil(under, light, view_direction, behind, _seen(self.column, view_direction.chart))


@lru_cache(maxsize=4)
def _seen(column: Column, chart: Chart) -> AirBefore:
    """`Column.at` what the pixels see, kept for all layers on one ground, and for a camera that stands still.

    Where the column is smooth, its values at the chart's nodes are enough: a third of the time."""
    down = -chart.elevation_rad(chart.v)
    at_nodes, looked = column.at(down), column.at(chart.spread(down, LOOKED))
    told = (chart.spread(nodes, LOOKED) for nodes in at_nodes)
    if all(np.abs(one - other).max() <= EVEN * other.max() for one, other in zip(told, looked, strict=True)):
        tau, path = at_nodes
        return chart.spread(tau), chart.spread(path)
    return column.at(chart.spread(down))


def through_air(layers: Sequence[Layer], context: SceneContext, height_m: float | None = None) -> Sequence[Layer]:
    """Layers on ground `height_m` below the camera, as it sees them through the air; in clear air as they are.

    Without a height the ground is at the sea's level, as far below as the camera's altitude above it.
    """
    if context.air.is_clear:
        return layers
    column = Below.to(context, context.air.altitude_m if height_m is None else height_m)
    return [ThroughAir(layer, column) for layer in layers]


def through_air_around(layers: Sequence[Layer], context: SceneContext) -> Sequence[Layer]:
    """Layers all around the camera, each at its range, as it sees them; as they are in clear air."""
    if context.air.is_clear:
        return layers
    columns = [(layer, Around.to(context, layer.range_m)) for layer in layers]
    return [
        DriftingThroughAir(layer, column) if isinstance(layer, Drifting) else ThroughAir(layer, column)
        for layer, column in columns
    ]
