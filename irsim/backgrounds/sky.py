"""Sky: a clear-sky gradient with elevation, and cloud layers before it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from statistics import NormalDist
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.air import through_air_around
from irsim.backgrounds.base import FARTHEST, Background, Layer, Names, Shells, ViewDirection
from irsim.backgrounds.blur import inner, margin_px
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.cloud import Look, Relief, slope_to_sun
from irsim.backgrounds.drifting import Drifting
from irsim.backgrounds.evolving import Evolving, first_of
from irsim.backgrounds.painting import Painting
from irsim.backgrounds.parallax import Sphere, Standing
from irsim.backgrounds.periodic import coarseness, shrunk
from irsim.backgrounds.texture import Tile, tile_shape, tile_side
from irsim.backgrounds.tiles import Tiled
from irsim.config.base import Name, Part, Several, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Degrees, Feature, Kelvin, KelvinSpread, NotNegative, Number, Range
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, Histogram, shaped, spectral
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.climate import ClimateName
from irsim.physics.radiometry import radiance
from irsim.types import Band, Floats

SCALE_SIN_ELEVATION = 0.3
"""Clear sky cools from horizon to zenith as exp(-sin(elevation)/0.3). Fitted by eye to 284, 269, 255,
230, 214 K at 1, 5, 10, 30, 90 degrees (US standard atmosphere, 8-12 um, LOWTRAN7): with 288 K at the
horizon and 211 K at the zenith it stays within 5 K of them."""

FIT_K = 5.0
"""How far that fit is off at most."""

COLUMN = 4096
"""Steps of the clear sky's table between zenith and nadir: 0.77 mrad, over which it bends by under 1 mK."""

Drift = Annotated[Number, Plausible(-1000, 1000, "mrad/s")]
"""Of a cloud: a gale of 30 m/s at 30 m."""


@dataclass(frozen=True, eq=False)
class ClearSky:
    """The opaque layer behind all clouds: its light depends on elevation only."""

    band: Band
    horizon_k: float
    zenith_k: float
    name: str = "clear_sky"
    range_m: float = FARTHEST
    air: Atmosphere | None = None
    """Where given, its light stands in place of the two temperatures."""

    def radiance(self, elevation_rad: Floats) -> Floats:
        """In-band radiance at an elevation; below the horizon it stays as at the horizon."""
        if self.air is not None:
            return np.interp(elevation_rad, *_model(self.air, self.band))
        share = np.exp(-np.maximum(np.sin(elevation_rad), 0) / SCALE_SIN_ELEVATION)
        return radiance(self.band, self.zenith_k + (self.horizon_k - self.zenith_k) * share)

    @cached_property
    def _column(self) -> Floats:
        """(COLUMN, 1) float32 from zenith to nadir."""
        return self.radiance(np.linspace(np.pi / 2, -np.pi / 2, COLUMN)).astype(np.float32)[:, None]

    def light(self, view_direction: ViewDirection) -> tuple[None, Floats]:
        return None, _seen(self, view_direction.chart)

    def over(self, chart: Chart) -> Floats:
        """(rows, cols) float32: what the pixels of a chart see."""
        elevation = chart.elevation_rad(chart.v)
        if elevation.min() > 0:  # smooth without the horizon's bend: 1 ms less for 640x512
            return chart.spread(self.radiance(elevation))
        rows = chart.spread((np.pi / 2 - elevation) / np.pi * (COLUMN - 1))
        return np.asarray(cv2.remap(self._column, np.zeros_like(rows), rows, cv2.INTER_LINEAR))


@lru_cache(maxsize=2)
def _seen(sky: ClearSky, chart: Chart) -> Floats:
    """`ClearSky.over`, kept for a camera that stands still."""
    return sky.over(chart)


@lru_cache(maxsize=16)
def _model(air: Atmosphere, band: Band) -> tuple[Floats, Floats]:
    """Elevations, rad, dense at the horizon, and a model atmosphere's radiance there; kept, as each stage asks anew for
    what bodies reflect of it. Read only."""
    elevations = np.linspace(0, 1, 512) ** 2 * np.pi / 2
    table = elevations, air.sky(band, elevations)
    for column in table:
        column.setflags(write=False)
    return table


class Clouds(Part):
    """A layer of cloud at its own range: it hides what is behind it, partly where it is thin."""

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"betas": ("beta",)}
    switches: ClassVar[Switches] = {
        "texture": ("texture_k", 0.0),
        "sunlit": ("sunlit_k", 0.0),
        "wind": ("wind_mrad_s", (0.0, 0.0)),
        "evolve": ("evolve_s", math.inf, 0.0),  # with 0 it is another cloud, which never changes
    }

    id: Name = "clouds"
    """Its name for --without."""
    coverage: Annotated[float, Field(ge=1e-6, lt=1)] = 0.4
    """Share of the sky that has cloud before it."""
    depth: NotNegative = 3.0
    """Optical depth for each standard deviation of the texture above the cloud's edge; 0 is no cloud."""
    temperature_k: Kelvin = 268.0
    """Temperature of the cloud, K."""
    texture_k: KelvinSpread = 2.0
    """Standard deviation of temperature within the cloud, K."""
    beta: Annotated[float, Field(ge=0, le=6)] = 3.3
    """Slope of the 2-D power spectrum f^-beta (real clouds: 2.9 to 4.1)."""
    correlation_mrad: Feature = 60.0
    """Size of the largest features, mrad."""
    stretch: Annotated[float, Field(ge=0.1, le=10)] = 2.0
    """How much wider than high features are."""
    range_m: Range = 5000.0
    """Distance of the layer from the camera's first place, m: targets farther away from there are behind it."""
    wind_mrad_s: Annotated[tuple[Drift, Drift], Field(strict=False)] = (0.0, 0.0)
    """Apparent motion, right and down, mrad/s."""
    betas: Betas | None = None
    """Slopes of the spectrum along x and along y, where they differ (real thin cloud: [2.7, 3.6]); in place of
    `beta`."""
    histogram: Histogram = ()
    """Thickness at evenly spaced shares of the sky, least to greatest, in any unit ([0, 0.1, 1]: few thick
    cores); Gaussian where empty."""
    evolve_s: NotNegative = 0.0
    """Seconds in which the texture changes to a correlation of 2/3; 0: it only drifts."""
    sunlit_k: KelvinSpread = 0.0
    """How much warmer edges that face the sun look at most, K (MWIR by day: 5 to 20)."""
    sun_deg: Degrees = -45.0
    """Where the sun stands in the picture: clockwise from up, degrees."""

    def layer(self, context: SceneContext) -> Standing:
        """The textures of transmittance and emission of a cloud that only drifts, ready to be sampled."""
        geometry = context.geometry
        shape = tile_shape(geometry.size)
        thickness, warmth = (
            spectral(
                shape, self.beta, self.betas, self._correlation_px(context), self.stretch, context.seed, self.id, what
            )
            for what in ("thickness", "warmth")
        )
        painted = self.paint(thickness, warmth, context)
        tiles = tuple(Tile.of(field, geometry.size, context.psf) for field in painted)
        return Standing(self.id, Sphere(self.range_m), Painting(tiles, self._drift_px_s(geometry.ifov_rad)))

    def paint(self, thickness: Floats, warmth: Floats, context: SceneContext) -> tuple[Floats, Floats]:
        """Transmittance and emission, before optics, of two periodic fields, (rows, columns), mean 0, variance 1."""
        (rows, columns), coarse = (slice(0, length) for length in thickness.shape), self._coarse(context)
        slope = self._slope(shaped(shrunk(thickness, coarse), self.histogram), context) if self.sunlit_k else None
        relief = None if slope is None else Relief.of(slope, coarse)
        lit = None if relief is None else relief.lit(rows, columns)
        return self._look(context).paint(shaped(thickness, self.histogram), warmth, lit)

    def evolving(self, context: SceneContext) -> Drifting:
        """The same of a cloud that changes with `evolve_s`, which must not be 0."""
        side = tile_side(context.geometry.size)
        margin = margin_px(context.psf, side)
        spectrum = self.beta, self.betas, self._correlation_px(context), self.stretch
        coarse = self._coarse(context)

        def small(pair: Floats) -> Floats:
            return first_of(pair, coarse)

        def sloping(pair: Floats) -> Floats:
            return self._slope(small(pair), context)

        aside = None if not self.sunlit_k else small if self.histogram else sloping
        fields = Evolving(side, *spectrum, context.seed, self.id, aside)
        look = self._look(context)

        def state_at(place: float) -> Tiled:
            mixture = fields.at(place)
            slope = mixture.aside
            if slope is not None and self.histogram:  # which no sum of other slopes has
                slope = self._slope(shaped(slope, self.histogram), context)
            relief = None if slope is None else Relief.of(slope, coarse)

            def paint(*tile: slice) -> tuple[Floats, Floats]:
                rows, columns = (slice(part.start - margin, part.stop + margin) for part in tile)
                lit = None if relief is None else relief.lit(rows, columns)
                thickness, warmth = mixture.over(rows, columns)
                passed, emitted = look.paint(shaped(thickness, self.histogram), warmth, lit)
                return inner(passed, context.psf, margin), inner(emitted, context.psf, margin)

            return Tiled(side, look.brightest, paint)

        drift = self._drift_px_s(context.geometry.ifov_rad)
        return Drifting(self.id, self.range_m, state_at, self.evolve_s, drift)

    def _drift_px_s(self, ifov_rad: float) -> tuple[float, float]:
        right, down = self.wind_mrad_s
        px_per_mrad = 1e-3 / ifov_rad
        return right * px_per_mrad, down * px_per_mrad

    def _correlation_px(self, context: SceneContext) -> float:
        return self.correlation_mrad * 1e-3 / context.geometry.ifov_rad

    def _look(self, context: SceneContext) -> Look:
        kelvin = self.temperature_k, self.texture_k, self.sunlit_k
        return Look.of(self._edge, self.depth, kelvin, context.band)

    @property
    def _edge(self) -> float:
        """The thickness above which there is cloud."""
        if self.histogram:
            return float(shaped(np.array([NormalDist().inv_cdf(1 - self.coverage)]), self.histogram)[0])
        return NormalDist().inv_cdf(1 - self.coverage)

    def _slope(self, small: Floats, context: SceneContext) -> Floats:
        """Towards the sun, of a thickness that was made smaller by `_coarse`."""
        return slope_to_sun(small, self._smoothed_px(context) / self._coarse(context), self.sun_deg)

    def _smoothed_px(self, context: SceneContext) -> float:
        """What is smaller is not lit by itself."""
        return max(self._correlation_px(context) / 40, 1.0)

    def _coarse(self, context: SceneContext) -> int:
        """How many times smaller the cloud's relief may be worked out."""
        return coarseness(self._smoothed_px(context), min(tile_shape(context.geometry.size)))


class Sky(Background):
    """Clear sky with cloud layers; with no clouds and one temperature it is flat."""

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"preset": ("horizon_k", "zenith_k")}

    horizon_k: Kelvin = 288.0
    """Brightness temperature at the horizon, K."""
    zenith_k: Kelvin = 211.0
    """Brightness temperature at the zenith, K."""
    preset: ClimateName | None = None
    """Model atmosphere whose clear sky it is, in place of the two temperatures; with the haze, altitude, rain
    and fog of the scenario's atmosphere."""
    clouds: Several[Clouds] = ()
    """Cloud layers."""

    @property
    def sky_preset(self) -> str | None:
        return self.preset

    def clear(self, context: SceneContext) -> ClearSky:
        """What is behind all clouds."""
        air = None if self.preset is None else context.air.model_copy(update={"preset": self.preset})
        return ClearSky(context.band, self.horizon_k, self.zenith_k, air=air)

    def layers(self, context: SceneContext) -> Sequence[Layer]:
        clouds = sorted(self.clouds, key=lambda layer: -layer.range_m)
        painted = [cloud.evolving(context) if cloud.evolve_s else cloud.layer(context) for cloud in clouds]
        return [self.clear(context), *through_air_around(painted, context)]

    def names(self) -> Names:
        for index, layer in enumerate(self.clouds):
            yield layer.id, ("clouds", index, "id")

    def shells(self) -> Shells:
        for index, cloud in enumerate(self.clouds):
            yield cloud.id, ("clouds", index), Sphere(cloud.range_m)
