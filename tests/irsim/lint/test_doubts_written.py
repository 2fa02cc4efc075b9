"""Keys that are written wrongly beside others: pairs the wrong way round, smoke by intent, greys of no count."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from irsim.errors import InputError
from irsim.lint import doubts
from irsim.lint.warnings import unheeded, warnings
from irsim.recording import record
from irsim.render.stream import Rendering
from irsim.scenario.loader import load, loads
from irsim.scenario.model import Scenario


@pytest.mark.parametrize(
    ("background", "key", "what"),
    [
        ("kind: ground, clutter: {size_mrad: [4, 1]}", "clutter.size_mrad", "4.0 is above 1.0"),
        ("kind: landscape, clutter: {contrast_k: [10, 3]}", "clutter.contrast_k", "10.0 is above 3.0"),
        ("kind: landscape, buildings: [{width_m: [30, 10]}]", "buildings.buildings.width_m", "30.0 is above 10.0"),
        ("kind: landscape, buildings: [{height_m: [14, 5]}]", "buildings.buildings.height_m", "14.0 is above 5.0"),
    ],
)
def test_a_pair_the_wrong_way_round_is_an_error(background: str, key: str, what: str) -> None:
    with pytest.raises(InputError) as raised:
        loads(f"background: {{{background}}}\n", "x.yaml")
    place, _, told = str(raised.value).partition(f": background.{key}: ")
    assert place.startswith("x.yaml:1:")
    assert told == f"{what}; allowed: the lesser first"


def test_a_pair_of_two_that_are_alike_is_allowed() -> None:
    loads("background: {kind: ground, clutter: {size_mrad: [4, 4], contrast_k: [3, 3]}}\n")


@pytest.mark.parametrize(
    ("keys", "warned"),
    [
        ("hides: p, frames: [10, 12], fraction: 0.5, opacity: 0.3", ["opacity"]),
        ("hides: p, frames: [10, 12], begins_frame: 3, lasts_frames: 4", ["begins_frame", "lasts_frames"]),
        ("hides: p, frames: [10, 12], fraction: 0.5", []),
        ("center_px: [32, 24], size_px: [30, 20], opacity: 0.3, begins_frame: 3, lasts_frames: 4", []),
    ],
)
def test_what_the_intent_of_smoke_decides_does_not_count_where_it_is_written(
    tmp_path: Path, keys: str, warned: list[str]
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "frames: 20\ncamera: {size: [64, 48]}\nbackground: {kind: ground}\n"
        "targets: [{id: p, shape: {kind: point}, path: {kind: straight, start: [20, 24], speed: 1}}]\n"
        f"occluders: [{{kind: smoke, range_m: 500, {keys}}}]\n"
    )
    told = [line for line in warnings(scene) if "occluders.smoke.frames" not in line]
    assert [line.split()[1].rstrip(":") for line in told] == [f"occluders.smoke.{key}" for key in warned]
    assert all(line.endswith("does not count beside hides, which holds in its place") for line in told)


@pytest.mark.parametrize(
    ("camera", "warned"),
    [
        ("netd_mk: 50, detector: {kind: electrons}", ["camera.netd_mk"]),
        ("detector: {kind: electrons}", []),
        ("preset: ideal, netd_mk: 50, detector: {kind: electrons}", ["camera.netd_mk"]),
        ("preset: uncooled_lwir, detector: {kind: electrons}", []),
        ("preset: uncooled_lwir, range_k: [250, 330], detector: {kind: electrons}", ["camera.range_k"]),
        ("preset: uncooled_lwir, netd_mk: 50", []),
        ("preset: cooled_mwir, netd_mk: 50, range_k: [250, 330]", ["camera.netd_mk", "camera.range_k"]),
    ],
)
def test_keys_that_a_detector_does_not_heed_are_told_where_the_text_has_them(
    tmp_path: Path, camera: str, warned: list[str]
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"frames: 4\ncamera: {{{camera}}}\nbackground: {{kind: sky}}\n")
    told = [line for line in warnings(scene) if "does not count" in line]
    assert [line.split()[1].rstrip(":") for line in told] == warned


KELVIN = {"targets.p.shape.temperature_k": {"kind": "choice", "values": [300, 310]}}
SCR = {"targets.p.shape.scr": {"kind": "choice", "values": [3, 5]}}
NETD = {"camera.netd_mk": {"kind": "uniform", "low": 30, "high": 90}}


@pytest.mark.parametrize(
    ("camera", "vary", "warned"),
    [
        ({"preset": "cooled_mwir"}, NETD, "does not count for a detector of kind electrons: its own keys decide"),
        ({"preset": "uncooled_lwir"}, NETD, None),
        ({}, KELVIN, "does not count beside scr, which holds"),
        ({}, SCR, None),
    ],
)
def test_ranges_of_keys_that_count_for_nothing_are_told(
    tmp_path: Path, camera: dict[str, Any], vary: dict[str, Any], warned: str | None
) -> None:
    target = {"id": "p", "shape": {"kind": "point", "scr": 4}, "path": {"kind": "straight", "start": [20, 24]}}
    scene = tmp_path / "scene.yaml"
    text = {"frames": 4, "camera": camera, "background": {"kind": "sky"}, "targets": [target], "vary": vary}
    scene.write_text(json.dumps(text))
    told = [line for line in warnings(scene) if "does not count" in line]
    assert len(told) == (warned is not None)
    assert all(f": vary.{next(iter(vary))}: warning: {warned}" in line for line in told)


def test_overrides_that_count_for_nothing_are_told_by_themselves(tmp_path: Path) -> None:
    """Neither the file's own idle keys nor overrides that count are."""
    scene = tmp_path / "scene.yaml"
    camera = "{preset: cooled_mwir, size: [32, 24], range_k: [250, 330]}"
    scene.write_text(f"frames: 2\ncamera: {camera}\nbackground: {{kind: sky}}\n")
    idle = "does not count for a detector of kind electrons: its own keys decide"
    told = [f"override camera.netd_mk: warning: {idle}"]
    assert unheeded(scene, ["camera.netd_mk=3000", "camera.psf_px=1"]) == told
    assert unheeded(scene, ["camera.psf_px=1"]) == []
    assert unheeded(scene, []) == []
    assert unheeded(scene, ["camera.netd_mk=3000", "camera={preset: uncooled_lwir}"]) == []
    whole = unheeded(scene, ["camera={preset: cooled_mwir, netd_mk: 3000}"])
    assert whole == [f"override camera: camera.netd_mk: warning: {idle}"]
    recording = record(Rendering(load(scene)), tmp_path / "scene.mcap")
    assert unheeded(recording, ["camera.netd_mk=3000"]) == told


FIXED = {"kind": "fixed", "low": 2000, "high": 6000}


@pytest.mark.parametrize(
    ("agc", "bits", "told"),
    [
        (FIXED, 10, "low: counts of 10 bits are 0 to 1023: every picture is black; try less than 1023"),
        (FIXED, 12, "high: counts of 12 bits are 0 to 4095: white is never reached; try 4095 at most"),
        (FIXED, 14, None),
        ({"kind": "fixed", "high": 255}, 8, None),
        ({"kind": "fixed", "low": 255}, 8, "low: counts of 8 bits are 0 to 255: every picture is black; try less than"),
        ({"kind": "unsharp", "base": {"kind": "clahe", "base": FIXED}}, 10, "low: counts of 10 bits are 0 to 1023"),
        ({"kind": "linear"}, 8, None),
    ],
)
def test_greys_of_counts_that_a_camera_does_not_give_are_told(agc: dict[str, Any], bits: int, told: str | None) -> None:
    camera = {"size": (64, 48), "bits": bits, "agc": agc, "range_k": (270, 310)}
    scene = {"camera": camera, "background": {"kind": "ground"}}
    lines = [f"{notice.at[-1]}: {notice.message}" for notice in doubts(Scenario.model_validate(scene))]
    assert [line[: len(told or "")] for line in lines] == ([] if told is None else [told])
