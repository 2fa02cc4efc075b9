"""Optics with a zoom: vignetting at the zoomed field angle, and the blur of turbulent air."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.motion import CAMERA_MOTIONS
from irsim.physics.diffraction import LensPSF
from irsim.physics.lens import Lens
from irsim.render.frame import Renderer
from irsim.render.moments import MeanCounts
from irsim.scenario.model import Scenario
from irsim.types import Box, Floats

IFOV_MRAD = 0.1
AIR = {"cn2": 1e-13, "path_m": 3000.0, "aperture_m": 0.1}
POINT = {
    "id": "one",
    "shape": {"kind": "point", "temperature_k": 900.0, "area_m2": 1e-6},
    "path": {"kind": "straight", "start": (47.5, 31.5), "speed": 0.0, "range_m": 3000.0},
}


def scene(zoom: float, turbulence: dict[str, Any], **changes: Any) -> Scenario:
    camera = {"size": (96, 64), "netd_mk": 0.0, "ifov_mrad": IFOV_MRAD, **changes.pop("camera", {})}
    camera["motion"] = [{"kind": "zoom", "factors": [(0, zoom)]}]
    value = {
        "frames": 3,
        "camera": camera,
        "atmosphere": {"turbulence": turbulence, "surroundings_k": 20.0},
        "background": {"kind": "sky", "horizon_k": 20.0, "zenith_k": 20.0},
        **changes,
    }
    return Scenario.model_validate(value)


def spread_px2(light: Floats) -> float:
    """Return the variance of light along rows, px²."""
    columns = light.sum(axis=0, dtype=np.float64)
    x = np.arange(len(columns))
    middle = (x * columns).sum() / columns.sum()
    return float(((x - middle) ** 2 * columns).sum() / columns.sum())


@pytest.mark.parametrize("zoom", [1.0, 8.0])
def test_turbulent_air_blurs_targets_by_an_angle(zoom: float) -> None:
    """By zoom times as many px as at first, beside the optics' 0.6 px and the pixel's 1/12 px^2."""
    turbulent = scene(zoom, AIR, targets=[POINT])
    blur_px = turbulent.air.turbulence.blur_rms("mwir") * zoom / (IFOV_MRAD * 1e-3)
    found = spread_px2(Renderer(turbulent).scene(0)[0])
    assert found == pytest.approx(0.6**2 + blur_px**2 + 1 / 12, rel=3e-3)
    assert blur_px == pytest.approx(0.1036 * zoom, rel=1e-3)


def test_turbulent_air_blurs_occluders_as_it_does_targets() -> None:
    """From pixel to pixel the edge of a wall rises as the light of a point on two neighbouring pixels."""
    wall = {"kind": "bar", "center_px": (147.5, 31.5), "size_px": (200, 200), "range_m": 3000.0}
    light = Renderer(scene(8.0, AIR, occluders=[wall])).scene(0)[0]
    assert spread_px2(np.diff(light, axis=1)) == pytest.approx(0.6**2 + 0.829**2 + 2 / 12, rel=3e-3)


def test_zoom_scales_the_blur_of_the_air_only() -> None:
    lens = Lens(f_number=4.0)
    camera = {"optics": lens.model_dump(), "psf_px": 0.3}
    still, turbulent = (Renderer(scene(8.0, air, camera=camera)) for air in ({}, AIR))
    assert still.pose(0).zoomed.lens == still.context.lens
    assert still.pose(0).zoomed.psf_px == still.context.psf_px
    blur_px = turbulent.context.air.turbulence.blur_rms("mwir") * 8 / (IFOV_MRAD * 1e-3)
    zoomed, whole = turbulent.pose(0).zoomed, np.hypot(0.3, blur_px)
    assert isinstance(zoomed.lens, LensPSF)
    assert zoomed.lens.sigma_px == pytest.approx(whole)
    assert zoomed.psf_px == pytest.approx(np.hypot(whole, lens.sigma_px("mwir")))


def shares(renderer: Renderer, frame: int = 0) -> Floats:
    """Return the signal of uniform light in each pixel over that in the middle, (rows, cols)."""
    light = np.full((64, 96), 5.0, np.float32)
    held, dark = (renderer.sensor.pixel_signal(each, frame) for each in (light, 0 * light))
    return np.asarray((held - dark) / (held - dark)[32, 48])


def shaded(factors: list[tuple[float, float]], **falloff: Any) -> Renderer:
    camera = {"ifov_mrad": 10.0, "netd_mk": 40.0, "bits": 16, "falloff": falloff}
    even = scene(1.0, {}, camera=camera, background={"kind": "ground", "spread_k": 0.0})
    zoom = CAMERA_MOTIONS.parse({"kind": "zoom", "factors": factors})
    return Renderer(even.model_copy(update={"camera": even.camera.model_copy(update={"motion": (zoom,)})}))


CORNER_RAD = 0.01 * np.hypot(47.5, 31.5)
"""Tangent of the angle off the axis of the corner, by pixels of 10 mrad."""


def test_vignetting_is_equal_at_any_zoom() -> None:
    assert shares(shaded([(0, 8.0)], cos4=False, vignetting=0.3))[0, 0] == pytest.approx(0.7, rel=2e-4)


def test_falloff_follows_a_zoom_from_frame_to_frame() -> None:
    """In frames, their means and variances, and the light that noise is worth, in any order."""
    renderer = shaded([(0, 1.0), (2, 4.0)])
    for frame, zoom in ((2, 4.0), (0, 1.0), (1, 2.0)):
        expected = np.cos(np.arctan(CORNER_RAD / zoom)) ** 4
        assert shares(renderer, frame)[0, 0] == pytest.approx(expected, rel=2e-4)
        middle, aside = (renderer.noise(frame)(5.0, Box(x, y, 1, 1)) for x, y in ((47.5, 31.5), (0.0, 0.0)))
        assert aside / middle == pytest.approx(1 / expected, rel=2e-4)
        mean = MeanCounts(renderer).of(frame)
        np.testing.assert_allclose(mean, renderer.sensor.mean(renderer.light(frame), frame), rtol=1e-5)
        off = (renderer.frame(frame)[0].image - mean) / np.sqrt(renderer.variance(frame))
        assert np.std(off) == pytest.approx(1.0, rel=0.05)
        assert np.abs(off).max() < 6
