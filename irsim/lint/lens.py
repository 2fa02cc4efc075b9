"""The aperture of turbulence beside that of the camera."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import Notice
from irsim.scenario.model import Scenario

ALIKE = 1.25
"""Diameters that differ by no more than this factor are of one lens: tilt goes with their power -1/6."""


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
