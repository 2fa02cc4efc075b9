"""Ground as it is seen through the air."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.base import Gaze, Layer
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
class ThroughAir:
    """A layer on the ground below, with the air before it.

    column  (COLUMN, 1, 2) float32: transmittance, and light of the path, from the level down
    """

    layer: Layer
    column: Floats

    @property
    def name(self) -> str:
        return self.layer.name

    @property
    def range_m(self) -> float:
        return self.layer.range_m

    def light(self, gaze: Gaze) -> tuple[Floats | None, Floats]:
        chart = gaze.chart
        rows = chart.spread(-chart.elevation_rad(chart.v) / (np.pi / 2) * (COLUMN - 1))
        looked_up = cv2.remap(self.column, np.zeros_like(rows), rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        tau, path = looked_up[..., 0], looked_up[..., 1]
        passed, emission = self.layer.light(gaze)
        return passed, np.asarray(tau * emission + (path if passed is None else path * (1 - passed)))


def through_air(layers: Sequence[Layer], stage: Stage) -> Sequence[Layer]:
    """Layers on ground at the sea's level as the camera sees them from its altitude; as they are in clear air."""
    air = stage.air
    if air.is_clear:
        return layers
    depression = np.linspace(0, np.pi / 2, COLUMN)
    path = air.path(stage.band, ground_range_m(air.altitude_m, depression), -depression)
    column = np.stack(path, axis=-1).astype(np.float32)[:, None]
    return [ThroughAir(layer, column) for layer in layers]
