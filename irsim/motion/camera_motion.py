"""Motions of the camera: pan, random shaking, vibration, zoom, a moving platform, following a target."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from irsim.config.base import Name, Several, Switches
from irsim.config.quantities import NotNegative, Pair, Positive, Triple, Turning, Velocity
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.motion.base import CameraMotion, MetrePath, path_error, world_to_first
from irsim.motion.paths import METRE_PATHS
from irsim.rng import stream
from irsim.types import Floats


class Pan(CameraMotion):
    """Rotation at constant rate from frame 0 on."""

    azimuth_deg_s: Turning = 0.0
    """Azimuth rate, degrees a second, positive to the right."""
    elevation_deg_s: Turning = 0.0
    """Elevation rate, degrees a second, positive upwards."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rates = np.radians([self.azimuth_deg_s, self.elevation_deg_s, 0.0])
        return np.asarray(frames)[:, None] / context.rate_hz * rates


_BLOCK = 1024
"""Number of frames evaluated together, which bounds the memory."""


def sinusoids(rms_px: float, angular: Floats, phases: Floats, frames: Floats, context: SceneContext) -> Floats:
    """Return rotations (n, 3), rad, at frame numbers (n,): azimuth and elevation of `rms_px` at zoom 1, and no roll.

    Each is a sum of sinusoids of equal power, with angular frequencies (2, waves), rad/s, and phases (2, waves), rad.
    The density of the frequencies is the spectrum: M. Shinozuka and C.-M. Jan, J. Sound Vib. 25, 111 (1972).
    """
    seconds = np.asarray(frames, dtype=np.float64)[:, None, None] / context.rate_hz
    amplitude = rms_px * context.geometry.ifov_rad * np.sqrt(2 / angular.shape[-1])
    turned = np.zeros((len(seconds), 3))
    for first in range(0, len(seconds), _BLOCK):
        some = slice(first, first + _BLOCK)
        turned[some, :2] = amplitude * np.cos(angular * seconds[some] + phases).sum(axis=-1)
    return turned


_WAVES = 32
"""Sinusoids per axis; their sum is Gaussian within a few percent."""


class Jitter(CameraMotion):
    """Stationary random shaking, independent in azimuth and elevation.

    A sum of sinusoids with random phases and normally distributed frequencies: its mean autocorrelation is
    rms^2 exp(-t^2 / (2 correlation_s^2)), and it is smooth.
    """

    rms_px: NotNegative = 0.5
    """Root mean square of each axis, px at zoom 1: an angle, which a zoom magnifies."""
    correlation_s: Positive = 0.1
    """Correlation time, s."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rng = stream(context.seed, self.name, "jitter")
        angular = rng.standard_normal((2, _WAVES)) / self.correlation_s
        phases = rng.uniform(0, 2 * np.pi, (2, _WAVES))
        return sinusoids(self.rms_px, angular, phases, frames, context)


Line = Annotated[tuple[Positive, NotNegative, NotNegative], Field(strict=False)]
Node = Annotated[tuple[Positive, NotNegative], Field(strict=False)]

_SHAKE_WAVES = 64
"""Sinusoids per axis."""


class Vibration(CameraMotion):
    """Spectral lines of an engine, a rotor or a cooler: sinusoids of given frequency and amplitude, random phase.

    Lines above half the frame rate appear at their aliased frequency, as with a short integration time.
    """

    lines: Annotated[Several[Line], Field(min_length=1)] = ((12.0, 0.5, 0.5),)
    """List of [Hz, amplitude in azimuth px, amplitude in elevation px], px at zoom 1."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        hertz, *amplitudes = np.array(self.lines).T
        phases = stream(context.seed, self.name, "vibration").uniform(0, 2 * np.pi, (2, len(hertz)))
        seconds = np.asarray(frames, dtype=np.float64)[:, None, None] / context.rate_hz
        waves = np.array(amplitudes) * np.sin(2 * np.pi * hertz * seconds + phases)
        turned = context.geometry.ifov_rad * waves.sum(axis=-1)
        return np.concatenate([turned, np.zeros_like(turned[:, :1])], axis=1)


class Shake(CameraMotion):
    """Random shaking with a spectrum of given shape.

    A sum of sinusoids of equal power with random phases, one from each of equally powerful bands of the spectrum.
    """

    rms_px: NotNegative = 0.5
    """Root mean square of each axis, px at zoom 1: an angle, which a zoom magnifies."""
    spectrum: Annotated[Several[Node], Field(min_length=2)] = ((0.1, 1.0), (2.0, 1.0), (15.0, 0.02))
    """List of [frequency in Hz, relative power density]: linear in between, zero outside."""

    @model_validator(mode="after")
    def _has_power(self) -> Shake:
        if any(b[0] <= a[0] for a, b in pairwise(self.spectrum)):
            raise path_error("the frequencies do not rise; allowed: rising frequencies", "spectrum")
        if not any(density for _, density in self.spectrum):
            raise path_error("the spectrum has no power; allowed: a density above 0", "spectrum")
        return self

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rng = stream(context.seed, self.name, "shake")
        slices = (np.arange(_SHAKE_WAVES) + rng.random((2, _SHAKE_WAVES))) / _SHAKE_WAVES
        hertz, phases = self._frequencies(slices), rng.uniform(0, 2 * np.pi, (2, _SHAKE_WAVES))
        return sinusoids(self.rms_px, 2 * np.pi * hertz, phases, frames, context)

    def _frequencies(self, shares: Floats) -> Floats:
        """Return the frequencies, Hz, below which the given shares, 0..1, of the power lie."""
        hertz, density = np.array(self.spectrum).T
        width = np.diff(hertz)
        power = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2 * width))
        wanted = shares * power[-1]
        span = np.clip(np.searchsorted(power, wanted, side="right") - 1, 0, len(width) - 1)
        low, slope, rest = density[span], np.diff(density)[span] / width[span], wanted - power[span]
        # low x + slope x^2 / 2 = rest, in a form that holds at slope 0 and at low 0.
        root = np.sqrt(np.maximum(low**2 + 2 * slope * rest, 0.0))
        return np.asarray(hertz[span] + 2 * rest / np.maximum(low + root, 1e-300))


Knot = Annotated[tuple[NotNegative, Annotated[float, Field(ge=1, le=50)]], Field(strict=False)]


class Zoom(CameraMotion):
    """Focal length that changes with time: the IFOV is `ifov_mrad` over the factor. The logarithm of the factor is
    linear between the frames of `factors`, and constant before and after them."""

    factors: Annotated[Several[Knot], Field(min_length=1)] = ((0.0, 1.0),)
    """List of [frame, factor]; factors are at least 1, so `ifov_mrad` is the widest view."""

    @model_validator(mode="after")
    def _frames_rise(self) -> Zoom:
        if any(b[0] <= a[0] for a, b in pairwise(self.factors)):
            raise path_error("the frames do not rise; allowed: rising frames", "factors")
        return self

    def zooms(self, frames: Floats, context: SceneContext) -> Floats:
        knots, factors = np.array(self.factors).T
        return np.asarray(np.exp(np.interp(frames, knots, np.log(factors))))


class Platform(CameraMotion):
    """Translation of the camera from frame 0 on, at constant velocity or along a path.

    Objects show parallax by their range; the clear sky and ground without a height are infinitely far, so they stay at
    rest. The translation does not rotate the camera.
    """

    switches: ClassVar[Switches] = {"sway": ("sway_m", (0.0, 0.0, 0.0))}

    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """[east, north, up], m/s; north is level ahead at the first pointing."""
    path: Annotated[MetrePath, METRE_PATHS] | None = None
    """Path in metres (`waypoints_m`, `turns_m`, ...) whose displacement since frame 0 is added. Default: none."""
    sway_m: Triple = (0.0, 0.0, 0.0)
    """Amplitude of a periodic displacement, [east, north, up], m, as of a rolling ship or a drone in gusts."""
    sway_period_s: Positive = 5.0
    """Period of the sway, s."""

    def shifts(self, frames: Floats, context: SceneContext) -> Floats:
        seconds = np.asarray(frames, dtype=np.float64)[:, None] / context.rate_hz
        sway = np.sin(2 * np.pi * seconds / self.sway_period_s) * np.array(self.sway_m)
        even = world_to_first(seconds * np.array(self.velocity_m_s) + sway, context)
        if self.path is None:
            return even
        first, way = (self.path.positions(at, context, self.name) for at in (np.zeros(1), np.asarray(frames)))
        return even + way - first


class Tracks(CameraMotion):
    """Rotation that keeps a target at a fixed pixel, with a delay; other motions are added.

    The camera points to the position of the target `lag_s` ago, so a target that moves at a constant angular rate is
    ahead of its pixel by this rate times `lag_s`.
    """

    target: Name
    """Id of the target. A target that is switched off with --without is followed, but not drawn."""
    place_px: Pair | None = None
    """[x, y] at which the target is kept, px. Default: the middle of the picture."""
    lag_s: NotNegative = 0.0
    """Delay of the camera, s."""

    def refers(self) -> Mapping[str, str]:
        return {"target": self.target}

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        if context.objects is None:
            raise InputError(f"there is no target '{self.target}' to follow; allowed: a target of the scenario")
        frames = np.asarray(frames, dtype=np.float64)
        sight = context.objects.target_positions(self.target, frames - self.lag_s * context.rate_hz, context)
        sight = sight - context.objects.camera_positions(frames, context)
        geometry = context.geometry
        world = sight @ geometry.rotation(np.zeros(3)).T @ geometry.world_rotation(np.zeros(3))
        azimuth, elevation = _angles(world)
        place = geometry.principal if self.place_px is None else np.asarray(self.place_px)
        # Pixel of the first focal length in the direction of `place` at the zoom of each frame.
        inwards = 1 - 1 / context.objects.zooms(frames, context)
        directions = geometry.directions(place + inwards[:, None] * (geometry.principal - place))
        aside, above = _angles(directions)
        # The first estimate is exact on the optical axis; three Newton steps make it exact in the whole picture.
        turns = np.stack([azimuth - aside, elevation - above - geometry.elevation_rad, np.zeros(len(frames))], axis=-1)
        turns[:, 0] = np.unwrap(turns[:, 0])
        for _ in range(3):
            now = _angles(np.einsum("nji,nj->ni", geometry.world_rotation(turns), directions))
            turns[:, 0] += (azimuth - now[0] + np.pi) % (2 * np.pi) - np.pi
            turns[:, 1] += elevation - now[1]
        return turns


def _angles(vectors: Floats) -> tuple[Floats, Floats]:
    """Return azimuth (right) and elevation (up), rad, of vectors (n, 3) x right, y down, z ahead."""
    x, y, z = vectors.T
    return np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))
