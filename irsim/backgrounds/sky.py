"""Sky: a clear-sky gradient with elevation, and cloud layers in front of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import cv2
import numpy as np

from irsim.backgrounds.air import attenuated_shells
from irsim.backgrounds.base import FARTHEST, Background, Layer, Names, Surfaces, ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.clouds import Clouds
from irsim.backgrounds.panorama import Sphere
from irsim.config.base import Several
from irsim.config.quantities import Kelvin
from irsim.geometry.context import SceneContext
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.climate import ClimateName
from irsim.physics.radiometry import radiance
from irsim.types import Band, Floats

SCALE_SIN_ELEVATION = 0.3
"""Clear sky cools from horizon to zenith as exp(-sin(elevation)/0.3). Fitted by eye to 284, 269, 255, 230, 214 K at 1,
5, 10, 30, 90 degrees (US standard atmosphere, 8-12 um, LOWTRAN7): with 288 K at the horizon and 211 K at the zenith it
stays within 5 K of them."""

FIT_K = 5.0
"""Largest error of the fit of SCALE_SIN_ELEVATION, K."""

TABLE_STEPS = 4096
"""Steps of the clear sky's table between zenith and nadir: 0.77 mrad, with an interpolation error under 1 mK."""


@dataclass(frozen=True, eq=False)
class ClearSky:
    """Opaque layer behind all clouds, whose radiance depends on elevation only."""

    band: Band
    horizon_k: float
    zenith_k: float
    name: str = "clear_sky"
    range_m: float = FARTHEST
    air: Atmosphere | None = None
    """Model atmosphere that replaces the two temperatures."""

    def radiance(self, elevation_rad: Floats) -> Floats:
        """Return the in-band radiance at an elevation; constant below the horizon."""
        if self.air is not None:
            return np.interp(elevation_rad, *_model_sky(self.air, self.band))
        share = np.exp(-np.maximum(np.sin(elevation_rad), 0) / SCALE_SIN_ELEVATION)
        return radiance(self.band, self.zenith_k + (self.horizon_k - self.zenith_k) * share)

    @cached_property
    def _table(self) -> Floats:
        """Radiance from zenith to nadir, (TABLE_STEPS, 1) float32."""
        return self.radiance(np.linspace(np.pi / 2, -np.pi / 2, TABLE_STEPS)).astype(np.float32)[:, None]

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, _chart_radiance(self, view_direction.chart)

    def over(self, chart: Chart) -> Floats:
        """Return the radiance of the pixels of a chart, (rows, cols) float32."""
        elevation = chart.elevation_rad(chart.v)
        if elevation.min() > 0:  # all above the horizon, so smooth: 1 ms less for 640x512
            return chart.at_pixels(self.radiance(elevation))
        rows = chart.at_pixels((np.pi / 2 - elevation) / np.pi * (TABLE_STEPS - 1))
        return np.asarray(cv2.remap(self._table, np.zeros_like(rows), rows, cv2.INTER_LINEAR))


@lru_cache(maxsize=2)
def _chart_radiance(sky: ClearSky, chart: Chart) -> Floats:
    """Return `ClearSky.over`, cached for a camera at rest."""
    return sky.over(chart)


@lru_cache(maxsize=16)
def _model_sky(air: Atmosphere, band: Band) -> tuple[Floats, Floats]:
    """Return elevations, rad, dense at the horizon, and the radiance of a model atmosphere's clear sky there; read
    only. The result is cached, as each scene context needs it for reflections."""
    elevations = np.linspace(0, 1, 512) ** 2 * np.pi / 2
    table = elevations, air.sky(band, elevations)
    for column in table:
        column.setflags(write=False)
    return table


class Sky(Background):
    """Clear sky with cloud layers; without clouds and with one temperature it is uniform."""

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"preset": ("horizon_k", "zenith_k")}

    horizon_k: Kelvin = 288.0
    """Brightness temperature at the horizon, K."""
    zenith_k: Kelvin = 211.0
    """Brightness temperature at the zenith, K."""
    preset: ClimateName | None = None
    """Model atmosphere whose clear sky replaces the two temperatures, with the haze, altitude, rain and fog of the
    scenario's atmosphere."""
    clouds: Several[Clouds] = ()
    """Cloud layers."""

    @property
    def sky_preset(self) -> str | None:
        return self.preset

    def clear(self, context: SceneContext) -> ClearSky:
        """Return the layer behind all clouds."""
        air = None if self.preset is None else context.air.model_copy(update={"preset": self.preset})
        return ClearSky(context.band, self.horizon_k, self.zenith_k, air=air)

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        clouds = sorted(self.clouds, key=lambda layer: -layer.range_m)
        painted = [cloud.evolving(context) if cloud.evolve_s else cloud.layer(context) for cloud in clouds]
        return [self.clear(context), *attenuated_shells(painted, context)]

    def names(self) -> Names:
        for index, layer in enumerate(self.clouds):
            yield layer.id, ("clouds", index, "id")

    def parallax_surfaces(self) -> Surfaces:
        for index, cloud in enumerate(self.clouds):
            yield cloud.id, ("clouds", index), Sphere(cloud.range_m)
