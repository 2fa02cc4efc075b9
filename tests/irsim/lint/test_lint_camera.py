"""Warnings about noise, exposure and optics of the camera."""

from __future__ import annotations

from typing import Any

import pytest
from lint_scenes import check_warning, point, warned

ELECTRONS = {"kind": "electrons"}
NETD = "camera.netd_mk"


@pytest.mark.parametrize(
    ("netd_mk", "more", "implausible"),
    [
        (1000, {}, False),
        (5000, {}, True),
        (40, {"severities": {NETD: [40, 8000]}}, False),
        (8000, {"severities": {NETD: [8000, 40]}}, False),
        (8000, {"vary": {NETD: {"kind": "uniform", "low": 20, "high": 4000}}}, False),
    ],
)
def test_implausible_netd(netd_mk: float, more: dict[str, Any], implausible: bool) -> None:
    scene = {"camera": {"netd_mk": netd_mk}, **more}
    check_warning(scene, NETD if implausible else None, "5000 mK is allowed but implausible: 5 K; plausible: up to ")


def test_noise_below_one_count() -> None:
    coarse = {"bits": 8, "range_k": (233, 413)}
    fine = {"bits": 8, "range_k": (233, 303), "netd_mk": 200}
    words = "the noise at 300 K is 0.044 counts: "
    check_warning({"camera": {**coarse, "netd_mk": 100, "noise": [{"kind": "white"}]}}, "camera.bits", words)
    check_warning({"camera": {**fine, "range_k": (240, 303)}}, None)
    check_warning({"camera": {**coarse, "noise": []}}, None)


@pytest.mark.parametrize(
    ("camera", "missing"),
    [
        ({"preset": "cooled_mwir", "noise": [{"kind": "bad_pixels"}]}, True),
        ({"detector": ELECTRONS, "noise": [{"kind": "fixed_pattern"}]}, True),
        ({"detector": ELECTRONS, "noise": [{"kind": "white"}]}, False),
        ({"detector": ELECTRONS, "noise": [{"kind": "shot"}, {"kind": "bad_pixels"}]}, False),
        ({"detector": ELECTRONS, "noise": []}, False),
        ({"detector": ELECTRONS}, False),
        ({"noise": [{"kind": "fixed_pattern"}, {"kind": "white"}]}, False),
    ],
)
def test_missing_shot_noise(camera: dict[str, Any], missing: bool) -> None:
    assert ("shot and read noise" in warned({"camera": camera}).get("camera.noise", "")) == missing


@pytest.mark.parametrize(
    ("camera", "place", "words"),
    [
        ({"time_ms": 20.0, "steps": 2}, "camera.smear.steps", "it moves by 3.0 px from step to step"),
        ({"time_ms": 20.0, "steps": 16}, None, ""),
    ],
)
def test_motion_blur_with_few_steps(camera: dict[str, Any], place: str | None, words: str) -> None:
    """10 px a frame at 30 frames a second are 6 px in 20 ms."""
    scene = {"frames": 5, "camera": {"smear": camera, "rate_hz": 30}, "targets": [point(start=(5, 24), speed=10)]}
    check_warning(scene, place, words)


@pytest.mark.parametrize(("time_ms", "place"), [(3, "camera.smear.time_ms"), (10, None)])
def test_exposure_unlike_integration(time_ms: float, place: str | None) -> None:
    camera = {"preset": "cooled_mwir", "smear": {"time_ms": time_ms}}
    check_warning({"camera": camera}, place, "3 ms of motion blur, but the detector integrates for 10 ms")


@pytest.mark.parametrize(
    ("camera", "aperture_m", "words"),
    [
        ({"preset": "cooled_mwir"}, 0.05, "the lens is 0.025 m wide"),
        ({"preset": "cooled_mwir"}, 0.025, None),
        ({"optics": {"f_number": 2, "pitch_um": 10}, "ifov_mrad": 0.1}, 0.02, "a focal length of 100 mm, at F/2"),
        ({}, 0.3, None),
    ],
)
def test_turbulence_aperture_unlike_lens(camera: dict[str, Any], aperture_m: float, words: str | None) -> None:
    """Focal length is pitch over IFOV: 15 um / 0.15 mrad are the preset's 100 mm, of which F/4 leaves 25."""
    air = {"turbulence": {"cn2": 1e-14, "aperture_m": aperture_m}}
    place = None if words is None else "atmosphere.turbulence.aperture_m"
    check_warning({"camera": camera, "atmosphere": air}, place, words or "")
    check_warning({"camera": camera, "atmosphere": air, "without": ["turbulence"]}, None)
