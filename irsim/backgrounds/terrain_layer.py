"""Ground as layers: the opaque one with the sky behind it, and what lies on it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.base import FARTHEST, Layer, ViewDirection
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.panorama import Panorama
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Laid:
    """Something painted on the ground, and parallax by the distance at which each pixel meets it."""

    name: str
    painting: Painting
    camera_height_m: float
    range_m: float = FARTHEST

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        if not any(view_direction.place):
            transmittance, emission = self.painting.seen(view_direction)
            return transmittance, emission
        columns, rows = self._places(view_direction)
        transmittance, emission = (tile.at(columns, rows) for tile in self.painting.tiles)
        return transmittance, emission

    def _places(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        """Where the panorama, painted from the first place, shows the points of the plane that each pixel sees."""
        chart, (x, y, z) = view_direction.chart, view_direction.place
        geometry, height = chart.geometry, self.camera_height_m
        unit, squeeze = geometry.ifov_rad, np.cos(geometry.elevation_rad)
        azimuth = chart.spread(chart.u) * unit / squeeze
        down = chart.spread(chart.v) * unit - geometry.elevation_rad  # angle below the horizon
        distance = max(height - y, 0.1) / np.tan(np.maximum(down, 1e-6))
        right, ahead = x + distance * np.sin(azimuth), z + distance * np.cos(azimuth)
        first = np.arctan2(height, np.hypot(right, ahead))
        picture = self.painting.tiles[0]
        assert isinstance(picture, Panorama)
        on_ground = down > 0
        u = np.where(on_ground, np.arctan2(right, ahead), azimuth) * squeeze / unit
        v = (np.where(on_ground, first, down) + geometry.elevation_rad) / unit
        rows = np.clip(v - picture.top, 0, picture.padded.shape[0] - 1)
        return (u - picture.left).astype(np.float32), rows.astype(np.float32)


class Country:
    """The opaque layer: the clear sky, and the ground before it."""

    name = "country"
    range_m = FARTHEST

    def __init__(self, sky: Layer, ground: Laid) -> None:
        self._sky, self._ground = sky, ground
        self._last: tuple[ViewDirection, Floats] | None = None

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        transmittance, emission = self._ground.light(view_direction)
        self._last = view_direction, transmittance
        return None, cv2.multiply(self._sky.light(view_direction)[1], transmittance) + emission

    def sky_left(self, view_direction: ViewDirection) -> Floats:
        """(rows, cols): the share of each pixel that the ground leaves to the sky."""
        last = self._last  # once: another thread may put its own there
        if last is None or last[0] is not view_direction:
            last = self._last = view_direction, self._ground.light(view_direction)[0]
        return last[1]
