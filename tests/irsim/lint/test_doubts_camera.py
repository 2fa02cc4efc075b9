"""Values of cameras and skies that are legal and hardly meant are told with their place, and those beside them not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from irsim.lint.warnings import warnings

SCENE = """\
frames: 4
camera: {{size: [64, 48], {camera}}}
background: {{kind: sky, {sky}}}
targets:
  - id: a
    shape: {{kind: point}}
    path: {{kind: straight, start: [20, 20], range_m: 500}}
"""


def told(
    tmp_path: Path, *overrides: str, camera: str = "bits: 14", sky: str = "clouds: []", more: str = ""
) -> list[str]:
    """What is told, each with its line in the file and its key."""
    file = tmp_path / "s.yaml"
    file.write_text(SCENE.format(camera=camera, sky=sky) + more)
    return [line.removeprefix(f"{file}:").partition(":")[2].partition(": ")[2] for line in warnings(file, overrides)]


@pytest.mark.parametrize(
    ("camera", "said"),
    [
        ("psf_px: 5", None),
        ("psf_px: 5.1", "camera.psf_px: warning: 5.1 is allowed but hardly meant; plausible: 0 to 5 px"),
        ("rate_hz: 2000", None),
        ("rate_hz: 2001", "camera.rate_hz: warning: 2001 is allowed but hardly meant; plausible: 0.001 to 2000 Hz"),
        ("netd_mk: 1000", None),
        (
            "netd_mk: 5000",
            "camera.netd_mk: warning: 5000 mK is allowed but hardly meant: 5 K; plausible: up to 1000 mK",
        ),
    ],
)
def test_a_camera_that_nobody_has_is_told(tmp_path: Path, camera: str, said: str | None) -> None:
    assert told(tmp_path, camera=camera) == ([] if said is None else [said])


def test_noise_far_below_a_count_is_told(tmp_path: Path) -> None:
    (line,) = told(tmp_path, camera="bits: 8, range_k: [233, 413], netd_mk: 100, noise: [{kind: white}]")
    assert line.startswith("camera.bits: warning: the noise at 300 K is 0.044 counts: ")
    assert told(tmp_path, camera="bits: 8, range_k: [273, 303], netd_mk: 200") == []
    assert told(tmp_path, camera="bits: 8, range_k: [233, 413], noise: []") == []


def test_noise_that_severities_raise_is_meant(tmp_path: Path) -> None:
    ladder = "severities: {camera.netd_mk: [40, 8000]}\n"
    assert told(tmp_path, more=ladder) == []
    assert told(tmp_path, "severity=1", more=ladder) == []
    (line,) = told(tmp_path, "camera.netd_mk=8000", more=ladder)
    assert "hardly meant: 8 K" in line
    assert told(tmp_path, more="vary: {camera.netd_mk: {kind: uniform, low: 20, high: 4000}}\n") == []


@pytest.mark.parametrize(
    ("sky", "warned"),
    [
        ("horizon_k: 250, zenith_k: 285", True),
        ("zenith_k: 290", True),
        ("horizon_k: 280, zenith_k: 280", False),
        ("horizon_k: 285, zenith_k: 250", False),
        ("preset: tropical", False),
    ],
)
def test_a_sky_that_is_warmest_at_the_zenith_is_told(tmp_path: Path, sky: str, warned: bool) -> None:
    lines = told(tmp_path, sky=sky)
    assert [line.partition(":")[0] for line in lines] == ["background.zenith_k"] * warned
    assert all("is warmer than the horizon" in line for line in lines)


@pytest.mark.parametrize(
    ("camera", "warned"),
    [
        ("preset: cooled_mwir, noise: [{kind: bad_pixels}]", True),
        ("detector: {kind: electrons}, noise: [{kind: fixed_pattern}]", True),
        ("detector: {kind: electrons}, noise: [{kind: white}]", False),
        ("detector: {kind: electrons}, noise: [{kind: shot}, {kind: bad_pixels}]", False),
        ("detector: {kind: electrons}, noise: []", False),
        ("detector: {kind: electrons}", False),
        ("noise: [{kind: fixed_pattern}, {kind: white}]", False),
    ],
)
def test_electrons_without_the_noise_of_their_number_are_told(tmp_path: Path, camera: str, warned: bool) -> None:
    lines = told(tmp_path, camera=camera)
    assert [line.partition(":")[0] for line in lines if "shot and read noise" in line] == ["camera.noise"] * warned


@pytest.mark.parametrize(("off", "warned"), [("[]", False), ("[a]", True), ("[a, tracks]", False), ("[tracks]", False)])
def test_a_camera_that_follows_what_is_off_is_told(tmp_path: Path, off: str, warned: bool) -> None:
    tracking: dict[str, Any] = {"camera": "motion: [{kind: tracks, target: a}]"}
    lines = [line for line in told(tmp_path, f"without={off}", **tracking) if "switched off" in line]
    assert [line.partition(":")[0] for line in lines] == ["camera.motion.tracks.target"] * warned
    assert all("a is switched off, and the camera follows it all the same" in line for line in lines)
