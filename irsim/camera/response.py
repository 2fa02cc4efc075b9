"""How a detector answers to light: stated by its NETD, or counted in electrons."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.camera.int16_image import Words
from irsim.camera.photons import photon_radiance, photon_slope
from irsim.config.base import Family, Kind
from irsim.config.quantities import NotNegative, Positive
from irsim.physics.radiometry import Scale, radiance, slope
from irsim.types import Band, Counts, Curve, Floats

NETD_K = 300.0
"""Background temperature at which a camera's NETD is stated, K."""

MOST_COUNTS = 2**16 - 1
"""The highest count that 16 bits hold."""

MOST_ADDED = kernels.MOST_ADDED if COMPILED else 0
"""Pictures that are added to a signal in the pass that makes counts of it (`kernels.counts_of`)."""

Lines = tuple[Floats, Floats]
"""A number for each row, (rows,) float32, and for each column, (cols,), of which each pixel has the sum."""


@dataclass(frozen=True)
class Setting:
    """What a camera tells its detector: band; bits; netd_mk, mK, and range_k, K, for a stated one."""

    band: Band
    bits: int
    netd_mk: float
    range_k: tuple[float, float]


@dataclass(frozen=True)
class Response:
    """A detector made ready. The signal S of light L (W/m2/sr) is linear L + root sqrt(L) + zero.

    well, the signal at which a pixel saturates; noise, sigma of one NETD in signal; netd_mk, that NETD,
    mK; gain, signal per count; offset, the count of signal 0; full, the highest count; electrons, whether
    the signal is in electrons (else in counts, gain 1); read, read noise in signal.
    """

    linear: float
    root: float
    zero: float
    well: float
    noise: float
    netd_mk: float
    gain: float
    offset: float
    full: int
    electrons: bool
    read: float

    @property
    def top(self) -> float:
        """The highest signal that can be told: that of a full well or of the highest count."""
        return min(self.well, (self.full - self.offset) * self.gain)

    @property
    def curve(self) -> Curve:
        """How counts follow from light, where they are neither below 0 nor full."""
        return self.linear / self.gain, self.root / self.gain, self.offset + self.zero / self.gain

    @property
    def bottom(self) -> float:
        """The lowest signal that can be told: that of count 0."""
        return -self.offset * self.gain

    def signal(
        self, light: Floats, out: Floats | None = None, gain: Words | None = None, most: float = math.inf
    ) -> Floats:
        """The noiseless signal of in-band radiance (rows, cols) float32, W/m2/sr; into `out` where it is given, which
        may be the light itself.

        gain (rows, cols), by what share each pixel answers more to light; most, what it holds.
        """
        signal = np.empty_like(light) if out is None else out
        if COMPILED and light.dtype == np.float32 and light.flags.c_contiguous:
            shares = (None, 0.0) if gain is None else gain
            kernels.signal_of(light, signal, self.linear, self.root, self.zero, most, *shares)
            return signal
        if self.root:
            if light.min() < 0:  # by rounding alone
                light = np.maximum(light, np.float32(0))
            cv2.addWeighted(light, self.linear, cv2.sqrt(light), self.root, self.zero, dst=signal)
        else:
            cv2.addWeighted(light, self.linear, light, 0, self.zero, dst=signal)
        if gain is not None:  # what dark pixels give has none
            cv2.accumulateProduct(signal - np.float32(self.zero), gain.numbers(), signal)
        if most < math.inf:
            np.minimum(signal, np.float32(most), out=signal)
        return signal

    def at(self, light: float) -> float:
        """The noiseless signal of one in-band radiance, W/m2/sr, 0 or more."""
        return self.linear * light + self.root * math.sqrt(light) + self.zero

    def raised(self, light: float, by: float) -> float:
        """How much more light than that, W/m2/sr, raises the signal by so much, 0 or more.

        Not `by` over the derivative, which is infinite without light: sqrt(x) of the light x with a x + b sqrt(x) = c
        is 2 c / (b + sqrt(b^2 + 4 a c)).
        """
        if by == 0:
            return 0.0
        signal = self.at(light) - self.zero + by
        after = 2 * signal / (self.root + math.sqrt(self.root**2 + 4 * self.linear * signal))
        return by / (self.linear + self.root / (after + math.sqrt(light)))  # x - light, no digits lost

    def counts(
        self,
        signal: Floats,
        out: Counts | None = None,
        added: Sequence[Words] = (),
        lines: Lines | None = None,
    ) -> Counts:
        """Counts of a signal, which is changed, and of what is added to it; in `out`, where it is given, past the
        processor's caches: whoever gives it reads them later.

        Rounded to the nearest (halves to even) and clipped to the depth: they saturate and never wrap around.
        """
        counts = np.empty(signal.shape, np.uint16) if out is None else out
        compiled = COMPILED and signal.dtype == np.float32 and signal.flags.c_contiguous
        together = added[-MOST_ADDED:] if compiled else ()
        for values, unit in added[: len(added) - len(together)]:
            cv2.scaleAdd(values.astype(np.float32), unit, signal, dst=signal)
        if compiled:
            flat = [part for pair in together for part in pair]
            down, across = lines or (None, None)
            kernels.counts_of(
                signal, counts, 1 / self.gain, self.offset, self.full, out is not None, down, across, *flat
            )
            return counts
        if lines is not None:
            signal += np.add.outer(*lines)
        most = np.float32(MOST_COUNTS * self.gain)
        if cv2.norm(signal, cv2.NORM_INF) > most:  # would wrap in the conversion
            np.clip(signal, -most, most, out=signal)
        cv2.addWeighted(signal, 1 / self.gain, signal, 0, self.offset, dst=counts, dtype=cv2.CV_16U)
        if self.full < MOST_COUNTS:
            cv2.threshold(counts, self.full, 0, cv2.THRESH_TRUNC, dst=counts)
        return counts


class Detector(Kind):
    """A way from radiance to counts."""

    terms: ClassVar[tuple[dict[str, Any], ...]]
    """The noise terms of a camera that names none."""
    heeds: ClassVar[tuple[str, ...]] = ("netd_mk", "range_k")
    """Of these two keys of the camera those that its response depends on."""
    counts_electrons: ClassVar[bool] = False
    """Is its signal in electrons, so that there may be noise of their number?"""
    timed_by: ClassVar[str | None] = None
    """Its key that says over which time it gathers the light of a frame, ms; None where none does."""

    @property
    def exposure_ms(self) -> float | None:
        """Time over which it gathers the light of a frame, ms; None where it does not say."""
        return None if self.timed_by is None else float(getattr(self, self.timed_by))

    @property
    def optics(self) -> tuple[float, float] | None:
        """F-number and side of a pixel, um, that its light follows from; None where it does not say."""
        return None

    @abstractmethod
    def response(self, setting: Setting) -> Response:
        """How it answers in a camera of that setting."""


class Stated(Detector):
    """Linear in radiance: count 0 and full scale by the camera's range_k, noise by its netd_mk."""

    terms = ({"kind": "white"},)

    def response(self, setting: Setting) -> Response:
        """NETD is the change of temperature at 300 K that moves the mean count by one sigma: sigma = NETD dN/dT."""
        scale = Scale.between(setting.band, setting.range_k, setting.bits)
        return Response(
            linear=scale.linear,
            root=scale.root,
            zero=scale.zero,
            well=math.inf,
            noise=setting.netd_mk * 1e-3 * slope(setting.band, NETD_K) * scale.linear,
            netd_mk=setting.netd_mk,
            gain=1.0,
            offset=0.0,
            full=2**setting.bits - 1,
            electrons=False,
            read=0.0,
        )


class Electrons(Detector):
    """Photons counted in a well: the camera's NETD follows (netd_mk and range_k do not count).

    S = A pi tau / (4 F^2 + 1) eta t Q(L) + dark current: A the pixel's area, tau the optics' transmittance,
    eta the quantum efficiency, t the integration time, Q the in-band photon radiance. The defaults are a
    cooled InSb camera: in 3.4-4.9 um 2.58 million electrons and 17.7 mK at 300 K.
    """

    terms = ({"kind": "shot"},)
    heeds = ()
    counts_electrons = True
    timed_by = "integration_ms"

    pitch_um: Annotated[float, Field(gt=0, le=1000)] = 15.0
    """Side of a pixel, um; all of it is sensitive."""
    f_number: Annotated[float, Field(ge=0.5, le=100)] = 4.0
    """Focal length over the diameter of the aperture."""
    transmittance: Annotated[float, Field(gt=0, le=1)] = 0.85
    """Of the optics, in band."""
    quantum_efficiency: Annotated[float, Field(gt=0, le=1)] = 0.8
    """Electrons per photon."""
    integration_ms: Annotated[float, Field(gt=0, le=10_000)] = 10.0
    """Integration time, ms."""
    well_me: Annotated[float, Field(gt=0, le=10_000)] = 7.0
    """Full well, million electrons."""
    read_noise_e: Annotated[float, Field(ge=0, le=1e6)] = 400.0
    """Sigma of the noise of reading, electrons."""
    dark_me_s: NotNegative = 0.0
    """Dark current, million electrons a second."""
    gain_e: Positive | None = None
    """Electrons per count; where not given, a full well is the highest count."""
    offset: NotNegative = 0.0
    """Count of no electrons."""

    @property
    def optics(self) -> tuple[float, float]:
        return self.f_number, self.pitch_um

    def flux_factor(self) -> float:
        """Electrons per unit of in-band photon radiance (1/s/m2/sr) in one integration."""
        solid = math.pi / (4 * self.f_number**2 + 1) * self.transmittance
        return (self.pitch_um * 1e-6) ** 2 * solid * self.quantum_efficiency * self.integration_ms * 1e-3

    def response(self, setting: Setting) -> Response:
        """The curve a L + b sqrt(L) that has the photon radiance of Planck's law and its slope at 300 K.

        It keeps within 2.1 % of it from 250 to 400 K in 3-5 um and within 0.4 % in 8-12 um. Of hotter bodies it makes
        more electrons than there are, as their photons are bluer, less per watt: in 3-5 um by 4.5 % at 500 K, 12 % at
        1000 K and 16 % at 2000 K (motors, flares), in 8-12 um by 0.8, 1.9 and 2.4 %; by 18 and 2.7 % at most.
        """
        light, rise = float(radiance(setting.band, NETD_K)), slope(setting.band, NETD_K)
        photons, photon_rise = photon_radiance(setting.band, NETD_K), photon_slope(setting.band, NETD_K)
        factor = self.flux_factor()
        root = 2 * (photons - photon_rise * light / rise) / math.sqrt(light)
        linear = (photons - root * math.sqrt(light)) / light
        full = 2**setting.bits - 1
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


DETECTORS = Family("detector", Detector, {"stated": Stated, "electrons": Electrons})
"""Ways from radiance to counts."""
