"""Sea under a sky: travelling waves, the reflected sky, and sun glint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.air import GroundAirTable
from irsim.backgrounds.base import FARTHEST, ClearLayer, GroundRadiance, Layer, ViewDirection
from irsim.backgrounds.layers import masked_clouds
from irsim.backgrounds.sky import Sky
from irsim.backgrounds.texture import blurred, closed
from irsim.backgrounds.waves import TILE, WaveOctave, longest_wave, sampled, weighted_sum
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

DRAWN_OCTAVES = 6
"""Number of octaves of waves that are drawn, from the longest; shorter waves are surface roughness within a pixel."""

OCTAVES = 12
"""Number of octaves of waves, with equal shares of the slope variance, from tens of metres to centimetres."""

LEAST_WIND = 1.0
"""Least wind speed of the fit of `slope_variance`, m/s: Cox and Munk photographed seas in winds of 1 to 14 m/s (J.
Marine Research 13 (1954) 198, abstract). Below it, the slope variance falls linearly to 0, as the constant of their
fit, 0.003, was never measured in a calm."""

SHORTEST_M = 1e-3
"""Least length of the longest wave for waves to be drawn, m; below it, at winds under 0.035 m/s, waves are
roughness."""

LEAST_VARIANCE = 1e-5
"""Least slope variance for the glint; in a mirror the sun would be a disc of 0.27 degrees radius."""

GUST_M = 400.0
"""Size of the largest gusts, m."""

ANGLE_STEPS = 4096
"""Steps of the tables of angle."""


def reflectance(band: Band, grazing_rad: Floats) -> Floats:
    """Return the reflectance of smooth water for unpolarised light at a grazing angle (Fresnel), 0..1."""
    low, high = limits(band)
    n, k = INDEX[min(INDEX, key=lambda um: abs(um - (low + high) / 2))]
    cosine = np.sin(grazing_rad) + 0j
    inner = np.sqrt((n + 1j * k) ** 2 - 1 + cosine**2)
    across = (cosine - inner) / (cosine + inner)
    along = ((n + 1j * k) ** 2 * cosine - inner) / ((n + 1j * k) ** 2 * cosine + inner)
    return np.asarray((np.abs(across) ** 2 + np.abs(along) ** 2) / 2)


def slope_variance(wind_m_s: float) -> float:
    """Return the mean square slope of the sea, both axes together, by the wind at 12.5 m height (Cox and Munk 1954)."""
    return (0.003 + 0.00512 * max(wind_m_s, LEAST_WIND)) * min(wind_m_s / LEAST_WIND, 1.0)


def visible_facets(mean: Floats, variance: Floats) -> tuple[Floats, Floats]:
    """Return the mean grazing angle of the visible facets, rad, and its variance over them as a share of `variance`.

    mean, variance: of the Gaussian distribution of grazing angles g of all facets, rad. The visibility of a facet is
    proportional to its projected area, so to g if g > 0 (Saunders, J. Geophysical Research 72 (1967) 4643; Ross, Dion
    and Potvin, J. Optical Society of America A 22 (2005) 2442). The returned mean is within 12 % of E[g^2] / E[g] for
    means above -sigma, and the returned share is exact within 0.06 for means above 0; for mean 0 they are sqrt(pi / 2)
    sigma and 0.43.
    """
    seen = (mean + np.sqrt(mean * mean + 2 * np.pi * variance)) / 2
    square = seen * seen
    return np.asarray(seen), np.asarray(square / (square + 2 * variance))


def sunlight(band: Band, air: Atmosphere, elevation_deg: float) -> float:
    """Return the in-band irradiance of the sun, normal to its rays at sea level, W/m2."""
    outside = float(radiance(band, SUN_K)) * SUN_SR
    if air.is_clear:
        return outside
    sea_level = air.model_copy(update={"altitude_m": 0.0})
    return outside * float(sea_level.transmittance_to_space(band, math.radians(elevation_deg)))


SunPlace = Annotated[tuple[Number, Annotated[float, Field(ge=0, le=90)]], Field(strict=False)]
"""Azimuth and elevation, degrees; the sun is above the horizon."""


class Sea(Sky):
    """Sea to the horizon under a sky; with `wind_m_s: 0` it is a mirror."""

    camera_height_m: Height = 15.0
    """Height of the camera above the water, m."""
    water_k: Kelvin = 288.0
    """Temperature of the water, K."""
    wind_m_s: Annotated[float, Field(ge=0, le=25)] = 6.0
    """Wind speed, m/s; it sets the slopes of the waves and the length of the longest one."""
    wind_deg: Degrees = 200.0
    """Direction in which the waves run: clockwise from straight ahead of the camera, degrees."""
    gusts: Fraction = 0.1
    """Standard deviation, in space and time, of the rms slope of the waves, as a share of its mean; 0.1 corresponds to
    gusts of a fifth of the wind speed."""
    sun_deg: SunPlace | None = None
    """[azimuth right of the first pointing, elevation] of the sun, degrees. Default: no sun glint. The atmosphere
    attenuates sunlight on its way to the water and to the camera."""

    switches: ClassVar[Switches] = {"waves": ("wind_m_s", 0.0), "gusts": ("gusts", 0.0), "sun": ("sun_deg", None)}
    surface: ClassVar[str] = "sea"

    @property
    def surface_m(self) -> float:
        return self.camera_height_m

    def altitude_m(self, given: float) -> float:
        return self.camera_height_m

    def _ground_light(self, sky: ClearLayer, context: SceneContext) -> float:
        return float(radiance(context.band, self.water_k))

    @property
    def bare(self) -> Sea:
        return self.model_copy(update={"clouds": ()})

    def ground_radiance(self, context: SceneContext) -> GroundRadiance:
        water = SeaSurface(self, self.clear(context), context)
        return lambda view_direction: water.light(view_direction)[1][water.sky_share(view_direction) == 0]

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        _, *clouds = super().layers(context)
        water = SeaSurface(self, self.clear(context), context)
        return [water, *masked_clouds(clouds, water)]


class SeaSurface:
    """Opaque layer: the clear sky, and the sea below the horizon."""

    name = "sea"
    range_m = FARTHEST

    def __init__(self, sea: Sea, sky: ClearLayer, context: SceneContext) -> None:
        self._sea, self._sky, self._context = sea, sky, context
        self._air = None if context.air.is_clear else GroundAirTable.to(context, sea.camera_height_m)
        octaves = range(DRAWN_OCTAVES if longest_wave(sea.wind_m_s) >= SHORTEST_M else 0)
        self._waves = [WaveOctave(sea.wind_m_s, sea.wind_deg, number, context.seed) for number in octaves]
        self._gusts = closed(
            np.asarray(spectral((TILE, TILE), 3.0, None, TILE / 8, 1.0, context.seed, "gusts"), np.float32)
        )
        angles = np.linspace(0, np.pi / 2, ANGLE_STEPS)
        self._reflectance = reflectance(context.band, angles).astype(np.float32)[:, None]
        water = radiance(context.band, sea.water_k)
        self._sky_excess = (sky.radiance(angles) - water).astype(np.float32)[:, None]
        self._sunlight = 0.0 if sea.sun_deg is None else sunlight(context.band, context.air, sea.sun_deg[1])

    def sky_share(self, view_direction: ViewDirection) -> Floats:
        """Return the share of each pixel above the horizon, (rows, cols)."""
        chart = view_direction.chart
        edge = chart.at_pixels(self._context.geometry.elevation_rad / self._context.geometry.ifov_rad - chart.v)
        soft = max(self._context.psf_px, 0.3)
        return np.asarray(np.clip(edge / (2.5 * soft) + 0.5, 0, 1), dtype=np.float32)

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        above = self._sky.light(view_direction)[1]
        left = self.sky_share(view_direction)
        rows = np.flatnonzero(left.min(axis=1) < 1)
        if not len(rows):
            return None, above
        seen = slice(rows[0], None)
        light = above.copy()
        light[seen] = above[seen] * left[seen] + (1 - left[seen]) * self._water(view_direction, seen)
        return None, light

    def _water(self, view_direction: ViewDirection, seen: slice) -> Floats:
        """Return the radiance of the image rows `seen`, all taken as water."""
        sea, geometry, chart = self._sea, self._context.geometry, view_direction.chart
        unit = geometry.ifov_rad
        azimuth = (chart.at_pixels(chart.u)[seen] * np.float32(unit / np.cos(geometry.elevation_rad))).astype(
            np.float32
        )
        down = np.maximum(
            chart.at_pixels(chart.v)[seen] * np.float32(unit) - np.float32(geometry.elevation_rad), unit / 4
        )
        x, y, z = view_direction.place
        distance = max(sea.camera_height_m - y, 0.1) / np.tan(down)
        right = (distance * np.sin(azimuth) + x).astype(np.float32)
        ahead = (distance * np.cos(azimuth) + z).astype(np.float32)
        footprint = distance * unit / np.sin(down)  # footprint of a pixel along the line of sight, m
        across, along, drawn, variance = self._slopes(right, ahead, footprint, view_direction.time)
        rest = variance * (1 - drawn)
        # Slopes of the visible facets: the reduced variance and the mean tilt towards the camera are divided among
        # drawn and finer waves by their share of the variance. So the mean does not depend on the drawn share.
        whole, left = visible_facets(down, variance)
        leaning = along * np.sqrt(1 - drawn * (1 - left)) + drawn * (whole - down)
        grazing, left = visible_facets(down + leaning, rest)
        spread = np.sqrt(rest * left)
        water = np.float32(radiance(self._context.band, sea.water_k))
        # The non-linear reflectance is averaged over two tilts of the finer facets, one sigma to either side.
        light = (
            water
            + (self._reflected_excess(grazing + spread, down) + self._reflected_excess(grazing - spread, down)) / 2
        )
        if sea.sun_deg is not None:
            light = light + self._glint(azimuth, down, across, along, rest)
        if self._air is not None:
            tau, path = self._air.at(down)
            light = tau * light + path
        return blurred(np.asarray(light, dtype=np.float32), self._context.psf)

    def _reflected_excess(self, grazing: Floats, down: Floats) -> Floats:
        """Return the radiance of facets minus the water's, at a grazing angle and `down` below the horizon.

        Facets that mirror other water show a second reflection, approximated by the sky at the horizon.
        """
        return _from_table(self._reflectance, grazing) * _from_table(
            self._sky_excess, np.maximum(2 * grazing - down, 0)
        )

    def _slopes(
        self, right: Floats, ahead: Floats, footprint: Floats, time: float
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Return slopes to the right and towards the camera, the share of their variance in drawn waves, and the total
        variance of each axis."""
        variance = slope_variance(self._sea.wind_m_s) / 2
        drawn = np.zeros_like(right)
        whole = np.full_like(right, variance)
        slopes = [np.zeros_like(right), np.zeros_like(right)]
        for waves in self._waves:
            seen = _modulation(footprint, waves.length_m)
            drawn += cv2.multiply(seen, seen, scale=1 / OCTAVES)
            seen *= np.float32(math.sqrt(variance / OCTAVES))
            for slope, wave in zip(slopes, waves.at(right, ahead, time), strict=True):
                slope += cv2.multiply(seen, wave, dst=wave)
        if self._sea.gusts and self._waves:
            # Gusts move with the wind, and pixels resolve them like waves.
            period = GUST_M * 8
            angle = math.radians(self._sea.wind_deg)
            run = self._sea.wind_m_s * time / period
            gust = sampled(
                self._gusts,
                weighted_sum(right, 1 / period, ahead, 0, -run * math.sin(angle)),
                weighted_sum(right, 0, ahead, 1 / period, -run * math.cos(angle)),
            )
            factor = cv2.multiply(gust, _modulation(footprint, GUST_M), scale=self._sea.gusts)
            factor = np.maximum(1 + factor, 0.1)
            slopes = [slope * factor for slope in slopes]
            whole *= factor**2
        return slopes[0], slopes[1], drawn, whole

    def _glint(self, azimuth: Floats, down: Floats, across: Floats, along: Floats, rest: Floats) -> Floats:
        """Return the radiance, W/m2/sr, of the sun in facets too fine to be drawn: rho E p(slope) / (4 sin d cos^4
        tilt), with rho at the incidence angle of the facet that mirrors the sun to the camera (Cox and Munk 1954)."""
        assert self._sea.sun_deg is not None
        where, height = (math.radians(angle) for angle in self._sea.sun_deg)
        # The facet's normal bisects the directions to the sun and to the camera: it lies along the sum of the two
        # unit vectors, whose length is twice the sine of the grazing angle at the facet.
        right = math.cos(height) * math.sin(where) - np.cos(down) * np.sin(azimuth)
        ahead = math.cos(height) * math.cos(where) - np.cos(down) * np.cos(azimuth)
        up = math.sin(height) + np.sin(down)
        tilt_right, tilt_near = -right / up, ahead / up
        rest = np.maximum(rest, LEAST_VARIANCE)
        density = np.exp(-((tilt_right - across) ** 2 + (tilt_near - along) ** 2) / (2 * rest)) / (2 * np.pi * rest)
        grazing = np.arcsin(np.minimum(np.sqrt(right**2 + ahead**2 + up**2) / 2, 1))
        bounce = _from_table(self._reflectance, grazing)
        steep = (1 + tilt_right**2 + tilt_near**2) ** 2
        # Half a slope sigma is added to sin d, as facets shadow each other: it bounds the glint at grazing angles.
        seen = np.sin(down) + 0.5 * math.sqrt(max(slope_variance(self._sea.wind_m_s) / 2, LEAST_VARIANCE))
        return np.asarray(bounce * self._sunlight * density * steep / (4 * seen), dtype=np.float32)


def _modulation(footprint: Floats, length_m: float) -> Floats:
    """Return the share of the amplitude, 0..1, that waves `length_m` long keep in pixels with a `footprint`, m."""
    ratio = footprint * np.float32(2 / length_m)
    ratio *= ratio
    ratio += 1
    return np.asarray(np.divide(1, ratio, out=ratio))


def _from_table(table: Floats, angle: Floats) -> Floats:
    """Return the values of a table over angles 0 .. pi/2 at `angle`, rad, (rows, cols)."""
    rows = (angle * ((ANGLE_STEPS - 1) / (np.pi / 2))).astype(np.float32, copy=False)
    np.minimum(rows, ANGLE_STEPS - 1, out=rows)
    return np.asarray(cv2.remap(table, np.zeros_like(rows), rows, cv2.INTER_LINEAR))
