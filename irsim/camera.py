"""The camera of a scenario."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.detector import NOISES, Noise, White
from irsim.display import AGCS, Agc, Linear
from irsim.geometry import Geometry
from irsim.kinds import Kelvin, Pair, Part, Several
from irsim.motion import POINTINGS, Pointing
from irsim.radiometry import BandName, band_fault

Side = Annotated[int, Field(ge=16, le=4096)]


class Camera(Part):
    """An infrared camera, from direction to counts. With `netd_mk: 0` it has no noise at all."""

    size: Annotated[tuple[Side, Side], Field(strict=False)] = (320, 240)
    """Columns, rows."""
    rate_hz: Annotated[float, Field(gt=0, le=10_000)] = 30.0
    """Frames a second."""
    ifov_mrad: Annotated[float, Field(gt=0, le=20)] = 0.5
    """Field of view of one pixel, milliradian."""
    elevation_deg: Annotated[float, Field(ge=-80, le=80)] = 0.0
    """Elevation of the first pointing above the horizon."""
    band: BandName | Pair = "mwir"
    """mwir 3-5 um, lwir 8-12 um, or [low, high], limits in um (from 2 to 20)."""
    bits: Annotated[int, Field(ge=8, le=16)] = 14
    """Depth of the counts."""
    range_k: Annotated[tuple[Kelvin, Kelvin], Field(strict=False)] = (220.0, 400.0)
    """Scene temperatures that give count 0 and full scale."""
    psf_px: Annotated[float, Field(ge=0, le=20)] = 0.6
    """Sigma of the optical blur (Gaussian), px."""
    netd_mk: Annotated[float, Field(ge=0, le=10_000)] = 40.0
    """Noise-equivalent temperature difference at 300 K, mK: the unit of every noise term."""
    noise: Several[Annotated[Noise, NOISES]] = (White(),)
    """Noise terms; each adds its own."""
    motion: Several[Annotated[Pointing, POINTINGS]] = ()
    """Motions of the camera; they add up."""
    agc: Annotated[Agc, AGCS] = Linear()
    """How counts become the 8-bit picture."""

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

    @property
    def geometry(self) -> Geometry:
        return Geometry(self.size, self.ifov_mrad * 1e-3, math.radians(self.elevation_deg))
