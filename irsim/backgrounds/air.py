"""Ground as it is seen through the air."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.base import Changed, Gaze, Layer
from irsim.stage import Stage
from irsim.types import Floats

COLUMN = 4096
"""Steps of the table between the level and straight down: 0.38 mrad each."""

EARTH_M = 6.371e6


def ground_range_m(height_m: float, depression_rad: Floats) -> Floats:
    """Range, m, at which a ray falls on the round Earth from a height, m; beyond the horizon, that of the horizon."""
    base = EARTH_M + height_m
    horizon_square = height_m * (2 * EARTH_M + height_m)
    lever = np.maximum(base * np.sin(depression_rad), np.sqrt(horizon_square))
    # lever - sqrt(lever^2 - horizon^2), without the difference of large numbers
    return np.asarray(horizon_square / (lever + np.sqrt(lever**2 - horizon_square)))


@dataclass(frozen=True, eq=False)
class Column:
    """Transmittance and light of the path, (COLUMN, 1, 2) float32, from the level down to ground at sea level."""

    table: Floats

    @classmethod
    def of(cls, stage: Stage, height_m: float, altitude_m: float = 0.0) -> Column:
        """As seen from a height above the ground, m; none is below a metre. altitude_m: that above the sea's level,
        where it is more."""
        height_m = max(height_m, 1.0)
        depression = np.linspace(0, np.pi / 2, COLUMN)
        air = stage.air.model_copy(update={"altitude_m": max(height_m, altitude_m)})
        path = air.path(stage.band, ground_range_m(height_m, depression), -depression)
        return cls(np.stack(path, axis=-1).astype(np.float32)[:, None])

    def at(self, depression_rad: Floats) -> tuple[Floats, Floats]:
        """(transmittance, light of the path) at angles below the level (rows, cols); above it, as at it."""
        rows = (depression_rad * ((COLUMN - 1) / (np.pi / 2))).astype(np.float32)
        found = cv2.remap(self.table, np.zeros_like(rows), rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(found[..., 0], np.float32), np.asarray(found[..., 1], np.float32)


@dataclass(frozen=True, eq=False)
class ThroughAir(Changed):
    """A layer on the ground below, with the air before it."""

    column: Column

    def light(self, gaze: Gaze) -> tuple[Floats | None, Floats]:
        tau, path = self.column.at(gaze.chart.spread(-gaze.chart.elevation_rad(gaze.chart.v)))
        passed, emission = self.layer.light(gaze)
        return passed, np.asarray(tau * emission + (path if passed is None else path * (1 - passed)))


def through_air(layers: Sequence[Layer], stage: Stage, height_m: float | None = None) -> Sequence[Layer]:
    """Layers on ground `height_m` below the camera, as it sees them through the air; in clear air as they are.

    Without a height the ground is at the sea's level, as far below as the camera's altitude above it.
    """
    if stage.air.is_clear:
        return layers
    altitude_m = stage.air.altitude_m
    column = Column.of(stage, altitude_m if height_m is None else height_m, altitude_m)
    return [ThroughAir(layer, column) for layer in layers]
