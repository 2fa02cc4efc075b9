"""The camera of a scenario."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.camera.detectors import (
    DETECTORS,
    NOISES,
    Bloom,
    Correction,
    Detector,
    Lag,
    Noise,
    Response,
    Sensor,
    Setting,
    Stated,
    White,
)
from irsim.camera.displays import AGCS, Agc, Linear, Plain
from irsim.camera.frame_loss import FAULTS, Fault, arrivals
from irsim.camera.motion_blur import SHARP, Smear
from irsim.camera.presets import PRESETS, Preset
from irsim.camera.vignetting import Falloff, VignettingMap
from irsim.config.base import Part, Several, Switches
from irsim.config.field_annotations import Items, Plausible
from irsim.config.quantities import ScaleKelvin
from irsim.geometry.projection import Geometry
from irsim.motion import CAMERA_MOTIONS, CameraMotion
from irsim.physics.optics import Lens
from irsim.physics.radiometry import band_fault
from irsim.types import BandName, Floats

Side = Annotated[int, Field(ge=16, le=4096)]
FrameRate = Annotated[float, Field(ge=0.001, le=10_000), Plausible(0.001, 2000, "Hz")]
"""A round bound of our own: beyond it hardly a camera reads whole frames, and a period in microseconds, or pixels a
second, may be what was written."""
Blur = Annotated[float, Field(ge=0, le=20), Plausible(0, 5, "px")]
"""A sigma of 5 px spreads a point over more than a hundred pixels: no camera is so far out of focus, and small targets
are blurred to nothing."""


class Camera(Part):
    """An infrared camera, from direction to counts. With `noise: []` it has no noise at all; with `netd_mk: 0` that of
    gains, of bad pixels and of counted electrons is left."""

    switches: ClassVar[Switches] = {"psf": ("psf_px", 0.0), "agc": ("agc", Plain())}

    preset: Preset | None = None
    """A camera of the trade; keys given beside it override its own."""
    size: Annotated[tuple[Side, Side], Field(strict=False)] = (320, 240)
    """Columns, rows."""
    rate_hz: FrameRate = 30.0
    """Frames a second."""
    ifov_mrad: Annotated[float, Field(ge=0.001, le=20)] = 0.5
    """Field of view of one pixel, milliradian."""
    elevation_deg: Annotated[float, Field(ge=-80, le=80)] = 0.0
    """Elevation of the first pointing above the horizon."""
    band: BandName | Annotated[tuple[float, float], Field(strict=False), Items("[low, high] in um")] = "mwir"
    """mwir 3-5 um, lwir 8-12 um, or [low, high], limits in um (from 2 to 20)."""
    bits: Annotated[int, Field(ge=8, le=16)] = 14
    """Depth of the counts."""
    range_k: Annotated[tuple[ScaleKelvin, ScaleKelvin], Field(strict=False)] = (220.0, 400.0)
    """Scene temperatures that give count 0 and full scale, for a detector of kind stated."""
    psf_px: Blur = 0.6
    """Sigma of the optical blur (Gaussian), px; with `optics`, of what aberrations add to them."""
    optics: Lens | None = None
    """Diffraction and defocus; where not given, `psf_px` stands for all blur."""
    netd_mk: Annotated[float, Field(ge=0, le=10_000)] = 40.0
    """Noise-equivalent temperature difference at 300 K, mK, the unit of every noise term: of a stated detector.
    One that counts electrons has the NETD that follows from them."""
    detector: Annotated[Detector, DETECTORS] = Stated()
    """How light becomes counts."""
    time_constant_ms: Annotated[float, Field(ge=0, le=200)] = 0.0
    """Time in which the detector follows a change of light to 1 - 1/e, ms (microbolometers 7-12); 0 is at once."""
    noise: Several[Annotated[Noise, NOISES]] = (White(),)
    """Noise terms; each adds its own. Where none are given, shot noise for a detector in electrons."""
    correction: Correction | None = None
    """When the camera corrects its non-uniformity; never where not given."""
    falloff: Falloff | None = None
    """How the picture darkens off the axis; not at all where not given."""
    smear: Smear | None = None
    """Blur by motion while a frame is exposed; none where not given."""
    bloom: Bloom | None = None
    """What saturated pixels spill into others; nothing where not given."""
    motion: Several[Annotated[CameraMotion, CAMERA_MOTIONS]] = ()
    """Motions of the camera; they add up."""
    faults: Several[Annotated[Fault, FAULTS]] = ()
    """What happens to frames on their way; what arrives is numbered anew."""
    agc: Annotated[Agc, AGCS] = Linear()
    """How counts become the 8-bit picture."""

    @classmethod
    def filled(cls, given: Mapping[str, Any]) -> Mapping[str, Any]:
        """Those of its preset, and the noise that goes with its detector."""
        preset = given.get("preset")
        keys = PRESETS.get(preset, {}) if isinstance(preset, str) else {}  # type: ignore[call-overload]  # a user's text may name no preset
        filled = {**keys, **given}
        detector = filled.get("detector")
        if isinstance(detector, Mapping):
            if "kind" not in detector and "detector" in keys:
                detector = filled["detector"] = {**keys["detector"], **detector}
            kind = DETECTORS.kinds.get(str(detector.get("kind")))
            if "noise" not in filled and kind is not None and issubclass(kind, Detector):
                filled["noise"] = list(kind.terms)
        elif isinstance(detector, Detector) and "noise" not in filled:
            filled["noise"] = list(detector.terms)
        return filled

    @model_validator(mode="after")
    def _detector_fits(self) -> Camera:
        exposure_ms = self.detector.exposure_ms
        if exposure_ms is not None and exposure_ms * self.rate_hz > 1000:
            raise _too_long(exposure_ms, self.rate_hz, ("detector", str(self.detector.timed_by)))
        for index, noise in enumerate(self.noise):
            if noise.needs_electrons and not self.detector.counts_electrons:
                raise PydanticCustomError(
                    "no_electrons",
                    "{name} counts electrons, and this detector has none; allowed: detector: {kind: electrons}",
                    {"name": noise.name, "at": ("noise", index, "kind")},
                )
        counting = [(k, noise.name) for k, noise in enumerate(self.noise) if type(noise).count is not Noise.count]
        if len(counting) > 1:
            (_, first), (index, name), *_ = counting
            raise PydanticCustomError(
                "counted_twice",
                "{name} counts electrons that {first} counts already; allowed: one noise that counts them",
                {"name": name, "first": first, "at": ("noise", index, "kind")},
            )
        return self

    @model_validator(mode="after")
    def _range_rises(self) -> Camera:
        if self.range_k[0] >= self.range_k[1]:
            raise PydanticCustomError(
                "range_k",
                "{low} K is not below {high} K; allowed: the lower temperature first",
                {"low": self.range_k[0], "high": self.range_k[1], "at": ("range_k",)},
            )
        return self

    @model_validator(mode="after")
    def _band_can_be(self) -> Camera:
        fault = band_fault(self.band)
        if fault is not None:
            raise PydanticCustomError("band", "{fault}", {"fault": fault, "at": ("band",)})
        return self

    @model_validator(mode="after")
    def _smear_fits(self) -> Camera:
        if self.smear is None:
            return self
        if self.smear.time_ms is None and self.detector.exposure_ms is None:
            raise PydanticCustomError(
                "no_time",
                "it is missing; allowed: a time in ms; or a detector of kind electrons, whose integration_ms counts",
                {"at": ("smear", "time_ms")},
            )
        if self.smeared_ms * self.rate_hz > 1000:
            raise _too_long(self.smeared_ms, self.rate_hz, ("smear", "time_ms"))
        return self

    @model_validator(mode="after")
    def _lens_can_be_drawn(self) -> Camera:
        fault = self.optics.fault(self.band) if self.optics is not None and band_fault(self.band) is None else None
        if fault is not None:
            raise PydanticCustomError("optics", "{fault}", {"fault": fault, "at": ("optics", "f_number")})
        return self

    @property
    def smeared_ms(self) -> float:
        """Time over which motion blurs a frame, ms; 0 where it does not."""
        if self.smear is None:
            return 0.0
        time_ms = self.detector.exposure_ms if self.smear.time_ms is None else self.smear.time_ms
        return time_ms or 0.0

    def instants(self, is_on: Callable[[str], bool] = lambda name: True) -> tuple[float, ...]:
        """When the scenes are, frames from its time, of which a frame is the mean."""
        if self.smear is None or not is_on("smear"):
            return SHARP
        return self.smear.instants(self.smeared_ms * 1e-3 * self.rate_hz)

    @property
    def geometry(self) -> Geometry:
        return Geometry(self.size, self.ifov_mrad * 1e-3, math.radians(self.elevation_deg))

    def names(self) -> Iterator[tuple[str, tuple[str | int, ...]]]:
        """Name and place of everything in the camera that can be switched off."""
        for key in ("noise", "motion", "faults"):
            for index, part in enumerate(getattr(self, key)):
                yield part.name, (key, index, "id")
        for key in ("optics", "smear", "correction", "falloff", "bloom"):
            if getattr(self, key) is not None:
                yield key, (key,)
        if self.time_constant_ms:
            yield "lag", ("time_constant_ms",)

    def response(self) -> Response:
        """The detector, made ready."""
        return self.detector.response(Setting(self.band, self.bits, self.netd_mk, self.range_k))

    def netd(self) -> float:
        """Noise-equivalent temperature difference at 300 K, mK: sigma of the pixel's noise over its rise per kelvin."""
        return self.response().netd_mk

    def sensor(
        self, seed: int, is_on: Callable[[str], bool] = lambda name: True, zooms: Floats | None = None
    ) -> Sensor:
        """The detector with the noise terms whose names are switched on, in a scene of that seed.

        zooms  (n,) how many times longer than at first the focal length is in each frame; where not given, as long
        """
        falloff = VignettingMap(self.falloff, self.geometry, zooms) if self.falloff and is_on("falloff") else None
        return Sensor(
            response=self.response(),
            noises=tuple(noise for noise in self.noise if is_on(noise.name)),
            rate_hz=self.rate_hz,
            seed=seed,
            bloom=self.bloom if is_on("bloom") else None,
            correction=self.correction if is_on("correction") else None,
            falloff=falloff,
        )

    def arrivals(self, count: int, seed: int, is_on: Callable[[str], bool] = lambda name: True) -> Sequence[int]:
        """Of the first `count` frames those that arrive, in order."""
        return arrivals([fault for fault in self.faults if is_on(fault.name)], count, seed)

    def lag(self, is_on: Callable[[str], bool] = lambda name: True) -> Lag:
        """How the detector follows the light."""
        return Lag(self.time_constant_ms * 1e-3 if is_on("lag") else 0.0, self.rate_hz)


def _too_long(time_ms: float, rate_hz: float, at: tuple[str, ...]) -> PydanticCustomError:
    return PydanticCustomError(
        "integration",
        "{time} ms do not fit into a frame at {rate} Hz; allowed: at most {most} ms",
        {"time": time_ms, "rate": rate_hz, "most": f"{1000 / rate_hz:g}", "at": at},
    )
