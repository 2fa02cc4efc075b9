"""Scene-wide context shared by all parts of a scene."""

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
    """Access to the other objects of a scene, for parts that follow, cross, hide or point at them."""

    def target_positions(self, name: str, frames: Floats, context: SceneContext) -> Floats:
        """Return the positions (n, 3) m of target `name` at frame numbers (n,), in the first camera frame."""
        ...

    def camera_positions(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the positions (n, 3) m of the camera at frame numbers (n,), in the first camera frame."""
        ...

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the focal length (n,) at frame numbers (n,), relative to that of frame 0."""
        ...


CLEAR_AIR = Atmosphere()
"""Atmosphere without attenuation and path radiance."""


@dataclass(frozen=True)
class SceneContext:
    """Properties of a scene that all its parts share.

    seed      of all random streams
    geometry  of the first camera frame
    rate_hz   frame rate
    band      spectral band
    psf_px    sigma of the optical blur, px; for another PSF the sigma of a Gaussian of about its width (see `psf`)
    objects   the other objects of the scene, None if there are none
    air       atmosphere between camera and objects
    lens      point spread function if it is not Gaussian
    ambient   radiance of the surroundings, W/m2/sr, unless the atmosphere defines it
    leaves_k  temperature of leaves at the background's hour, K; None if the background defines no hour
    """

    seed: int
    geometry: Geometry
    rate_hz: float
    band: Band
    psf_px: float
    objects: SceneObjects | None = field(default=None, compare=False, repr=False)
    air: Atmosphere = CLEAR_AIR
    lens: PSF | None = None
    ambient: float = 0.0
    leaves_k: float | None = None

    @cached_property
    def psf(self) -> PSF:
        """Point spread function of all objects; smoke and the horizon of the sea use its width `psf_px` instead."""
        return self.lens or GaussianPSF(self.psf_px)

    def zoomed(self, geometry: Geometry) -> SceneContext:
        """Return the context at another focal length.

        Diffraction and lens blur keep their size in px at a fixed F-number. Turbulence blurs by a fixed angle, which
        is more px at a longer focal length.
        """
        blur_rad, ifovs = self.air.turbulence.blur_rms(self.band), (geometry.ifov_rad, self.geometry.ifov_rad)
        if blur_rad == 0:
            return replace(self, geometry=geometry)
        more_px = blur_rad * math.sqrt(max(ifovs[0] ** -2 - ifovs[1] ** -2, 0.0))
        wider = self.lens and self.lens.broadened(more_px)
        return replace(self, geometry=geometry, psf_px=math.hypot(self.psf_px, more_px), lens=wider)

    @cached_property
    def surroundings(self) -> float:
        """Radiance reflected by grey bodies, W/m2/sr."""
        radiance = self.air.surroundings(self.band)
        return self.ambient if radiance is None else radiance

    def grey_body_radiance(self, temperature_k: float | Floats, emissivity: float | Floats) -> Floats:
        """Return the radiance of a grey body, W/m2/sr: its emission and its reflection of the surroundings."""
        return grey_body(self.band, temperature_k, emissivity, self.surroundings)

    def through(
        self, emission: Floats, alpha: Floats, range_m: float | Floats, elevation_rad: float | Floats
    ) -> Floats:
        """Return the emission, W/m2/sr, of an object after its path through the atmosphere.

        alpha          share of the light that the object replaces
        range_m, elevation_rad  of the path; arrays broadcast
        """
        return self.air.through(self.band, emission, alpha, range_m, elevation_rad)
