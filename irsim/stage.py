"""What every part of a scene may know of the whole."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from irsim.geometry import Geometry
from irsim.radiometry import Band
from irsim.types import Floats


class Cast(Protocol):
    """Who else is in the scene: asked by what follows, crosses, hides or looks at another part of it."""

    def way(self, name: str, frames: Floats, stage: Stage) -> Floats:
        """(n, 3) m, first camera frame: where target `name` is at frame numbers (n,), drawn or not."""
        ...

    def standpoints(self, frames: Floats, stage: Stage) -> Floats:
        """(n, 3) m, first camera frame: where the camera is."""
        ...


@dataclass(frozen=True)
class Stage:
    """seed of the scene; geometry of the camera; rate_hz; band; psf_px, the optical blur's sigma in px;
    cast, who else is in the scene (None: nobody)."""

    seed: int
    geometry: Geometry
    rate_hz: float
    band: Band
    psf_px: float
    cast: Cast | None = field(default=None, compare=False, repr=False)
