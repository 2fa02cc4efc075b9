"""Sky: a clear-sky gradient with elevation, and cloud layers before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.base import FARTHEST, Background, Gaze, Layer
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.texture import Tile, power_law, tile_side
from irsim.kinds import Kelvin, Name, NotNegative, Pair, Part, Positive, Several
from irsim.radiometry import Band, radiance
from irsim.stage import Stage
from irsim.types import Floats

SCALE_SIN_ELEVATION = 0.3
"""Clear sky cools from horizon to zenith as exp(-sin(elevation)/0.3). Fitted by eye to 284, 269, 255,
230, 214 K at 1, 5, 10, 30, 90 degrees (US standard atmosphere, 8-12 um, LOWTRAN7): with 288 K at the
horizon and 211 K at the zenith it stays within 5 K of them."""

COLUMN = 4096
"""Steps of the clear sky's table between zenith and nadir: 0.77 mrad, over which it bends by under 1 mK."""


@dataclass(frozen=True, eq=False)
class ClearSky:
    """The opaque layer behind all clouds: its light depends on elevation only."""

    band: Band
    horizon_k: float
    zenith_k: float
    name: str = "clear_sky"
    range_m: float = FARTHEST

    def radiance(self, elevation_rad: Floats) -> Floats:
        """In-band radiance at an elevation; below the horizon it stays as at the horizon."""
        share = np.exp(-np.maximum(np.sin(elevation_rad), 0) / SCALE_SIN_ELEVATION)
        return radiance(self.band, self.zenith_k + (self.horizon_k - self.zenith_k) * share)

    @cached_property
    def _column(self) -> Floats:
        """(COLUMN, 1) float32 from zenith to nadir."""
        return self.radiance(np.linspace(np.pi / 2, -np.pi / 2, COLUMN)).astype(np.float32)[:, None]

    def light(self, gaze: Gaze) -> tuple[None, Floats]:
        chart = gaze.chart
        elevation = chart.elevation_rad(chart.v)
        if elevation.min() > 0:  # smooth without the horizon's bend: 1 ms less for 640x512
            return None, chart.spread(self.radiance(elevation))
        rows = chart.spread((np.pi / 2 - elevation) / np.pi * (COLUMN - 1))
        return None, np.asarray(cv2.remap(self._column, np.zeros_like(rows), rows, cv2.INTER_LINEAR))


class Clouds(Part):
    """A layer of cloud at its own range: it hides what is behind it, partly where it is thin."""

    id: Name = "clouds"
    """Its name for --without."""
    coverage: Annotated[float, Field(gt=0, lt=1)] = 0.4
    """Share of the sky that has cloud before it."""
    depth: NotNegative = 3.0
    """Optical depth for each standard deviation of the texture above the cloud's edge; 0 is no cloud."""
    temperature_k: Kelvin = 268.0
    """Temperature of the cloud, K."""
    texture_k: NotNegative = 2.0
    """Standard deviation of temperature within the cloud, K."""
    beta: Annotated[float, Field(ge=0, le=6)] = 3.3
    """Slope of the 2-D power spectrum f^-beta (real clouds: 2.9 to 4.1)."""
    correlation_mrad: Positive = 60.0
    """Size of the largest features, mrad."""
    stretch: Annotated[float, Field(ge=0.1, le=10)] = 2.0
    """How much wider than high features are."""
    range_m: Positive = 5000.0
    """Distance of the layer, m: targets farther away are behind it."""
    wind_mrad_s: Pair = (0.0, 0.0)
    """Apparent motion, right and down, mrad/s."""

    def layer(self, stage: Stage) -> CloudLayer:
        """The textures of transmittance and emission, ready to be sampled."""
        geometry = stage.geometry
        side = tile_side(geometry.size)
        correlation_px = self.correlation_mrad * 1e-3 / geometry.ifov_rad
        thickness, warmth = (
            power_law(side, self.beta, correlation_px, self.stretch, stage.seed, self.id, what)
            for what in ("thickness", "warmth")
        )
        edge = NormalDist().inv_cdf(1 - self.coverage)
        transmittance = np.exp(-self.depth * np.maximum(thickness - edge, 0))
        kelvin = np.maximum(self.temperature_k + self.texture_k * warmth, 1.0)
        emission = (1 - transmittance) * radiance(stage.band, kelvin)
        tiles = tuple(Tile.of(field, geometry.size, stage.psf_px) for field in (transmittance, emission))
        right, down = self.wind_mrad_s
        px_per_mrad = 1e-3 / geometry.ifov_rad
        return CloudLayer(self.id, self.range_m, Painting(tiles, (right * px_per_mrad, down * px_per_mrad)))


@dataclass(frozen=True, eq=False)
class CloudLayer:
    """Clouds, painted: their transmittance and their emission."""

    name: str
    range_m: float
    painting: Painting

    def light(self, gaze: Gaze) -> tuple[Floats, Floats]:
        transmittance, emission = self.painting.seen(gaze)
        return transmittance, emission


class Sky(Background):
    """Clear sky with cloud layers; with no clouds and one temperature it is flat."""

    horizon_k: Kelvin = 288.0
    """Brightness temperature at the horizon, K."""
    zenith_k: Kelvin = 211.0
    """Brightness temperature at the zenith, K."""
    clouds: Several[Clouds] = ()
    """Cloud layers."""

    def layers(self, stage: Stage) -> Sequence[Layer]:
        clouds = sorted(self.clouds, key=lambda layer: -layer.range_m)
        return [
            ClearSky(stage.band, self.horizon_k, self.zenith_k),
            *(layer.layer(stage) for layer in clouds),
        ]

    def names(self) -> tuple[str, ...]:
        return tuple(layer.id for layer in self.clouds)
