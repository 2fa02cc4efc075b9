"""Model atmospheres: what was fitted, measured and computed of the air's absorption, as tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from irsim.radiometry import BAND_UM, limits, radiance
from irsim.types import Band, BandName

STANDARD_K = 288.15
"""Temperature of the air at the level of the sea, K (ICAO Doc 7488, the standard atmosphere; the U.S. Standard
Atmosphere 1976 has the same)."""

ClimateName = Literal["us_standard", "midlatitude_summer", "midlatitude_winter", "tropical"]

FIT_KM = (0.5, 20.0)
"""Lengths of the paths that the transmittance was fitted to, km; beyond them the fit is carried on."""
FIT_HEIGHT_KM = 0.1
"""Their height above the sea, km."""
FIT_VISIBILITY_KM = (5.0, 23.0)
"""Their two visibilities, km."""
FIT_ERROR = 0.022
"""By how much the fit misses a transmittance at most."""

FOG: dict[str, dict[BandName, float]] = {
    "advection": {"mwir": 1.08, "lwir": 1.13},
    "radiation": {"mwir": 1.35, "lwir": 0.33},
}
"""Extinction of fog in each band against that at 0.55 um: Mie's theory, the mean over the band, with the drop
sizes of Shettle and Fenn (AFGL-TR-79-0214, 1979), r^3 exp(-0.3 r) and r^6 exp(-3 r), r in um, and the
refractive index of water of Hale and Querry (Appl. Opt. 12, 555, 1973)."""


@dataclass(frozen=True)
class Climate:
    """A model atmosphere.

    fit       (a, b) of tau = exp(-a R^b), R in km, of each band at the two visibilities, 5 and 23 km: fitted to
              runs of LOWTRAN7 (Kneizys et al., AFGL-TR-88-0177, 1988), which are not kept here; largest error 0.022
    profile   ((km, K), ...) air temperature, linear between; McClatchey et al. 1972 as in Anderson et al.,
              AFGL-TR-86-0110 (1986), within 0.1 K; the U.S. Standard Atmosphere 1976 is linear itself
    gas_km    scale height of what absorbs, km: that at which the layered sky has LOWTRAN7's clear-sky
              temperatures at five elevations within 2 K (printed in `tests/test_atmosphere.py`). It lies below the
              water column over the vapour at the ground (1.4/5.9, 2.9/14 g/cm2 over g/m3: 2.4 and 2.1 km), as
              the continuum grows with the square of the vapour: more so in humid air.
    """

    fit: dict[BandName, tuple[tuple[float, float], tuple[float, float]]]
    profile: tuple[tuple[float, float], ...]
    gas_km: float


CLIMATES: dict[ClimateName, Climate] = {
    "us_standard": Climate(
        {"mwir": ((0.614, 0.57), (0.554, 0.47)), "lwir": ((0.186, 0.86), (0.130, 0.79))},
        ((0, STANDARD_K), (11, 216.65)),
        2.1,
    ),
    "midlatitude_summer": Climate(
        {"mwir": ((0.776, 0.56), (0.711, 0.48)), "lwir": ((0.351, 0.89), (0.295, 0.86))},
        ((0, 294.2), (2, 285.2), (6, 261.2), (13, 215.8)),
        1.5,
    ),
    "midlatitude_winter": Climate(
        {"mwir": ((0.557, 0.58), (0.491, 0.47)), "lwir": ((0.149, 0.87), (0.094, 0.78))},
        ((0, 272.2), (3, 261.7), (10, 219.7), (13, 218.2)),
        2.1,  # as the dry air of us_standard
    ),
    "tropical": Climate(
        {"mwir": ((0.860, 0.55), (0.795, 0.48)), "lwir": ((0.485, 0.89), (0.429, 0.87))},
        ((0, 299.7), (2, 287.7), (3, 283.7), (13, 217.0)),
        1.5,  # as the humid air of midlatitude_summer
    ),
}


def fitted_band(band: Band) -> BandName | None:
    """The named band whose fit serves a band: that which holds at least half of it; None where none does."""
    low, high = limits(band)
    for name, (lowest, highest) in BAND_UM.items():
        if min(high, highest) - max(low, lowest) >= (high - low) / 2:
            return name
    return None


def unshared(band: Band, fitted: BandName) -> float:
    """Share of light (of a black body like the air) that two bands do not have in common. Transmittances lie from 0 to
    1, so that means over the two bands differ by no more (the total variation of their weights)."""
    (low, high), (lowest, highest) = limits(band), limits(fitted)
    common = max(low, lowest), min(high, highest)
    return 1 - float(radiance(common, STANDARD_K) / max(radiance(each, STANDARD_K) for each in (band, fitted)))
