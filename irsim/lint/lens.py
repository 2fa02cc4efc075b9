"""Lenses that parts of the camera are told of apart from each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

from irsim.errors import Notice
from irsim.scenario.model import Scenario

ALIKE = 1.25
"""Diameters that differ by no more than this factor are of one lens: tilt goes with their power -1/6."""


def two_lenses(scenario: Scenario) -> Iterator[Notice]:
    """F-number and pixels' pitch of the lens that blurs, unlike those of the detector's light."""
    camera = scenario.camera
    lens, other = camera.optics if scenario.is_on("optics") else None, camera.detector.optics
    if lens is None or other is None:
        return
    for key, here, there in zip(("f_number", "pitch_um"), (lens.f_number, lens.pitch_um), other, strict=True):
        if not math.isclose(here, there, rel_tol=1e-6):
            yield Notice(
                ("camera", "optics", key),
                f"it blurs with {key} {here:g}, but the detector's light is that of {key} {there:g}; "
                "a camera has one lens: try the same in both",
            )


def unlike_pupils(scenario: Scenario) -> Iterator[Notice]:
    """A pupil that turbulent air is seen through, unlike that of the lens that the camera is told to have."""
    camera, air = scenario.camera, scenario.air.turbulence
    lens = camera.optics if scenario.is_on("optics") else None
    told = camera.detector.optics if lens is None else (lens.f_number, lens.pitch_um)
    if told is None or air.cn2 == 0:
        return
    f_number, pitch_um = told
    focal_m = pitch_um * 1e-6 / (camera.ifov_mrad * 1e-3)
    pupil_m = focal_m / f_number
    if max(air.aperture_m / pupil_m, pupil_m / air.aperture_m) > ALIKE:
        yield Notice(
            ("atmosphere", "turbulence", "aperture_m"),
            f"turbulence is seen through {air.aperture_m:g} m, but the lens is {pupil_m:.3g} m wide: pixels of "
            f"{pitch_um:g} um and {camera.ifov_mrad:g} mrad make a focal length of {focal_m * 1e3:.3g} mm, at "
            f"F/{f_number:g}",
        )
