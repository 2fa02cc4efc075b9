"""Warnings about noise, exposure and optics of the camera."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Recorded
from irsim.camera.motion_blur import MAX_STEPS
from irsim.camera.noise_base import Noise, NoiseVariance
from irsim.camera.sensor import NETD_K
from irsim.errors import Notice
from irsim.motion import CameraTrajectory
from irsim.physics.radiometry import radiance
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import TargetVisibility
from irsim.types import Floats

_BEADS_PX = 1.2
"""Distance, px, from which two blurred points are resolved, for the usual blur sigma of 0.6 px."""
_MAX_NETD_MK = 1000.0
"""Largest plausible NETD, mK. The authors chose this round limit: commercial cameras have 20 to 100 mK."""
_LEAST_NOISE = 0.3
"""Least plausible noise sigma, counts. Rounding turns a sigma of 0.2 into one of 0.11 to 0.50, as the pixel's mean lies
near a whole count or between two; a sigma of 0.3 becomes 0.31 to 0.50."""
_NO_NOISE = 1e-3
"""Largest noise sigma, counts, that `irsim fit` finds for a camera without noise."""
_APERTURE_RATIO = 1.25
"""Ratio of two aperture diameters up to which they count as equal. Turbulent motion follows their power -1/6."""


def netd_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of an implausible NETD, such as one in other units, unless `severities` or `vary` sets it."""
    camera, key = scenario.camera, "netd_mk"
    intended = {"camera", f"camera.{key}"} & {*scenario.severities, *scenario.vary}
    if camera.netd_mk > _MAX_NETD_MK and key in camera.detector.camera_keys and not intended:
        yield Notice(
            ("camera", key),
            f"{camera.netd_mk:g} mK is allowed but implausible: {camera.netd_mk / 1000:g} K; "
            f"plausible: up to {_MAX_NETD_MK:g} mK",
        )


def noise_below_one_count(scenario: Scenario) -> Iterator[Notice]:
    """Warn of noise far below one count, unless the frames are recorded or the camera has no noise."""
    camera = scenario.camera
    if isinstance(scenario.background, Recorded):
        return
    sensor = camera.signal_chain(scenario.seed, scenario.is_on)
    moment, response = sensor.frame_context(0, (1, 1)), sensor.response
    signal = response.at(float(radiance(camera.band, NETD_K)))
    terms = NoiseVariance.total(noise.variance_terms(moment, False) for noise in sensor.noises)
    counts = math.sqrt(terms.overall(signal, response)) / response.gain
    if _NO_NOISE < counts < _LEAST_NOISE:
        yield Notice(
            ("camera", "bits"),
            f"the noise at {NETD_K:g} K is {counts:.2g} counts: rounding to whole counts hides it, and pixels are "
            f"constant or alternate between two counts; for {_LEAST_NOISE:g} or more try more bits or a smaller range",
        )


def shot_noise_missing(scenario: Scenario) -> Iterator[Notice]:
    """Warn of an electron detector whose list of noises replaces its shot and read noise.

    Lists with white noise, empty lists and recorded frames are exempt.
    """
    camera = scenario.camera
    wanted = camera.detector.counts_electrons and camera.noise and not isinstance(scenario.background, Recorded)
    drawn = Noise.draw_electrons, Noise.temporal_sigma
    if wanted and all((type(noise).draw_electrons, type(noise).temporal_sigma) == drawn for noise in camera.noise):
        yield Notice(
            ("camera", "noise"),
            "electrons are read without shot and read noise: a list of noises takes the place of the detector's own; "
            "{kind: shot} has both",
        )


def motion_blur_steps_too_few(scenario: Scenario) -> Iterator[Notice]:
    """Warn of motion blur with so few steps that the fastest object appears as separate images."""
    camera = scenario.camera
    smear = camera.smear if scenario.is_on("smear") else None
    if smear is None or camera.exposure_ms == 0 or smear.steps == 1 or scenario.frames == 1:
        return
    visibility = TargetVisibility(scenario)
    share = camera.exposure_ms * 1e-3 * camera.rate_hz / smear.steps
    moves = [(_pan_px(visibility.camera), "the background")]
    for name, trajectory in visibility.trajectories.items():
        pixels = visibility.camera.project(trajectory.positions)
        in_view = np.array([camera.geometry.inside(x, y) for x, y in pixels.tolist()])
        steps = np.hypot(*np.diff(pixels, axis=0).T)
        moves.append((np.where(in_view[1:] & in_view[:-1], steps, 0.0), name))
    most, name, frame = max((float(steps.max()) * share, name, int(steps.argmax()) + 1) for steps, name in moves)
    if most > _BEADS_PX:
        enough = math.ceil(most * smear.steps / _BEADS_PX)
        yield Notice(
            ("camera", "smear", "steps"),
            f"at frame {frame} {name} moves by {most:.1f} px from step to step, which leaves separate "
            f"images; a smooth streak needs steps: {enough}" + (", above the limit" if enough > MAX_STEPS else ""),
        )


def _pan_px(camera: CameraTrajectory) -> Floats:
    """Return the apparent displacement between frames of a distant point at the picture's center, px, (n - 1,)."""
    ahead = np.einsum("nij,nj->ni", camera.rotations[1:], camera.rotations[:-1, 2])
    shifts = camera.geometry.project(ahead) - camera.geometry.principal
    return np.asarray(np.hypot(*shifts.T) * camera.zooms[1:])


def exposure_mismatch(scenario: Scenario) -> Iterator[Notice]:
    """Warn of motion blur whose duration differs from the detector's integration time."""
    camera = scenario.camera
    exposure_ms = camera.detector.integration_time_ms
    if exposure_ms is not None and camera.exposure_ms not in (0, exposure_ms):
        yield Notice(
            ("camera", "smear", "time_ms"),
            f"{camera.exposure_ms:g} ms of motion blur, but the detector integrates for {exposure_ms:g} ms",
        )


def aperture_mismatch(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a turbulence aperture that differs from the diameter of the lens."""
    camera, air = scenario.camera, scenario.air.turbulence
    lens = camera.optics if scenario.is_on("optics") else None
    lens_keys = camera.detector.optics if lens is None else (lens.f_number, lens.pitch_um)
    if lens_keys is None or air.cn2 == 0:
        return
    f_number, pitch_um = lens_keys
    focal_m = pitch_um * 1e-6 / (camera.ifov_mrad * 1e-3)
    pupil_m = focal_m / f_number
    if max(air.aperture_m / pupil_m, pupil_m / air.aperture_m) > _APERTURE_RATIO:
        yield Notice(
            ("atmosphere", "turbulence", "aperture_m"),
            f"turbulence is seen through {air.aperture_m:g} m, but the lens is {pupil_m:.3g} m wide: pixels of "
            f"{pitch_um:g} um and {camera.ifov_mrad:g} mrad make a focal length of {focal_m * 1e3:.3g} mm, at "
            f"F/{f_number:g}",
        )
