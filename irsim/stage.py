"""What every part of a scene may know of the whole."""

from __future__ import annotations

from dataclasses import dataclass

from irsim.geometry import Geometry
from irsim.radiometry import Band


@dataclass(frozen=True)
class Stage:
    """seed of the scene; geometry of the camera; rate_hz; band; psf_px, the optical blur's sigma in px."""

    seed: int
    geometry: Geometry
    rate_hz: float
    band: Band
    psf_px: float
