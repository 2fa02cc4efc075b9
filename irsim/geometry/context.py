"""What every part of a scene may know of the whole."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

from irsim.geometry.projection import Geometry
from irsim.physics.atmosphere import Atmosphere
from irsim.physics.psf import PSF, GaussianPSF
from irsim.physics.radiometry import grey_body
from irsim.types import Band, Floats


class SceneObjects(Protocol):
    """Who else is in the scene: asked by what follows, crosses, hides or looks at another part of it."""

    def way(self, name: str, frames: Floats, context: SceneContext) -> Floats:
        """(n, 3) m, first camera frame: where target `name` is at frame numbers (n,), drawn or not."""
        ...

    def standpoints(self, frames: Floats, context: SceneContext) -> Floats:
        """(n, 3) m, first camera frame: where the camera is."""
        ...

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        """(n,) how many times longer the camera's focal length is than at first."""
        ...


NOTHING = Atmosphere()
"""Air that does nothing."""


@dataclass(frozen=True)
class SceneContext:
    """seed of the scene; geometry of the camera; rate_hz; band; psf_px, the optical blur's sigma in px, or
    that of the Gaussian about as wide (see `psf`); cast, who else is in the scene (None: nobody); air, what is between
    (by default nothing); lens, the point spread where it is no Gaussian; ambient, the radiance in W/m2/sr of
    what is around where the air does not say; leaves_k, how warm leaves are by the hour of the background, K (None: it
    has none)."""

    seed: int
    geometry: Geometry
    rate_hz: float
    band: Band
    psf_px: float
    cast: SceneObjects | None = field(default=None, compare=False, repr=False)
    air: Atmosphere = NOTHING
    lens: PSF | None = None
    ambient: float = 0.0
    leaves_k: float | None = None

    @cached_property
    def psf(self) -> PSF:
        """The point spread that all is drawn with, but smoke and the sea's horizon: they have the width `psf_px`."""
        return self.lens or GaussianPSF(self.psf_px)

    def zoomed(self, geometry: Geometry) -> SceneContext:
        """The same through a longer focal length. The optics blur as many px as before, at the same F-number; turbulent
        air blurs by an angle, which is more px now."""
        blur_rad, ifovs = self.air.turbulence.blur_rms(self.band), (geometry.ifov_rad, self.geometry.ifov_rad)
        if blur_rad == 0:
            return replace(self, geometry=geometry)
        more_px = blur_rad * math.sqrt(max(ifovs[0] ** -2 - ifovs[1] ** -2, 0.0))
        wider = self.lens and self.lens.broadened(more_px)
        return replace(self, geometry=geometry, psf_px=math.hypot(self.psf_px, more_px), lens=wider)

    @cached_property
    def surroundings(self) -> float:
        """Radiance that grey bodies reflect, W/m2/sr."""
        said = self.air.surroundings(self.band)
        return self.ambient if said is None else said

    def glow(self, temperature_k: float | Floats, emissivity: float | Floats) -> Floats:
        """Radiance of a grey body, W/m2/sr: what it emits, and what it reflects of its surroundings."""
        return grey_body(self.band, temperature_k, emissivity, self.surroundings)

    def through(
        self, emission: Floats, alpha: Floats, range_m: float | Floats, elevation_rad: float | Floats
    ) -> Floats:
        """Emission, W/m2/sr, of something that replaces the share `alpha` of the light, as it arrives through the
        air from a range, m, at an elevation, rad (arrays broadcast)."""
        return self.air.through(self.band, emission, alpha, range_m, elevation_rad)
