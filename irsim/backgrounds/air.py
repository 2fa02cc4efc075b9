"""Ground and clouds as they are seen through the air."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from irsim.backgrounds.base import AirBefore, Changed, Gaze, Layer, Slices, in_air
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.drifting import Drifting
from irsim.stage import Stage
from irsim.types import Floats

COLUMN = 4096
"""Steps of the table between the level and straight down, and up: 0.38 mrad each."""

LOOKED = 16
"""Of so many rows and columns of a picture one is looked at, to see how smooth the air in it is."""

EVEN = 2e-4
"""Share of the greatest transmittance, and of the greatest light of the path, that may be missed there: of a body at
300 K in LWIR 0.01 K."""

EARTH_M = 6.371e6


def ground_range_m(height_m: float, depression_rad: Floats) -> Floats:
    """Range, m, at which a ray falls on the round Earth from a height, m; beyond the horizon, that of the horizon."""
    base = EARTH_M + height_m
    horizon_square = height_m * (2 * EARTH_M + height_m)
    lever = np.maximum(base * np.sin(depression_rad), np.sqrt(horizon_square))
    # lever - sqrt(lever^2 - horizon^2), without the difference of large numbers
    beyond = np.maximum(lever**2 - horizon_square, 0.0)  # at the horizon rounding may leave less than nothing
    return np.asarray(horizon_square / (lever + np.sqrt(beyond)))


@dataclass(frozen=True, eq=False)
class Column:
    """Transmittance and light of the path, (n, 1, 2) float32, at evenly spaced angles from `highest`, rad above the
    level, to straight down."""

    table: Floats
    highest: float = 0.0

    @classmethod
    def of(cls, stage: Stage, height_m: float) -> Column:
        """Down to ground as seen from a height above it, m, in which none is below a metre."""
        depression = np.linspace(0, np.pi / 2, COLUMN)
        path = stage.air.path(stage.band, ground_range_m(max(height_m, 1.0), depression), -depression)
        return cls(np.stack(path, axis=-1).astype(np.float32)[:, None])

    @classmethod
    def around(cls, stage: Stage, range_m: float) -> Column:
        """In all directions to one range, m."""
        depression = np.linspace(-np.pi / 2, np.pi / 2, 2 * COLUMN - 1)
        path = stage.air.path(stage.band, range_m, -depression)
        return cls(np.stack(path, axis=-1).astype(np.float32)[:, None], np.pi / 2)

    def at(self, depression_rad: Floats) -> tuple[Floats, Floats]:
        """(transmittance, light of the path) at angles below the level (rows, cols); above `highest`, as there."""
        steps = (len(self.table) - 1) / (np.pi / 2 + self.highest)
        rows = ((depression_rad + self.highest) * steps).astype(np.float32)
        found = cv2.remap(self.table, np.zeros_like(rows), rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        tau, path = cv2.split(found)
        return np.asarray(tau, np.float32), np.asarray(path, np.float32)


@dataclass(frozen=True, eq=False)
class ThroughAir(Changed):
    """A layer with the air before it."""

    column: Column

    def light(self, gaze: Gaze) -> tuple[Floats | None, Floats]:
        passed, emission = self.layer.light(gaze)
        return passed, in_air(passed, emission, _seen(self.column, gaze.chart))


@dataclass(frozen=True, eq=False)
class DriftingThroughAir(ThroughAir):
    """A layer that fills the picture by itself, with the air before it at once."""

    layer: Drifting

    def veil(self, under: Floats, light: Floats, gaze: Gaze, behind: Sequence[Slices]) -> list[Floats]:
        """See `Veil`."""
        return self.layer.veil(under, light, gaze, behind, _seen(self.column, gaze.chart))


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


def through_air(layers: Sequence[Layer], stage: Stage, height_m: float | None = None) -> Sequence[Layer]:
    """Layers on ground `height_m` below the camera, as it sees them through the air; in clear air as they are.

    Without a height the ground is at the sea's level, as far below as the camera's altitude above it.
    """
    if stage.air.is_clear:
        return layers
    column = Column.of(stage, stage.air.altitude_m if height_m is None else height_m)
    return [ThroughAir(layer, column) for layer in layers]


def through_air_around(layers: Sequence[Layer], stage: Stage) -> Sequence[Layer]:
    """Layers all around the camera, each at its range, as it sees them; as they are in clear air."""
    if stage.air.is_clear:
        return layers
    columns = [(layer, Column.around(stage, layer.range_m)) for layer in layers]
    return [
        DriftingThroughAir(layer, column) if isinstance(layer, Drifting) else ThroughAir(layer, column)
        for layer, column in columns
    ]
