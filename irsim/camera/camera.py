"""The camera of a scenario: its keys and their consistency, and the signal chain that they describe."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, LiteralString

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.camera import AGCS, FRAME_FAULTS, NOISES, SENSORS
from irsim.camera.agc import Agc, Linear, Plain
from irsim.camera.bloom import Bloom
from irsim.camera.drift import Correction
from irsim.camera.frame_loss import FrameFault, arriving_frames
from irsim.camera.motion_blur import NO_BLUR, MotionBlur
from irsim.camera.noise import White
from irsim.camera.noise_base import Noise
from irsim.camera.presets import PRESETS, Preset
from irsim.camera.response import Response, ResponseTime
from irsim.camera.sensor import NetdSensor, Sensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.camera.vignetting import Vignetting, VignettingMap
from irsim.config.base import Part, Several, Switches, is_handwritten
from irsim.config.fields import Items, Plausible
from irsim.config.quantities import ScaleKelvin
from irsim.geometry.projection import Geometry
from irsim.motion import CAMERA_MOTIONS, CameraMotion
from irsim.physics.lens import Lens
from irsim.physics.radiometry import band_fault
from irsim.types import BandName, Floats

Side = Annotated[int, Field(ge=16, le=4096)]
FrameRate = Annotated[float, Field(ge=0.001, le=10_000), Plausible(0.001, 2000, "Hz")]
"""Frame rate, Hz: few cameras read whole frames above 2 kHz, and a larger value is probably a period in microseconds or
a pixel rate."""
Blur = Annotated[float, Field(ge=0, le=20), Plausible(0, 5, "px")]
"""Sigma of a blur, px: with 5 px a point covers more than a hundred pixels, and small targets vanish."""

OPTICS_KEYS = ("f_number", "pitch_um")
"""Keys of `optics` that a detector of kind `electrons` defines."""


class Camera(Part):
    """Infrared camera: geometry, optics, detector, noise and display. `noise: []` removes all noise; `netd_mk: 0`
    leaves gain noise, bad pixels and shot noise."""

    switches: ClassVar[Switches] = {"psf": ("psf_px", 0.0), "agc": ("agc", Plain())}

    preset: Preset | None = None
    """Typical camera; keys that the scenario gives override those of the preset."""
    size: Annotated[tuple[Side, Side], Field(strict=False)] = (320, 240)
    """Columns, rows."""
    rate_hz: FrameRate = 30.0
    """Frames a second."""
    ifov_mrad: Annotated[float, Field(ge=0.001, le=20)] = 0.5
    """Field of view of one pixel, milliradian."""
    elevation_deg: Annotated[float, Field(ge=-80, le=80)] = 0.0
    """Elevation of the initial line of sight above the horizon, degrees."""
    band: BandName | Annotated[tuple[float, float], Field(strict=False), Items("[low, high] in um")] = "mwir"
    """mwir 3-5 um, lwir 8-12 um, or [low, high], limits in um (from 2 to 20)."""
    bits: Annotated[int, Field(ge=8, le=16)] = 14
    """Depth of the counts."""
    range_k: Annotated[tuple[ScaleKelvin, ScaleKelvin], Field(strict=False)] = (220.0, 400.0)
    """Scene temperatures that give count 0 and full scale, for a detector of kind `stated`."""
    psf_px: Blur = 0.6
    """Sigma of the Gaussian optical blur, px; with `optics`, of the aberrations alone."""
    optics: Lens | None = None
    """Diffraction and defocus; by default `psf_px` is the whole blur. A detector of kind `electrons` defines F-number
    and pitch."""
    netd_mk: Annotated[float, Field(ge=0, le=10_000)] = 40.0
    """Noise-equivalent temperature difference at 300 K, mK: the unit of every noise term. It applies to a detector of
    kind stated; for kind electrons it follows from the electrons."""
    detector: Annotated[Sensor, SENSORS] = NetdSensor()
    """Conversion of light to counts."""
    time_constant_ms: Annotated[float, Field(ge=0, le=200)] = 0.0
    """Thermal time constant of the detector, ms (microbolometers 7-12); 0 is at once."""
    noise: Several[Annotated[Noise, NOISES]] = (White(),)
    """Noise terms; they add up. By default white noise, or shot noise for a detector of kind `electrons`."""
    correction: Correction | None = None
    """Non-uniformity corrections; none by default."""
    falloff: Vignetting | None = None
    """Vignetting: loss of light off the axis; none by default."""
    smear: MotionBlur | None = None
    """Motion blur over the exposure of a frame; none by default."""
    bloom: Bloom | None = None
    """Charge that saturated pixels spill into other pixels; none by default."""
    motion: Several[Annotated[CameraMotion, CAMERA_MOTIONS]] = ()
    """Motions of the camera; they add up."""
    faults: Several[Annotated[FrameFault, FRAME_FAULTS]] = ()
    """Frames that are lost or arrive twice; frames that arrive are numbered without gaps."""
    agc: Annotated[Agc, AGCS] = Linear()
    """Mapping of counts to the 8-bit picture."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return the given keys, completed by the preset and by the detector's default noise, F-number and pitch."""
        preset = given.get("preset")
        keys = PRESETS.get(preset, {}) if isinstance(preset, str) else {}  # type: ignore[call-overload]  # an unknown preset has no keys
        filled = {**keys, **given}
        detector = filled.get("detector")
        if isinstance(detector, Mapping):
            if "kind" not in detector and "detector" in keys:
                detector = filled["detector"] = {**keys["detector"], **detector}
            kind = SENSORS.kinds.get(str(detector.get("kind")))
            if "noise" not in filled and kind is not None and issubclass(kind, Sensor):
                filled["noise"] = list(kind.default_noise)
        elif isinstance(detector, Sensor) and "noise" not in filled:
            filled["noise"] = list(detector.default_noise)
        if filled.get("optics") is not None:
            filled["optics"] = _with_detector_optics(filled["optics"], filled.get("detector"))
        return filled

    @model_validator(mode="after")
    def _keys_agree(self) -> Camera:
        """Refuse the first contradiction between keys."""
        detector, smear, own_ms = self.detector, self.smear, self.detector.integration_time_ms
        if own_ms is not None and own_ms * self.rate_hz > 1000:
            raise _too_long(own_ms, self.rate_hz, ("detector", str(detector.integration_key)))
        self._check_electrons()
        self._check_optics()
        if self.range_k[0] >= self.range_k[1]:
            text = "{low} K is not below {high} K; allowed: the lower temperature first"
            raise _fault("range_k", text, ("range_k",), low=self.range_k[0], high=self.range_k[1])
        if reason := band_fault(self.band):
            raise _fault("band", "{reason}", ("band",), reason=reason)
        if smear is not None:
            if smear.time_ms is None and own_ms is None:
                text = "it is missing; allowed: a time in ms, or a detector of kind electrons with its integration_ms"
                raise _fault("no_time", text, ("smear", "time_ms"))
            if self.exposure_ms * self.rate_hz > 1000:
                raise _too_long(self.exposure_ms, self.rate_hz, ("smear", "time_ms"))
        if self.optics is not None and (reason := self.optics.fault(self.band)):
            raise _fault("optics", "{reason}", ("optics", "f_number"), reason=reason)
        return self

    def _check_electrons(self) -> None:
        """Refuse shot noise where the signal is not in electrons, and a second term of shot noise."""
        first = None
        for index, noise in enumerate(self.noise):
            at = ("noise", index, "kind")
            if noise.counts_electrons and not self.detector.counts_electrons:
                text = "{name} counts electrons, and this detector has none; allowed: detector: {kind: electrons}"
                raise _fault("no_electrons", text, at, name=noise.name)
            if noise.counts_electrons:
                if first is not None:
                    text = "{name} counts electrons that {first} counts already; allowed: one noise that counts them"
                    raise _fault("counted_twice", text, at, name=noise.name, first=first)
                first = noise.name

    def _check_optics(self) -> None:
        """Refuse an F-number or pitch of `optics` that is not the detector's; in old recordings they may differ."""
        lens, detector = self.optics, self.detector.optics
        if lens is None or detector is None or not is_handwritten():
            return
        for key, value, known in zip(OPTICS_KEYS, (lens.f_number, lens.pitch_um), detector, strict=True):
            if not math.isclose(value, known, rel_tol=1e-6):
                text = "{value} is not the {key} of the detector, {known}; allowed: {known}, or leave it out"
                raise _fault("two_lenses", text, ("optics", key), value=f"{value:g}", key=key, known=f"{known:g}")

    @property
    def exposure_ms(self) -> float:
        """Exposure time of motion blur, ms; 0 without motion blur."""
        if self.smear is None:
            return 0.0
        time_ms = self.detector.integration_time_ms if self.smear.time_ms is None else self.smear.time_ms
        return time_ms or 0.0

    def exposure_offsets(self, is_on: Callable[[str], bool] = lambda name: True) -> tuple[float, ...]:
        """Return the times of the scenes averaged in a frame, in frame periods from the frame's time. `is_on` returns
        True for the name of a part that is switched on."""
        if self.smear is None or not is_on("smear"):
            return NO_BLUR
        return self.smear.exposure_offsets(self.exposure_ms * 1e-3 * self.rate_hz)

    @property
    def geometry(self) -> Geometry:
        return Geometry(self.size, self.ifov_mrad * 1e-3, math.radians(self.elevation_deg))

    def names(self) -> Iterator[tuple[str, tuple[str | int, ...]]]:
        """Yield the name and the key path of each part of the camera that can be switched off."""
        for key in ("noise", "motion", "faults"):
            for index, part in enumerate(getattr(self, key)):
                yield part.name, (key, index, "id")
        for key in ("optics", "smear", "correction", "falloff", "bloom"):
            if getattr(self, key) is not None:
                yield key, (key,)
        if self.time_constant_ms:
            yield "lag", ("time_constant_ms",)

    def response(self) -> Response:
        """Return the response of the focal plane."""
        return self.detector.response(SensorSettings(self.band, self.bits, self.netd_mk, self.range_k))

    def netd(self) -> float:
        """Return the noise-equivalent temperature difference at 300 K, mK: a pixel's sigma over its signal per
        kelvin."""
        return self.response().netd_mk

    def signal_chain(
        self, seed: int, is_on: Callable[[str], bool] = lambda name: True, zooms: Floats | None = None
    ) -> SignalChain:
        """Return the chain from light to counts, with the parts that are switched on, for the scene's seed.

        zooms  (n,) focal length in each frame relative to the initial one; None without zoom
        """
        falloff = VignettingMap(self.falloff, self.geometry, zooms) if self.falloff and is_on("falloff") else None
        return SignalChain(
            response=self.response(),
            noises=tuple(noise for noise in self.noise if is_on(noise.name)),
            rate_hz=self.rate_hz,
            seed=seed,
            bloom=self.bloom if is_on("bloom") else None,
            correction=self.correction if is_on("correction") else None,
            vignetting=falloff,
        )

    def response_time(self, is_on: Callable[[str], bool] = lambda name: True) -> ResponseTime:
        """Return the low-pass of light by the detector's time constant."""
        return ResponseTime(self.time_constant_ms * 1e-3 if is_on("lag") else 0.0, self.rate_hz)

    def arriving_frames(self, count: int, seed: int, is_on: Callable[[str], bool] = lambda name: True) -> Sequence[int]:
        """Return the indices of the first `count` frames that arrive, in order."""
        return arriving_frames([fault for fault in self.faults if is_on(fault.name)], count, seed)


def _with_detector_optics(optics: Any, detector: Any) -> Any:
    """Return optics, valid or not, with the F-number and pitch of the detector as defaults."""
    try:
        sensor = SENSORS.parse(detector)
    except PydanticCustomError:  # reported at the key of the detector
        return optics
    if not isinstance(sensor, Sensor) or sensor.optics is None:
        return optics
    known = dict(zip(OPTICS_KEYS, sensor.optics, strict=True))
    if isinstance(optics, Lens):
        return optics.model_copy(update={key: known[key] for key in known if key not in optics.model_fields_set})
    return {**known, **optics} if isinstance(optics, Mapping) else optics


def _fault(kind: LiteralString, text: LiteralString, at: tuple[str | int, ...], **values: Any) -> PydanticCustomError:
    return PydanticCustomError(kind, text, {**values, "at": at})


def _too_long(time_ms: float, rate_hz: float, at: tuple[str, ...]) -> PydanticCustomError:
    text = "{time} ms do not fit into a frame at {rate} Hz; allowed: at most {most} ms"
    return _fault("integration", text, at, time=time_ms, rate=rate_hz, most=f"{1000 / rate_hz:g}")
