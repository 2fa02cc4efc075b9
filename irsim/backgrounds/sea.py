"""The sea under a sky: waves that travel, the sky's reflection in them, and the sun's glint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.above import above
from irsim.backgrounds.air import Below
from irsim.backgrounds.base import FARTHEST, ClearLayer, LandLight, Layer, ViewDirection
from irsim.backgrounds.blur import softened
from irsim.backgrounds.sky import Sky
from irsim.backgrounds.waves import TILE, Octave, longest_wave, mixed, padded, sampled
from irsim.config.base import Switches
from irsim.config.quantities import Degrees, Fraction, Height, Kelvin, Number
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import spectral
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.radiometry import limits, radiance
from irsim.types import Band, Floats

INDEX = {4.0: (1.351, 0.0046), 10.0: (1.218, 0.0508)}
"""Complex refractive index (n, k) of water at wavelengths in um (Hale and Querry 1973, table I)."""

SUN_K, SUN_SR = 5772.0, 6.8e-5
"""The sun as a black body (IAU 2015) and its solid angle."""

BANDS = 6
"""Octaves of waves that are drawn, from the longest; shorter ones roughen the surface within a pixel."""

OCTAVES = 12
"""Octaves that share the slopes' variance alike: from tens of metres to centimetres."""

LEAST_WIND = 1.0
"""m/s: Cox and Munk photographed seas in winds of 1 to 14 m/s (J. Marine Research 13 (1954) 198, abstract). Below, the
slopes' variance falls with the wind to none: the constant in their line, 0.003, was never measured in a calm."""

SHORTEST_M = 1e-3
"""A longest wave below this, in winds under 0.035 m/s, is not drawn: no camera tells it from roughness."""

LEAST_VARIANCE = 1e-5
"""Of the slopes in which the sun glints: the sun itself is so wide, 0.27 degrees to either side of its middle."""

GUST_M = 400.0
"""Size of the largest gusts."""

STEPS = 4096
"""Of the tables of angle."""


def reflectance(band: Band, grazing_rad: Floats) -> Floats:
    """Of smooth water for unpolarised light at a grazing angle (Fresnel), 0..1."""
    low, high = limits(band)
    n, k = INDEX[min(INDEX, key=lambda um: abs(um - (low + high) / 2))]
    cosine = np.sin(grazing_rad) + 0j
    inner = np.sqrt((n + 1j * k) ** 2 - 1 + cosine**2)
    across = (cosine - inner) / (cosine + inner)
    along = ((n + 1j * k) ** 2 * cosine - inner) / ((n + 1j * k) ** 2 * cosine + inner)
    return np.asarray((np.abs(across) ** 2 + np.abs(along) ** 2) / 2)


def slope_variance(wind_m_s: float) -> float:
    """Mean square slope of the sea, both axes together, at a wind at 12.5 m height (Cox and Munk 1954); 0 at none."""
    return (0.003 + 0.00512 * max(wind_m_s, LEAST_WIND)) * min(wind_m_s / LEAST_WIND, 1.0)


def facing(mean: Floats, variance: Floats) -> tuple[Floats, Floats]:
    """Of facets at grazing angles (rad) spread by a Gaussian: the mean of those that are seen, and the share of the
    variance that is left of them.

    Each is seen by the area it turns to the camera, so by its grazing angle g: none that leans away beyond the line of
    sight, and the more of one the more it leans to the camera (Saunders, J. Geophysical Research 72 (1967) 4643; Ross,
    Dion and Potvin, J. Optical Society of America A 22 (2005) 2442). E[g^2] / E[g] of g > 0, within 12 % where the mean
    is not below -spread, and the share within 0.06 where it is above 0: sqrt(pi / 2) spreads and 0.43 where it is 0.
    """
    seen = (mean + np.sqrt(mean * mean + 2 * np.pi * variance)) / 2
    square = seen * seen
    return np.asarray(seen), np.asarray(square / (square + 2 * variance))


def sunlight(band: Band, air: Atmosphere, elevation_deg: float) -> float:
    """In-band irradiance of the sun at an elevation, on a plane across its rays at the sea's level, W/m2."""
    outside = float(radiance(band, SUN_K)) * SUN_SR
    if air.is_clear:
        return outside
    sea_level = air.model_copy(update={"altitude_m": 0.0})
    return outside * float(sea_level.transmittance_to_space(band, math.radians(elevation_deg)))


SunPlace = Annotated[tuple[Number, Annotated[float, Field(ge=0, le=90)]], Field(strict=False)]
"""Azimuth and elevation, degrees: a sun below the horizon lights no wave."""


class Sea(Sky):
    """The sea to the horizon under a sky; with `wind_m_s: 0` it is a mirror."""

    camera_height_m: Height = 15.0
    """Height of the camera above the water, m."""
    water_k: Kelvin = 288.0
    """Temperature of the water, K."""
    wind_m_s: Annotated[float, Field(ge=0, le=25)] = 6.0
    """Wind, m/s: it makes the waves' slopes and the length of the longest."""
    wind_deg: Degrees = 200.0
    """Where the waves run: clockwise from straight away from the camera, degrees."""
    gusts: Fraction = 0.1
    """Standard deviation of the slopes from place to place and time to time, as a share of their mean: at 0.1 as in a
    wind that is a fifth stronger or weaker."""
    sun_deg: SunPlace | None = None
    """[azimuth right of the first pointing, elevation] of a sun that glints, degrees; none where not given. The
    scenario's atmosphere weakens its light down to the water and on to the camera; without one it is as in space."""

    switches: ClassVar[Switches] = {"waves": ("wind_m_s", 0.0), "gusts": ("gusts", 0.0), "sun": ("sun_deg", None)}
    surface: ClassVar[str] = "sea"

    @property
    def surface_m(self) -> float:
        return self.camera_height_m

    def altitude_m(self, given: float) -> float:
        return self.camera_height_m

    def _below(self, sky: ClearLayer, context: SceneContext) -> float:
        return float(radiance(context.band, self.water_k))

    @property
    def bare(self) -> Sea:
        return self.model_copy(update={"clouds": ()})

    def land(self, context: SceneContext) -> LandLight:
        water = SeaSurface(self, self.clear(context), context)
        return lambda view_direction: water.light(view_direction)[1][water.sky_left(view_direction) == 0]

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        _, *clouds = super().layers(context)
        water = SeaSurface(self, self.clear(context), context)
        return [water, *above(clouds, water)]


class SeaSurface:
    """The opaque layer: the clear sky, and the sea below the horizon."""

    name = "sea"
    range_m = FARTHEST

    def __init__(self, sea: Sea, sky: ClearLayer, context: SceneContext) -> None:
        self._sea, self._sky, self._stage = sea, sky, context
        self._column = None if context.air.is_clear else Below.to(context, sea.camera_height_m)
        octaves = range(BANDS if longest_wave(sea.wind_m_s) >= SHORTEST_M else 0)
        self._waves = [Octave(sea.wind_m_s, sea.wind_deg, number, context.seed) for number in octaves]
        self._gusts = padded(spectral((TILE, TILE), 3.0, None, TILE / 8, 1.0, context.seed, "gusts"))
        angles = np.linspace(0, np.pi / 2, STEPS)
        self._reflected = reflectance(context.band, angles).astype(np.float32)[:, None]
        water = radiance(context.band, sea.water_k)
        self._beyond_water = (sky.radiance(angles) - water).astype(np.float32)[:, None]
        self._sunlight = 0.0 if sea.sun_deg is None else sunlight(context.band, context.air, sea.sun_deg[1])

    def sky_left(self, view_direction: ViewDirection) -> Floats:
        """(rows, cols): the share of each pixel above the horizon."""
        chart = view_direction.chart
        edge = chart.spread(self._stage.geometry.elevation_rad / self._stage.geometry.ifov_rad - chart.v)
        soft = max(self._stage.psf_px, 0.3)
        return np.asarray(np.clip(edge / (2.5 * soft) + 0.5, 0, 1), dtype=np.float32)

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        above = self._sky.light(view_direction)[1]
        left = self.sky_left(view_direction)
        rows = np.flatnonzero(left.min(axis=1) < 1)
        if not len(rows):
            return None, above
        seen = slice(rows[0], None)
        light = above.copy()
        light[seen] = above[seen] * left[seen] + (1 - left[seen]) * self._water(view_direction, seen)
        return None, light

    def _water(self, view_direction: ViewDirection, seen: slice) -> Floats:
        """Radiance of the rows `seen`, drawn as if they were all water."""
        sea, geometry, chart = self._sea, self._stage.geometry, view_direction.chart
        unit = geometry.ifov_rad
        azimuth = (chart.spread(chart.u)[seen] * np.float32(unit / np.cos(geometry.elevation_rad))).astype(np.float32)
        down = np.maximum(chart.spread(chart.v)[seen] * np.float32(unit) - np.float32(geometry.elevation_rad), unit / 4)
        x, y, z = view_direction.place
        distance = max(sea.camera_height_m - y, 0.1) / np.tan(down)
        right = (distance * np.sin(azimuth) + x).astype(np.float32)
        ahead = (distance * np.cos(azimuth) + z).astype(np.float32)
        footprint = distance * unit / np.sin(down)  # of a pixel, along the line of sight, m
        across, along, drawn, variance = self._slopes(right, ahead, footprint, view_direction.time)
        rest = variance * (1 - drawn)
        # The slopes of drawn waves, as facets that are seen have them: what is left of all slopes' spread, and a lean
        # towards the camera, go to drawn waves and to finer ones by their share of the variance. So the mean is the
        # same however much of it is drawn.
        whole, left = facing(down, variance)
        leaning = along * np.sqrt(1 - drawn * (1 - left)) + drawn * (whole - down)
        grazing, left = facing(down + leaning, rest)
        spread = np.sqrt(rest * left)
        water = np.float32(radiance(self._stage.band, sea.water_k))
        # Half the finer facets lean one spread to either side: the mean of what is so bent as reflectance.
        light = water + (self._mirrored(grazing + spread, down) + self._mirrored(grazing - spread, down)) / 2
        if sea.sun_deg is not None:
            light = light + self._glint(azimuth, down, across, along, rest)
        if self._column is not None:
            tau, path = self._column.at(down)
            light = tau * light + path
        return softened(np.asarray(light, dtype=np.float32), self._stage.psf)

    def _mirrored(self, grazing: Floats, down: Floats) -> Floats:
        """What facets at a grazing angle, seen `down` below the horizon, are brighter by than the water. Those that
        mirror other water show what that mirrors in turn, taken for the sky at the horizon."""
        return _looked_up(self._reflected, grazing) * _looked_up(self._beyond_water, np.maximum(2 * grazing - down, 0))

    def _slopes(
        self, right: Floats, ahead: Floats, footprint: Floats, time: float
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Slopes to the right and towards the camera, the share of their variance that is drawn, and that variance of
        each axis, with what is too fine to be drawn."""
        variance = slope_variance(self._sea.wind_m_s) / 2
        drawn = np.zeros_like(right)
        whole = np.full_like(right, variance)
        slopes = [np.zeros_like(right), np.zeros_like(right)]
        for waves in self._waves:
            seen = _resolved(footprint, waves.length_m)
            drawn += cv2.multiply(seen, seen, scale=1 / OCTAVES)
            seen *= np.float32(math.sqrt(variance / OCTAVES))
            for slope, wave in zip(slopes, waves.at(right, ahead, time), strict=True):
                slope += cv2.multiply(seen, wave, dst=wave)
        if self._sea.gusts and self._waves:
            # They run with the wind, and a pixel resolves them as it does waves.
            period = GUST_M * 8
            angle = math.radians(self._sea.wind_deg)
            run = self._sea.wind_m_s * time / period
            gust = sampled(
                self._gusts,
                mixed(right, 1 / period, ahead, 0, -run * math.sin(angle)),
                mixed(right, 0, ahead, 1 / period, -run * math.cos(angle)),
            )
            factor = cv2.multiply(gust, _resolved(footprint, GUST_M), scale=self._sea.gusts)
            factor = np.maximum(1 + factor, 0.1)
            slopes = [slope * factor for slope in slopes]
            whole *= factor**2
        return slopes[0], slopes[1], drawn, whole

    def _glint(self, azimuth: Floats, down: Floats, across: Floats, along: Floats, rest: Floats) -> Floats:
        """Radiance, W/m2/sr, of the sun in facets too fine to be drawn: rho E p(slope) / (4 sin d cos^4 tilt), with
        rho at the angle at which the facet that mirrors the sun to the camera is struck (Cox and Munk 1954)."""
        assert self._sea.sun_deg is not None
        where, height = (math.radians(angle) for angle in self._sea.sun_deg)
        # Half way between the directions to the sun and to the camera stands the facet's normal: along the sum of
        # the two unit vectors, whose length is twice the sine of the light's grazing angle at the facet.
        right = math.cos(height) * math.sin(where) - np.cos(down) * np.sin(azimuth)
        ahead = math.cos(height) * math.cos(where) - np.cos(down) * np.cos(azimuth)
        up = math.sin(height) + np.sin(down)
        tilt_right, tilt_near = -right / up, ahead / up
        rest = np.maximum(rest, LEAST_VARIANCE)
        density = np.exp(-((tilt_right - across) ** 2 + (tilt_near - along) ** 2) / (2 * rest)) / (2 * np.pi * rest)
        grazing = np.arcsin(np.minimum(np.sqrt(right**2 + ahead**2 + up**2) / 2, 1))
        bounce = _looked_up(self._reflected, grazing)
        steep = (1 + tilt_right**2 + tilt_near**2) ** 2
        # Facets hide each other at grazing angles: what is seen of them does not grow beyond their spread.
        seen = np.sin(down) + 0.5 * math.sqrt(max(slope_variance(self._sea.wind_m_s) / 2, LEAST_VARIANCE))
        return np.asarray(bounce * self._sunlight * density * steep / (4 * seen), dtype=np.float32)


def _resolved(footprint: Floats, length_m: float) -> Floats:
    """How much a pixel of a footprint (m) resolves of what is so long."""
    ratio = footprint * np.float32(2 / length_m)
    ratio *= ratio
    ratio += 1
    return np.asarray(np.divide(1, ratio, out=ratio))


def _looked_up(table: Floats, angle: Floats) -> Floats:
    """A table over 0 .. pi/2 at angles (rows, cols)."""
    rows = (angle * ((STEPS - 1) / (np.pi / 2))).astype(np.float32, copy=False)
    np.minimum(rows, STEPS - 1, out=rows)
    return np.asarray(cv2.remap(table, np.zeros_like(rows), rows, cv2.INTER_LINEAR))
