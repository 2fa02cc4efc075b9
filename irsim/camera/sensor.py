"""Focal planes: from in-band radiance to a signal, by a given NETD or by the electrons in a well."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar

from pydantic import Field

from irsim.camera.response import Response
from irsim.config.base import Kind
from irsim.config.quantities import NotNegative, Positive
from irsim.physics.radiometry import PHOTON_J_M, Scale, planck, planck_slope, quadrature, radiance, slope
from irsim.types import Band, Curve

NETD_K = 300.0
"""Background temperature of a camera's NETD, K."""

MAX_PITCH_UM, MAX_WELL_ME = 1000.0, 10_000.0
"""Limits of `pitch_um` and `well_me`."""


@dataclass(frozen=True)
class SensorSettings:
    """Keys of the camera that a focal plane depends on; netd_mk, mK, and range_k, K, for kind stated only."""

    band: Band
    bits: int
    netd_mk: float
    range_k: tuple[float, float]


class Sensor(Kind):
    """Focal plane: the camera's key `detector`."""

    default_noise: ClassVar[tuple[dict[str, Any], ...]]
    """Noise terms of a camera that lists none."""
    camera_keys: ClassVar[tuple[str, ...]] = ("netd_mk", "range_k")
    """Keys of the camera, out of `netd_mk` and `range_k`, that the response depends on."""
    counts_electrons: ClassVar[bool] = False
    """True where the signal is in electrons and may have shot noise."""
    integration_key: ClassVar[str | None] = None
    """Name of the key that holds the integration time, ms; None without such a key."""

    @property
    def integration_time_ms(self) -> float | None:
        """Integration time of a frame, ms; None where it is not known."""
        return None if self.integration_key is None else float(getattr(self, self.integration_key))

    @property
    def optics(self) -> tuple[float, float] | None:
        """F-number and pixel pitch, um, that the signal depends on; None where it depends on neither."""
        return None

    @abstractmethod
    def response(self, settings: SensorSettings) -> Response:
        """Return the response in a camera with these settings."""


class NetdSensor(Sensor):
    """Focal plane linear in radiance: the camera's range_k gives count 0 and full scale, its netd_mk the noise."""

    default_noise = ({"kind": "white"},)

    def response(self, settings: SensorSettings) -> Response:
        """Return the response with sigma = NETD dN/dT at 300 K: a change by the NETD moves the mean count by sigma."""
        scale = Scale.between(settings.band, settings.range_k, settings.bits)
        return Response(
            linear=scale.linear,
            root=scale.root,
            zero=scale.zero,
            well=math.inf,
            noise=settings.netd_mk * 1e-3 * slope(settings.band, NETD_K) * scale.linear,
            netd_mk=settings.netd_mk,
            gain=1.0,
            offset=0.0,
            full=2**settings.bits - 1,
            electrons=False,
            read=0.0,
        )


class ElectronSensor(Sensor):
    """Focal plane that counts electrons in a well: the NETD follows; netd_mk and range_k have no effect.

    S = A pi tau / (4 F² + 1) eta t Q(L) + dark current: A the pixel's area, tau the optics' transmittance,
    eta the quantum efficiency, t the integration time, Q the in-band photon radiance. The defaults are a
    cooled InSb camera: in 3.4-4.9 um 2.58 million electrons and 17.7 mK at 300 K.
    """

    default_noise = ({"kind": "shot"},)
    camera_keys = ()
    counts_electrons = True
    integration_key = "integration_ms"

    pitch_um: Annotated[float, Field(gt=0, le=MAX_PITCH_UM)] = 15.0
    """Side of a pixel, um; all of it is sensitive."""
    f_number: Annotated[float, Field(ge=0.5, le=100)] = 4.0
    """Focal length over the diameter of the aperture."""
    transmittance: Annotated[float, Field(gt=0, le=1)] = 0.85
    """Transmittance of the optics, in band."""
    quantum_efficiency: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Electrons per photon."""
    integration_ms: Annotated[float, Field(gt=0, le=10_000)] = 10.0
    """Integration time, ms."""
    well_me: Annotated[float, Field(gt=0, le=MAX_WELL_ME)] = 7.0
    """Full well, million electrons."""
    read_noise_e: Annotated[float, Field(ge=0, le=1e6)] = 400.0
    """Sigma of the read noise, electrons."""
    dark_me_s: NotNegative = 0.0
    """Dark current, million electrons a second."""
    gain_e: Positive | None = None
    """Electrons per count; by default a full well gives the highest count."""
    offset: NotNegative = 0.0
    """Count at zero electrons."""

    @property
    def optics(self) -> tuple[float, float]:
        return self.f_number, self.pitch_um

    def flux_factor(self) -> float:
        """Return the electrons per unit of in-band photon radiance (1/s/m²/sr) in one integration."""
        solid = math.pi / (4 * self.f_number**2 + 1) * self.transmittance
        return (self.pitch_um * 1e-6) ** 2 * solid * self.quantum_efficiency * self.integration_ms * 1e-3

    def response(self, settings: SensorSettings) -> Response:
        """Return the response a L + b sqrt(L) that has, at 300 K, the photon radiance of Planck's law and its slope.

        Its error is below 2.1 % from 250 to 400 K in 3-5 um and 0.4 % in 8-12 um. It overestimates the electrons of
        hotter bodies, whose photons have shorter wavelengths: in 3-5 um by 4.5 % at 500 K, 12 % at 1000 K and 16 % at
        2000 K (motors, flares), in 8-12 um by 0.8, 1.9 and 2.4 %. The largest errors are 18 and 2.7 %.
        """
        light, rise = float(radiance(settings.band, NETD_K)), slope(settings.band, NETD_K)
        photons, photon_rise = photon_radiance(settings.band, NETD_K), photon_slope(settings.band, NETD_K)
        factor = self.flux_factor()
        root = 2 * (photons - photon_rise * light / rise) / math.sqrt(light)
        linear = (photons - root * math.sqrt(light)) / light
        full = 2**settings.bits - 1
        well = self.well_me * 1e6
        zero = self.dark_me_s * 1e3 * self.integration_ms
        noise = math.sqrt(factor * photons + zero + self.read_noise_e**2)
        return Response(
            linear=factor * linear,
            root=factor * root,
            zero=zero,
            well=well,
            noise=noise,
            netd_mk=noise / (factor * photon_rise) * 1e3,
            gain=self.gain_e or well / (full - self.offset),
            offset=self.offset,
            full=full,
            electrons=True,
            read=self.read_noise_e,
        )


def matched_sensor(curve: Curve, band: Band, bits: int, rate_hz: float, sigma: float) -> ElectronSensor:
    """Return a focal plane with the given `curve` from radiance to counts, in a camera of `bits` and `rate_hz`.

    Its only noise is shot noise, which is `sigma` counts, above 0, at 300 K: c counts of sigma s are (c / s)²
    electrons. The sigma is larger where these electrons exceed the largest well or pixel.
    """
    nominal = ElectronSensor(pitch_um=1.0, integration_ms=min(10.0, 500 / rate_hz), read_noise_e=0.0)
    per_um2 = nominal.response(SensorSettings(band, bits, 0.0, (0.0, 0.0))).noise ** 2  # electrons at NETD_K
    linear, root, zero = curve
    light, offset = float(radiance(band, NETD_K)), max(zero, 0.0)
    counts = linear * light + root * math.sqrt(light)
    room = 2**bits - 1 - offset
    gain = min(counts / sigma**2, MAX_WELL_ME * 1e6 / room, MAX_PITCH_UM**2 * per_um2 / counts)
    pitch_um = min(math.sqrt(counts * gain / per_um2), MAX_PITCH_UM)  # rounding must not exceed the limit
    well_me = min(gain * room * 1e-6, MAX_WELL_ME)
    return nominal.model_copy(update={"pitch_um": pitch_um, "well_me": well_me, "offset": offset})


@lru_cache
def photon_radiance(band: Band, temperature_k: float) -> float:
    """Return the in-band photon radiance of a black body, 1/s/m²/sr: spectral radiance over hc/lambda."""
    wavelengths, weights = quadrature(band)
    return float((planck(wavelengths, temperature_k) * wavelengths * 1e-6 / PHOTON_J_M) @ weights)


@lru_cache
def photon_slope(band: Band, temperature_k: float) -> float:
    """Return dQ/dT of the in-band photon radiance Q, 1/s/m²/sr/K."""
    wavelengths, weights = quadrature(band)
    return float((planck_slope(wavelengths, temperature_k) * wavelengths * 1e-6 / PHOTON_J_M) @ weights)
