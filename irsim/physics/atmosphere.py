"""Atmosphere: transmittance, path radiance and the clear sky.

In-band transmittance does not follow Beer's law, as strong lines saturate. It is modelled as

    tau(R) = exp(-a R^b),  R in km,

fitted to LOWTRAN7 for level paths 100 m above the sea, 0.5 to 20 km long (largest error 0.022). Other paths are cut
into layers: water, air and haze thin out with height, and a path is equivalent to the level path with the same column
of absorbers. Ozone, high above that path, is added (`irsim.physics.climate`). Each step of a path emits as a black body
in proportion to its absorption (Kirchhoff's law), at temperatures from that of the air at its start to that at its end.
An opaque path thus has the radiance of the air.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from irsim.config.base import Part, Switches
from irsim.config.quantities import AirKelvin, Kelvin
from irsim.errors import Notice
from irsim.physics.climate import (
    CLIMATES,
    FIT_ERROR,
    FIT_HEIGHT_KM,
    FIT_KM,
    FIT_VISIBILITY_KM,
    FOG,
    OZONE,
    Climate,
    ClimateName,
    band_mismatch,
    fitted_band,
    ozone,
    rain_extinction,
)
from irsim.physics.path_integral import (
    equivalent_path,
    length_below,
    path_radiance,
    relative_stations,
    sphere_crossings,
)
from irsim.physics.radiometry import hemisphere, limits, radiance
from irsim.physics.turbulence import Turbulence
from irsim.types import Band, BandName, Floats

KOSCHMIEDER = 3.912
"""Extinction at 0.55 um times visibility: -ln 0.02 (Koschmieder 1924: 2 % is the contrast threshold)."""

AEROSOL_KM = 1.2
"""Scale height of haze, km (Penndorf 1954; McClatchey et al., AFCRL-72-0497, 1972, for the lowest 5 km)."""

RAIN_TOP_KM = 3.0
"""Top of rain, km (ITU-R P.839: the 0-degree isotherm, 2 to 5 km in mid latitudes)."""
FOG_TOP_KM = 0.2
"""Top of fog above the sea, km: radiation and advection fog are some 50 to 300 m deep."""

EARTH_KM = 6371.0
"""Mean radius of the Earth, km (Moritz, Geodetic Reference System 1980, J. Geodesy 74 (2000) 128: R1 = 6371.0088)."""
_TOP_KM = 40.0
"""Top of the atmosphere, km; the air above is negligible."""
HIGHEST_M = 20_000
"""Greatest height of the camera above the sea, m."""
GAS_TOLERANCE = 0.1
"""Largest relative difference between the gas on a path and that on the fitted path; `beyond_fit` reports
paths that differ more."""
_STEPS = 40
_SKY_STEPS = 120
"""Number of steps into which a path is divided from each of its ends. Apparent temperatures of black bodies are within
0.05 K of those with 4000 steps for cameras up to 12 km high, and within 0.09 K above."""


class Atmosphere(Part):
    """Atmosphere. By default there is none: no attenuation and no path radiance."""

    switches: ClassVar[Switches] = {
        "haze": ("visibility_km", math.inf),
        "rain": ("rain_mm_h", 0.0),
        "fog": ("fog_visibility_km", None),
        "surroundings": ("surroundings_k", 1.0),  # at 1 K its radiance is negligible
    }

    preset: ClimateName | Literal["none"] = "none"
    """Model atmosphere: its absorption and its temperatures."""
    visibility_km: Annotated[float, Field(ge=1, le=300)] = 23.0
    """Visibility in haze, km. The model is fitted at 5 and 23 km; elsewhere the extinction of haze is proportional to
    the inverse of the visibility."""
    altitude_m: Annotated[float, Field(ge=0, le=HIGHEST_M)] = 100.0
    """Height of the camera above the sea, m. A larger height above the background's ground replaces it; so does the
    height above the background `sea`, larger or not."""
    temperature_k: AirKelvin | None = None
    """Air temperature at sea level, kelvin, by default that of the preset. Temperatures at all heights shift with
    it."""
    surroundings_k: Kelvin | None = None
    """Temperature of the surroundings that targets and occluders reflect, kelvin. By default the mean of the clear sky
    and of ground as warm as the air; without a preset the mean of the background's own sky and ground."""
    rain_mm_h: Annotated[float, Field(ge=0, le=300)] = 0.0
    """Rain, mm/h."""
    fog_visibility_km: Annotated[float, Field(ge=0.01, le=5)] | None = None
    """Visibility in fog up to 200 m above the sea, km; by default there is no fog."""
    fog: Literal["radiation", "advection"] = "radiation"
    """`radiation` fog has small drops and is more transparent in LWIR; `advection` fog has large drops, equal in all
    bands."""
    turbulence: Turbulence = Turbulence()

    @property
    def is_clear(self) -> bool:
        """True if there is neither attenuation nor path radiance."""
        return self.preset == "none" and self.rain_mm_h == 0 and self.fog_visibility_km is None

    def path(
        self, band: Band, range_m: float | Floats, elevation_rad: float | Floats = 0.0, height_gain_m: float = 0.0
    ) -> tuple[Floats, Floats]:
        """Return (transmittance, path radiance in W/m2/sr) from the camera to a range, m, at an elevation, rad.

        `height_gain_m` is the height of a moving camera above its first position, m. Arrays broadcast; each element
        costs some 80 steps, so images should be interpolated from a few nodes.
        """
        along, elevation = np.broadcast_arrays(np.asarray(range_m) * 1e-3, elevation_rad)
        return self._path(band, along, elevation, _STEPS, height_gain_m)

    def transmittance(self, band: Band, range_m: float | Floats, elevation_rad: float | Floats = 0.0) -> Floats:
        """Return the transmittance from the camera to a range, m, at an elevation, rad."""
        return self.path(band, range_m, elevation_rad)[0]

    def through(
        self, band: Band, emission: Floats, alpha: Floats, range_m: float | Floats, elevation_rad: float | Floats
    ) -> Floats:
        """Return the emission, W/m2/sr, of an object that covers the share `alpha`, at the camera: tau emission + alpha
        L_path. Clear air returns the same array."""
        if self.is_clear:
            return emission
        tau, light = self.path(band, range_m, elevation_rad)
        return np.asarray(tau * emission + alpha * light)

    def sky(self, band: Band, elevation_rad: float | Floats) -> Floats:
        """Return the radiance of the clear sky, W/m2/sr, at elevations, rad; constant below the horizon."""
        return self._path_to_space(band, elevation_rad)[1]

    def transmittance_to_space(self, band: Band, elevation_rad: float | Floats) -> Floats:
        """Return the transmittance from the camera to space at elevations, rad; constant below the horizon."""
        return self._path_to_space(band, elevation_rad)[0]

    def _path_to_space(self, band: Band, elevation_rad: float | Floats) -> tuple[Floats, Floats]:
        """Return (transmittance, path radiance in W/m2/sr) to the top of the atmosphere."""
        elevation = np.maximum(np.asarray(elevation_rad, dtype=np.float64), 0.0)
        base = EARTH_KM + self.altitude_m * 1e-3
        rise = base * np.sin(elevation)
        to_top = np.sqrt(rise**2 + (EARTH_KM + _TOP_KM) ** 2 - base**2) - rise
        return self._path(band, to_top, elevation, _SKY_STEPS)

    def surroundings(self, band: Band) -> float | None:
        """Return the mean radiance around a body, W/m2/sr: half the mean of the sky, half ground as warm as the air.

        None without a preset and without `surroundings_k`.
        """
        if self.surroundings_k is not None:
            return float(radiance(band, self.surroundings_k))
        return None if self.preset == "none" else _surroundings(self, band)

    def air_k(self, height_km: float | Floats) -> Floats:
        """Return the temperature of the air, K, at heights above the sea, km."""
        heights, kelvin = zip(*self._climate.profile, strict=True)
        shift = 0.0 if self.temperature_k is None else self.temperature_k - kelvin[0]
        return np.asarray(np.interp(height_km, heights, kelvin) + shift)

    def depth(self, band: Band, gas_km: Floats, haze_km: Floats) -> Floats:
        """Return the optical depth of a path whose gas and haze equal those of level paths `gas_km` and `haze_km` long.

        With the depth D_V = a R^b at the visibilities V = 5 and 23 km, haze adds A = (D_5 - D_23) / (1/5 - 1/23) for
        each inverse km of visibility, and D_23 - A/23 is the depth without haze. Below 0.5 km A is proportional to R:
        haze has no lines.
        """
        near, far = FIT_VISIBILITY_KM
        (a5, b5), (a23, b23) = self._climate.fit[_fitted(band)]

        def haze(km: Floats) -> Floats:
            fitted = np.maximum(km, FIT_KM[0])
            added = (a5 * fitted**b5 - a23 * fitted**b23) / (1 / near - 1 / far)
            return np.asarray(added * np.minimum(km / FIT_KM[0], 1.0))

        clean = a23 * gas_km**b23 - haze(gas_km) / far
        return np.asarray(clean + haze(haze_km) / self.visibility_km)

    def notices(self, band: Band) -> Iterator[Notice]:
        """Yield a notice for each value that is allowed but outside the fit; key paths are relative to this part."""
        if self.preset == "none":
            return
        near, far = FIT_VISIBILITY_KM
        if not near <= self.visibility_km <= far:
            yield Notice(
                ("visibility_km",),
                f"{self.visibility_km:g} km lies beyond the fitted {near:g} to {far:g} km; "
                "haze is extrapolated with the inverse of visibility",
            )
        name = _fitted(band)
        apart = band_mismatch(band, name)
        if apart > FIT_ERROR:
            (low, high), (lowest, highest) = limits(band), limits(name)
            yield Notice(
                ("preset",),
                f"transmittance is fitted to {lowest:g} to {highest:g} um, not to {low:g} to {high:g} um: that "
                f"of {name} is used, which may be off by up to {apart:.2f}, the share of light outside the bands' "
                "common part",
            )

    def beyond_fit(self, band: Band, range_m: float, elevation_rad: float, height_gain_m: float = 0.0) -> str | None:
        """Return the reason why a path lies outside the fit; None inside it. The arguments are those of `path`."""
        if self.preset == "none":
            return None
        shortest, longest = FIT_KM
        along = range_m * 1e-3
        if not shortest <= along <= longest:
            return f"a range of {along:.3g} km lies beyond the fitted {shortest:g} to {longest:g} km"
        stations, heights = self._stations(np.asarray(along), np.asarray(elevation_rad), _STEPS, height_gain_m)
        share = equivalent_path(stations, self._climate.gas(_fitted(band), heights))[-1] / along
        if abs(share - 1) > GAS_TOLERANCE:
            top = max(heights) * 1e3
            return (
                f"a path up to {top:.0f} m above the sea holds {share:.0%} of the gas on the fitted one, which is "
                f"level at {FIT_HEIGHT_KM * 1e3:.0f} m: transmittance is scaled from there"
            )
        return None

    def _molecular_and_haze_depth(self, band: Band, places: Floats, heights: Floats) -> Floats:
        """Return the optical depth up to each station, (..., n), without rain and fog."""
        if self.preset == "none":
            return np.zeros_like(places)
        name = _fitted(band)
        haze = np.exp((FIT_HEIGHT_KM - heights) / AEROSOL_KM)
        total = self.depth(
            band, equivalent_path(places, self._climate.gas(name, heights)), equivalent_path(places, haze)
        )
        if name in OZONE:
            whole, power = OZONE[name]
            total = total + whole * equivalent_path(places, ozone(heights)) ** power
        return total

    @property
    def _climate(self) -> Climate:
        return CLIMATES["us_standard" if self.preset == "none" else self.preset]

    def _stations(
        self, along: Floats, elevation: Floats, steps: int, height_gain_m: float = 0.0
    ) -> tuple[Floats, Floats]:
        """Return stations along paths and their heights, (..., n) km each. Stations are dense near both ends and
        include the crossings of the tops of rain and fog."""
        along, rise = along[..., None], np.sin(elevation)[..., None]
        base = EARTH_KM + (self.altitude_m + height_gain_m) * 1e-3
        places = along * relative_stations(steps)
        cuts = [
            np.minimum(np.maximum(cut, 0), along)
            for top in self._layer_tops
            for cut in sphere_crossings(base, rise, EARTH_KM + top)
        ]
        if cuts:
            places = np.sort(np.concatenate([places, *cuts], axis=-1), axis=-1)
        # Distance from the Earth's centre less its radius, without a difference of large numbers.
        square = places * (places + 2 * base * rise) + base**2 - EARTH_KM**2
        return places, np.maximum(square / (np.sqrt(square + EARTH_KM**2) + EARTH_KM), 0.0)

    @property
    def _layer_tops(self) -> list[float]:
        """Tops of rain and fog, km."""
        ends = (self.rain_mm_h > 0, RAIN_TOP_KM), (self.fog_visibility_km is not None, FOG_TOP_KM)
        return [top for there, top in ends if there]

    def _path(
        self, band: Band, along: Floats, elevation: Floats, steps: int, height_gain_m: float = 0.0
    ) -> tuple[Floats, Floats]:
        places, heights = self._stations(along, elevation, steps, height_gain_m)
        total = self._molecular_and_haze_depth(band, places, heights)
        if self.rain_mm_h:
            total = total + rain_extinction(self.rain_mm_h) * length_below(places, heights, RAIN_TOP_KM)
        if self.fog_visibility_km is not None:
            extinction = KOSCHMIEDER / self.fog_visibility_km * FOG[self.fog][_fitted(band)]
            total = total + extinction * length_below(places, heights, FOG_TOP_KM)
        tau = np.exp(-total)
        return tau[..., -1], path_radiance(tau, total, radiance(band, self.air_k(heights)))


def _fitted(band: Band) -> BandName:
    name = fitted_band(band)
    if name is None:
        low, high = limits(band)
        raise ValueError(f"no transmittance was fitted to a band of {low:g} to {high:g} um")
    return name


@lru_cache(maxsize=64)
def _surroundings(air: Atmosphere, band: Band) -> float:
    """Return the mean of the sky and of ground as warm as the air."""
    return (hemisphere(lambda elevation: air.sky(band, elevation)) + float(radiance(band, air.air_k(0.0)))) / 2
