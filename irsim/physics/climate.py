"""Model atmospheres: fitted absorption, temperature profiles, fog, rain and ozone, as tables."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from irsim.physics.radiometry import BAND_UM, limits, radiance
from irsim.types import Band, BandName, Floats

STANDARD_K = 288.15
"""Temperature of the air at sea level, K (ICAO Doc 7488, the standard atmosphere; the U.S. Standard
Atmosphere 1976 has the same)."""

ClimateName = Literal["us_standard", "midlatitude_summer", "midlatitude_winter", "tropical"]

FIT_KM = (0.5, 20.0)
"""Lengths of the fitted paths, km; the fit is extrapolated beyond."""
FIT_HEIGHT_KM = 0.1
"""Height of the fitted paths above the sea, km."""
FIT_VISIBILITY_KM = (5.0, 23.0)
"""Two visibilities of the fitted paths, km."""
FIT_ERROR = 0.022
"""Largest error of the fitted transmittance."""

FOG: dict[str, dict[BandName, float]] = {
    "advection": {"mwir": 1.08, "lwir": 1.13},
    "radiation": {"mwir": 1.35, "lwir": 0.33},
}
"""Extinction of fog in each band over that at 0.55 um: Mie theory, the mean over the band, with the drop
sizes of Shettle and Fenn (AFGL-TR-79-0214, 1979), r^3 exp(-0.3 r) and r^6 exp(-3 r), r in um, and the
refractive index of water of Hale and Querry (Appl. Opt. 12, 555, 1973)."""


@dataclass(frozen=True)
class Climate:
    """A model atmosphere.

    fit       (a, b) of tau = exp(-a R^b), R in km, of each band at the two visibilities, 5 and 23 km: fitted to
              runs of LOWTRAN7 (Kneizys et al., AFGL-TR-88-0177, 1988), which are not kept here; largest error 0.022
    profile   ((km, K), ...) air temperature, linear between; McClatchey et al. 1972 as in Anderson et al.,
              AFGL-TR-86-0110 (1986), within 0.1 K to 13 km and 2 K to 40 km; the U.S. Standard Atmosphere 1976 is
              linear itself
    gas_km    scale height of the water absorption, km, in each band, fitted to LOWTRAN7's clear-sky temperatures (see
              `OZONE`). It is below the ratio of the water column to the vapour density at the ground (1.4/5.9 and
              2.9/14 g/cm2 over g/m3: 2.4 and 2.1 km), as continuum absorption in LWIR grows with the square of the
              density, above all in humid air.
    """

    fit: dict[BandName, tuple[tuple[float, float], tuple[float, float]]]
    profile: tuple[tuple[float, float], ...]
    gas_km: dict[BandName, float]

    def gas(self, band: BandName, height_km: Floats) -> Floats:
        """Return the density of absorbers at heights above the sea, km, relative to the height of the fit: water and
        well-mixed gases."""
        lift = FIT_HEIGHT_KM - height_km
        wet, mixed = np.exp(lift / self.gas_km[band]), MIXED[band]
        return np.asarray(wet + mixed * (np.exp(lift / AIR_KM) - wet) if mixed else wet)


AIR_KM = 7.0
"""Scale height of air, km: its pressure falls from 1013 to 103.5 hPa over the lowest 16 km (U.S. Standard Atmosphere
1976)."""
MIXED: dict[BandName, float] = {"mwir": 0.048, "lwir": 0.0}
"""Share of well-mixed gases in the absorption at the height of the fit: in MWIR that of carbon dioxide at 4.3 um, which
dominates at heights with little water vapour. In LWIR it is negligible beside ozone."""

OZONE: dict[BandName, tuple[float, float]] = {"lwir": (0.085, 0.43)}
"""(a, b): a vertical path through all ozone has the depth a, a path with x times as much ozone the depth a x^b (the
band at 9.6 um saturates). In MWIR it is negligible, 0.015.

`OZONE`, `MIXED` and `Climate.gas_km` are fitted together to runs of LOWTRAN7 (revision 4.2, rural haze of 23 km): clear
skies of the four climates at elevations of 90, 30, 10, 5, 1 and 0 degrees from heights of 0, 0.1, 1.5, 3, 5, 8, 10, 12,
15 and 20 km. From sea level the error is at most 2.6 K, from all heights 7 K, root mean square 2.1 K; for level paths
of 2 to 50 km at these heights at most 0.085 of transmittance. All climates have the same ozone (LOWTRAN7's differ by 15
% either way)."""
OZONE_KM = (22.0, 5.0)
"""Height of ozone, and its standard deviation, km: most ozone lies at 15 to 30 km, with the maximum at 22 km
(U.S. Standard Atmosphere 1976, its ozone of mid latitudes). Below 8 km there is less than 1 %: the ozone there is
in the fit."""


def ozone(height_km: Floats) -> Floats:
    """Return the share of a vertical path's ozone per km at heights above the sea, km."""
    middle, spread = OZONE_KM
    return np.asarray(np.exp(-(((height_km - middle) / spread) ** 2) / 2) / (spread * math.sqrt(2 * math.pi)))


CLIMATES: dict[ClimateName, Climate] = {
    "us_standard": Climate(
        {"mwir": ((0.614, 0.57), (0.554, 0.47)), "lwir": ((0.186, 0.86), (0.130, 0.79))},
        ((0, STANDARD_K), (11, 216.65), (20, 216.65), (32, 228.65), (40, 251.05)),
        {"mwir": 2.1, "lwir": 1.95},
    ),
    "midlatitude_summer": Climate(
        {"mwir": ((0.776, 0.56), (0.711, 0.48)), "lwir": ((0.351, 0.89), (0.295, 0.86))},
        ((0, 294.2), (2, 285.2), (6, 261.2), (13, 215.8), (17, 215.7), (25, 225.1), (30, 233.7), (40, 257.5)),
        {"mwir": 1.8, "lwir": 1.45},
    ),
    "midlatitude_winter": Climate(
        {"mwir": ((0.557, 0.58), (0.491, 0.47)), "lwir": ((0.149, 0.87), (0.094, 0.78))},
        ((0, 272.2), (3, 261.7), (10, 219.7), (19, 215.2), (25, 215.2), (30, 217.4), (40, 243.2)),
        {"mwir": 2.4, "lwir": 2.05},
    ),
    "tropical": Climate(
        {"mwir": ((0.860, 0.55), (0.795, 0.48)), "lwir": ((0.485, 0.89), (0.429, 0.87))},
        ((0, 299.7), (2, 287.7), (3, 283.7), (13, 217.0), (17, 194.8), (22, 214.6), (30, 232.3), (40, 254.0)),
        {"mwir": 1.65, "lwir": 1.4},
    ),
}


def fitted_band(band: Band) -> BandName | None:
    """Return the named band that contains at least half of a band; None if none does."""
    low, high = limits(band)
    for name, (lowest, highest) in BAND_UM.items():
        if min(high, highest) - max(low, lowest) >= (high - low) / 2:
            return name
    return None


def band_mismatch(band: Band, fitted: BandName) -> float:
    """Return the share of the light of a black body at air temperature that two bands do not have in common.

    It bounds the difference of mean transmittances over the two bands (total variation of their weights).
    """
    (low, high), (lowest, highest) = limits(band), limits(fitted)
    common = max(low, lowest), min(high, highest)
    return 1 - float(radiance(common, STANDARD_K) / max(radiance(each, STANDARD_K) for each in (band, fitted)))


def rain_extinction(mm_h: float) -> float:
    """Return the extinction of rain, 1/km, equal in all bands as drops are much wider than the wavelength.

    0.365 r^0.63: drop sizes of Marshall and Palmer, as in LOWTRAN (Kneizys et al., AFGL-TR-83-0187, 1983);
    1.58 r^0.63 dB/km in ITU-R P.1814.
    """
    return float(0.365 * mm_h**0.63)
