"""Cloud layers: random thickness and temperature, and their shading to transmittance and emission."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.backgrounds.cloud_drift import EvolvingCloud
from irsim.backgrounds.cloud_evolution import CloudState, EvolvingFields, first_of
from irsim.backgrounds.panorama import PanoramicLayer, Sphere
from irsim.backgrounds.texture import (
    DriftingTextures,
    PeriodicTexture,
    blur_margin_px,
    blurred_inner,
    coarseness,
    enlarged,
    periodic_gaussian,
    shrunk,
    tile_shape,
    tile_side,
)
from irsim.config.base import Name, Part, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Degrees, Feature, Kelvin, KelvinSpread, NotNegative, Number, Range
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import Betas, Histogram, spectral, with_histogram
from irsim.physics.radiometry import radiance
from irsim.rng import lookup
from irsim.types import Band, Floats

EXTREME = 6.0
"""Largest deviation in the radiance table, in standard deviations of temperature; larger ones, one in 1e9, are
clamped."""

ENTRIES = 2**16
"""Entries of the radiance table; 16-bit indices are fastest. A step is 0.18 mK per K of standard deviation."""

STEP = (ENTRIES - 1) / (2 * EXTREME)
"""Number of table entries per standard deviation."""

Drift = Annotated[Number, Plausible(-1000, 1000, "mrad/s")]
"""Apparent motion of a cloud, mrad/s: up to that of a gale of 30 m/s at a distance of 30 m."""


@dataclass(frozen=True, eq=False)
class CloudShading:
    """Conversion of a cloud's random fields to transmittance and emission."""

    edge: float
    """Thickness above which there is cloud."""
    depth: float
    """Optical depth per unit of thickness above the edge."""
    glow: Floats
    """(ENTRIES,) float32: in-band radiance, W/m2/sr, of temperature deviations from -EXTREME to EXTREME."""
    sunlit: float
    """Radiance that full sunlight adds to thin cloud, W/m2/sr."""

    @classmethod
    def of(cls, edge: float, depth: float, kelvin: tuple[float, float, float], band: Band) -> CloudShading:
        """Return the shading; kelvin: mean temperature of the cloud, its standard deviation, and the rise in
        sunlight."""
        mean, spread, sunlit = kelvin
        warm = np.maximum(mean + spread * np.linspace(-EXTREME, EXTREME, ENTRIES), 1.0)
        dark, lit = radiance(band, np.array([mean, mean + sunlit]))
        return cls(edge, depth, radiance(band, warm).astype(np.float32), float(lit - dark))

    @property
    def brightest(self) -> float:
        """Upper bound of the radiance, W/m2/sr."""
        return float(self.glow.max()) + self.sunlit

    def paint(self, thickness: Floats, warmth: Floats, lit: Floats | None) -> tuple[Floats, Floats]:
        """Return transmittance and emission, before optics, (rows, cols) float32 each.

        thickness, warmth: parts of random fields of mean 0 and variance 1. lit: share of full sunlight, None without
        sun.
        """
        middle = (ENTRIES - 1) / 2
        if COMPILED:
            thickness, warmth = np.ascontiguousarray(thickness), np.ascontiguousarray(warmth)
            transmittance, light = np.empty_like(thickness), np.empty_like(thickness)
            sun, look = None if lit is None else np.ascontiguousarray(lit), (self.edge, self.depth, self.sunlit)
            kernels.cloud(thickness, warmth, sun, *look, self.glow, STEP, middle, transmittance, light)
            return transmittance, light
        above = np.maximum(thickness - np.float32(self.edge), 0)
        transmittance = np.exp(np.float32(-self.depth) * above)
        places = warmth * np.float32(STEP) + np.float32(middle)
        np.clip(np.rint(places, out=places), 0, ENTRIES - 1, out=places)
        light = lookup(self.glow, places.astype(np.uint16))
        if lit is not None:
            light += np.float32(self.sunlit) * np.clip(lit, 0, 1) * np.exp(-above)
        light *= 1 - transmittance
        return transmittance, light


def sunlit_share(slope: Floats) -> Floats:
    """Return the share of full sunlight, float32, on a cloud by the `slope` of its thickness towards the sun.

    The cloud's surface is taken as high as the cloud is thick. By Lambert's cosine law with the sun at the side, the
    share is proportional to the slope, and 1 at twice the rms slope; it is not clipped to 0..1.
    """
    rms = cv2.norm(slope) / math.sqrt(slope.size)  # periodic differences have mean 0
    return slope / np.float32(2 * rms + 1e-12)


def slope_to_sun(thickness: Floats, sigma_px: float, sun_deg: float) -> Floats:
    """Return the downward slope of a periodic thickness (rows, columns) towards the sun, float32, linear in the
    thickness.

    sigma_px: of the Gaussian that smooths the thickness first. sun_deg: direction of the sun, clockwise from up.
    """
    smooth = periodic_gaussian(thickness, sigma_px)
    angle = np.radians(sun_deg)
    across = np.roll(smooth, -1, axis=1) - np.roll(smooth, 1, axis=1)
    down = np.roll(smooth, -1, axis=0) - np.roll(smooth, 1, axis=0)
    return np.asarray(float(np.cos(angle)) * down - float(np.sin(angle)) * across)  # the sun is at (sin, -cos), y down


class Clouds(Part):
    """Cloud layer at its own range: it hides the layers behind it, partly where it is thin."""

    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"betas": ("beta",)}
    switches: ClassVar[Switches] = {
        "texture": ("texture_k", 0.0),
        "sunlit": ("sunlit_k", 0.0),
        "wind": ("wind_mrad_s", (0.0, 0.0)),
        "evolve": ("evolve_s", math.inf, 0.0),  # 0 s would give another cloud, which never changes
    }

    id: Name = "clouds"
    """Name for --without."""
    coverage: Annotated[float, Field(ge=1e-6, lt=1)] = 0.4
    """Share of the sky covered by cloud."""
    depth: NotNegative = 3.0
    """Optical depth for each standard deviation by which the thickness exceeds that at the cloud's edge; 0 is no
    cloud."""
    temperature_k: Kelvin = 268.0
    """Temperature of the cloud, K."""
    texture_k: KelvinSpread = 2.0
    """Standard deviation of temperature within the cloud, K."""
    beta: Annotated[float, Field(ge=0, le=6)] = 3.3
    """Slope of the 2-D power spectrum f^-beta (real clouds: 2.9 to 4.1)."""
    correlation_mrad: Feature = 60.0
    """Size of the largest features, mrad."""
    stretch: Annotated[float, Field(ge=0.1, le=10)] = 2.0
    """Ratio of width to height of features."""
    range_m: Range = 5000.0
    """Distance of the layer from the first camera position, m; farther targets are behind it."""
    wind_mrad_s: Annotated[tuple[Drift, Drift], Field(strict=False)] = (0.0, 0.0)
    """Apparent motion, [right, down], mrad/s."""
    betas: Betas | None = None
    """Slopes of the spectrum along x and along y if they differ (real thin cloud: [2.7, 3.6]); replaces `beta`."""
    histogram: Histogram = ()
    """Thickness at evenly spaced quantiles of the sky, least to greatest, in any unit ([0, 0.1, 1]: few thick cores);
    Gaussian if empty."""
    evolve_s: NotNegative = 0.0
    """Time in which the correlation of the texture falls to 2/3, s; 0: it only drifts."""
    sunlit_k: KelvinSpread = 0.0
    """Largest rise of apparent temperature at edges that face the sun, K (MWIR by day: 5 to 20)."""
    sun_deg: Degrees = -45.0
    """Direction of the sun in the image: clockwise from up, degrees."""

    def layer(self, context: SceneContext) -> PanoramicLayer:
        """Return the layer of a cloud that only drifts."""
        geometry = context.geometry
        shape = tile_shape(geometry.size)
        thickness, warmth = (
            spectral(
                shape, self.beta, self.betas, self._correlation_px(context), self.stretch, context.seed, self.id, what
            )
            for what in ("thickness", "warmth")
        )
        painted = self.paint(thickness, warmth, context)
        tiles = tuple(PeriodicTexture.of(field, geometry.size, context.psf) for field in painted)
        textures = DriftingTextures(tiles, self._drift_px_s(geometry.ifov_rad))
        return PanoramicLayer(self.id, Sphere(self.range_m), textures)

    def paint(self, thickness: Floats, warmth: Floats, context: SceneContext) -> tuple[Floats, Floats]:
        """Return transmittance and emission, before optics, of two periodic fields, (rows, columns), of mean 0 and
        variance 1."""
        (rows, columns), coarse = (slice(0, length) for length in thickness.shape), self._coarse(context)
        lit = None
        if self.sunlit_k:
            slope = self._slope(with_histogram(shrunk(thickness, coarse), self.histogram), context)
            lit = enlarged(sunlit_share(slope), coarse, rows, columns)
        return self._shading(context).paint(with_histogram(thickness, self.histogram), warmth, lit)

    def evolving(self, context: SceneContext) -> EvolvingCloud:
        """Return the layer of a cloud that evolves; `evolve_s` must not be 0."""
        side = tile_side(context.geometry.size)
        margin = blur_margin_px(context.psf, side)
        spectrum = self.beta, self.betas, self._correlation_px(context), self.stretch
        coarse = self._coarse(context)

        def small(pair: Floats) -> Floats:
            return first_of(pair, coarse)

        def sloping(pair: Floats) -> Floats:
            return self._slope(small(pair), context)

        derived = None if not self.sunlit_k else small if self.histogram else sloping
        fields = EvolvingFields(side, *spectrum, context.seed, self.id, derived)
        shading = self._shading(context)

        def state_at(place: float) -> CloudState:
            mixture = fields.at(place)
            slope = mixture.derived
            if slope is not None and self.histogram:  # a histogram is not linear: the slope follows the mixture
                slope = self._slope(with_histogram(slope, self.histogram), context)
            share = None if slope is None else sunlit_share(slope)

            def paint(*tile: slice) -> tuple[Floats, Floats]:
                rows, columns = (slice(part.start - margin, part.stop + margin) for part in tile)
                lit = None if share is None else enlarged(share, coarse, rows, columns)
                thickness, warmth = mixture.over(rows, columns)
                passed, emitted = shading.paint(with_histogram(thickness, self.histogram), warmth, lit)
                return blurred_inner(passed, context.psf, margin), blurred_inner(emitted, context.psf, margin)

            return CloudState(side, shading.brightest, paint)

        drift = self._drift_px_s(context.geometry.ifov_rad)
        return EvolvingCloud(self.id, self.range_m, state_at, self.evolve_s, drift)

    def _drift_px_s(self, ifov_rad: float) -> tuple[float, float]:
        right, down = self.wind_mrad_s
        px_per_mrad = 1e-3 / ifov_rad
        return right * px_per_mrad, down * px_per_mrad

    def _correlation_px(self, context: SceneContext) -> float:
        return self.correlation_mrad * 1e-3 / context.geometry.ifov_rad

    def _shading(self, context: SceneContext) -> CloudShading:
        kelvin = self.temperature_k, self.texture_k, self.sunlit_k
        return CloudShading.of(self._edge, self.depth, kelvin, context.band)

    @property
    def _edge(self) -> float:
        """Thickness above which there is cloud."""
        if self.histogram:
            return float(with_histogram(np.array([NormalDist().inv_cdf(1 - self.coverage)]), self.histogram)[0])
        return NormalDist().inv_cdf(1 - self.coverage)

    def _slope(self, small: Floats, context: SceneContext) -> Floats:
        """Return the slope towards the sun of a thickness reduced by `_coarse`."""
        return slope_to_sun(small, self._smoothed_px(context) / self._coarse(context), self.sun_deg)

    def _smoothed_px(self, context: SceneContext) -> float:
        """Return the sigma, px, by which the thickness is smoothed before it is lit; finer features are not lit."""
        return max(self._correlation_px(context) / 40, 1.0)

    def _coarse(self, context: SceneContext) -> int:
        """Return the factor by which the thickness is reduced in size before it is lit."""
        return coarseness(self._smoothed_px(context), min(tile_shape(context.geometry.size)))
