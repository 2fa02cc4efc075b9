"""Warnings as lines with places: of all severities, of ranges, of overrides, and of shipped scenarios."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.errors import InputError
from irsim.lint import CHECKS, lint
from irsim.lint.occluders import placed_occluder_excessive
from irsim.lint.warnings import unheeded, warnings
from irsim.recording import record
from irsim.render.stream import Rendering
from irsim.scenario.catalog import examples
from irsim.scenario.loader import load
from irsim.scenario.model import Scenario

SLIPS = """\
frames: 4
camera: {size: [64, 48]}
background: {kind: ground}
targets:
  - id: drone
    shape: {kind: point, temperature_k: 47, area_m2: 30000}
    path: {kind: straight, start: [30, 20], range_m: 1.2}
"""
LEAVES = """
frames: 50
camera: {size: [160, 120]}
background: {kind: ground}
targets:
  - {id: jet, shape: {kind: point, area_m2: 3}, path: {kind: straight, start: [59.6, 62], speed: 1, range_m: 300}}
"""
"""Its right edge is 99.9 px away: at 5 px a frame it is inside in frames 0 to 19, at 6 in 0 to 16, at 10 in 0 to 9."""


def written(folder: Path, text: str) -> Path:
    path = folder / "scene.yaml"
    path.write_text(text)
    return path


def test_lines_of_irsim_check(tmp_path: Path) -> None:
    scene = written(tmp_path, SLIPS)
    done = CliRunner().invoke(app, ["check", str(scene)])
    assert (done.exit_code, done.stdout) == (0, f"{scene}: ok\n")
    lines = [line for line in done.stderr.splitlines() if "implausible" in line]
    assert lines == [
        f"{scene}:6:41: targets.drone.shape.temperature_k: warning: 47 is allowed but implausible; "
        "plausible: 150 to 3500 K (degrees Celsius + 273.15)",
        f"{scene}:6:54: targets.drone.shape.area_m2: warning: 30000 is allowed but implausible; "
        "plausible: 0.0001 to 5000 m2",
        f"{scene}:7:54: targets.drone.path.range_m: warning: 1.2 is allowed but implausible; plausible: 5 to 100000 m",
    ]


@pytest.mark.parametrize(
    ("speeds", "prefix"),
    [
        ("[1, 5, 6, 10]", "at severities 1 to 3: at the first of them: "),
        ("[5, 1, 6, 10]", "at severities 0, 2 and 3: at the first of them: "),
        ("[1, 5, 5]", "at severities 1 and 2: "),
        ("[5, 5]", ""),
    ],
)
def test_warnings_of_severities_are_merged(speeds: str, prefix: str, tmp_path: Path) -> None:
    (line,) = warnings(written(tmp_path, f"{LEAVES}severities:\n  targets.jet.path.speed: {speeds}\n"))
    assert f"warning: {prefix}jet, the target to follow, is outside the picture in 30 of the 50 frames" in line


def test_warnings_of_different_names_stay_apart(tmp_path: Path) -> None:
    severities = "severities:\n  targets.0.id: [jet1, jet2]\n  targets.0.path.speed: [5, 6]\n"
    first, second = warnings(written(tmp_path, LEAVES + severities))
    assert "at severity 0: jet1" in first
    assert "at severity 1: jet2" in second


def test_warnings_at_one_severity(tmp_path: Path) -> None:
    path = written(tmp_path, f"{LEAVES}severities:\n  targets.jet.path.range_m: [900, 3, 900, 3]\n")
    (line,) = warnings(path)
    assert line.startswith(f"{path}:8:35: targets.jet.path.range_m: warning: at severities 1 and 3: 3 is allowed but ")
    assert warnings(path, ["severity=2"]) == []
    (alone,) = warnings(path, ["severity=3"])
    assert alone.startswith(f"{path}:8:43: targets.jet.path.range_m: warning: 3 is allowed but ")
    (always,) = warnings(path, ["targets.jet.path.range_m=3"])
    assert always.startswith("override targets.jet.path.range_m: warning: 3 is allowed but ")


def test_errors_of_all_severities_at_once(tmp_path: Path) -> None:
    path = written(tmp_path, f"{LEAVES}severities:\n  camera.bits: [8, 40, 12, 50]\n")
    for overrides in ([], ["severity=0"]):
        with pytest.raises(InputError) as caught:
            warnings(path, overrides)
        assert len(str(caught.value).splitlines()) == 2


def test_progress_counts_checks_of_all_severities(tmp_path: Path) -> None:
    path, counts = written(tmp_path, f"{LEAVES}severities:\n  camera.netd_mk: [40, 80]\n"), list[tuple[int, int]]()
    warnings(path, progress=lambda *given: counts.append(given))
    assert counts == [(done, 2 * len(CHECKS)) for done in range(1, 2 * len(CHECKS) + 1)]


NETD = {"camera.netd_mk": {"kind": "uniform", "low": 30, "high": 90}}
KELVIN = {"targets.p.shape.temperature_k": {"kind": "choice", "values": [300, 310]}}


@pytest.mark.parametrize(
    ("camera", "vary", "words"),
    [
        ({"preset": "cooled_mwir"}, NETD, "does not count for a detector of kind electrons: its own keys decide"),
        ({"preset": "uncooled_lwir"}, NETD, None),
        ({}, KELVIN, "does not count beside scr, which replaces it"),
    ],
)
def test_ranges_without_effect(tmp_path: Path, camera: dict[str, Any], vary: dict[str, Any], words: str | None) -> None:
    target = {"id": "p", "shape": {"kind": "point", "scr": 4}, "path": {"kind": "straight", "start": [20, 24]}}
    text = {"frames": 4, "camera": camera, "background": {"kind": "sky"}, "targets": [target], "vary": vary}
    found = [line for line in warnings(written(tmp_path, json.dumps(text))) if "does not count" in line]
    assert len(found) == (words is not None)
    assert all(f": vary.{next(iter(vary))}: warning: {words}" in line for line in found)


def test_overrides_without_effect(tmp_path: Path) -> None:
    """Overrides with an effect, and ineffective keys of the file itself, give no line."""
    camera = "{preset: cooled_mwir, size: [32, 24], range_k: [250, 330]}"
    scene = written(tmp_path, f"frames: 2\ncamera: {camera}\nbackground: {{kind: sky}}\n")
    reason = "does not count for a detector of kind electrons: its own keys decide"
    lines = [f"override camera.netd_mk: warning: {reason}"]
    assert unheeded(scene, ["camera.netd_mk=3000", "camera.psf_px=1"]) == lines
    assert unheeded(scene, []) == []
    assert unheeded(scene, ["camera.netd_mk=3000", "camera={preset: uncooled_lwir}"]) == []
    whole = unheeded(scene, ["camera={preset: cooled_mwir, netd_mk: 3000}"])
    assert whole == [f"override camera: camera.netd_mk: warning: {reason}"]
    recording = record(Rendering(load(scene)), tmp_path / "scene.mcap")
    assert unheeded(recording, ["camera.netd_mk=3000"]) == lines


def scene(motion: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """Return a scenario of a point 2 km away, and a camera of 80 x 60 px and 0.5 mrad with the motion `culprit`."""
    camera = {"size": (80, 60), "motion": [{"id": "culprit", **motion}], **changes.pop("camera", {})}
    path = {"kind": "straight", "start": (40, 30), "range_m": 2000, **changes.pop("path", {})}
    target = {"id": "jet", "shape": {"kind": "point"}, "path": path, **changes.pop("target", {})}
    ground = {"kind": "ground", "spread_k": 0}
    return {"frames": 61, "camera": camera, "background": ground, "targets": [target], **changes}


def platform(*velocity_m_s: float) -> dict[str, Any]:
    return {"kind": "platform", "velocity_m_s": velocity_m_s}


PAN = {"kind": "pan", "azimuth_deg_s": 30.0}  # 35 px a frame
BAR = {"kind": "bar", "range_m": 500}
PLACED = {**BAR, "center_px": (40, 30), "size_px": (9, 9)}
DISABLED = {
    "projection_distorted": scene({"kind": "pan", "elevation_deg_s": 45.0}),
    "target_out_of_picture": scene(PAN, target={"absent": [(0, 10)]}, frames=30),
    # The camera has moved 10 m before the target exists: the bar, 500 m away, is 30 px aside of it.
    "occluder_without_effect": scene(platform(30.0, 0.0, 0.0), target={"absent": [(0, 9)]}, occluders=[PLACED]),
    "ground_without_parallax": scene(platform(30.0, 0.0, 0.0)),
    "target_beyond_fit": scene(platform(0.0, -60_000.0, 0.0), atmosphere={"preset": "us_standard"}),
    # From a camera that moves the other way a third as far, the point hardly leaves the bar.
    "placed_occluder_excessive": scene(
        platform(-9.0, 0.0, 0.0),
        path={"start": (10, 30), "speed": 1.0},
        occluders=[{**BAR, "hides": "jet", "frames": (30, 32)}],
    ),
}


@pytest.mark.parametrize("name", DISABLED)
def test_disabled_motion_is_not_checked(name: str) -> None:
    """Every check treats a disabled motion like a missing one, except for the place of placed occluders."""
    (check,) = [each for each in CHECKS if each.__name__ == name]
    on = Scenario.model_validate(DISABLED[name])
    off = Scenario.model_validate({**DISABLED[name], "without": ["culprit"]})
    missing = Scenario.model_validate({**DISABLED[name], "camera": {**DISABLED[name]["camera"], "motion": []}})
    expected = list(check(on))
    assert expected
    assert not {notice.message for notice in expected} & {notice.message for notice in lint(off)}
    for each in CHECKS:
        if each is not placed_occluder_excessive:
            assert list(each(off)) == list(each(missing)), each.__name__


@pytest.mark.parametrize("name", ["decoys", "hiding", "sea", "traffic"])
def test_examples_have_no_warnings(name: str) -> None:
    """All shipped scenarios, at all severities, are checked in tests/validation."""
    assert warnings(examples()[name], ["severity=0"]) == []
