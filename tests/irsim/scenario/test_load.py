"""Scenarios from YAML: equal to the same scenario in Python, errors with their places, and back to text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scenario_text import TEXT, errors_of

import irsim
from irsim.backgrounds import Sky
from irsim.backgrounds.clouds import Clouds
from irsim.camera.ar1 import Ar1
from irsim.camera.camera import Camera
from irsim.camera.noise import White
from irsim.errors import InputError
from irsim.lint.warnings import warnings
from irsim.motion.camera_motion import Pan
from irsim.motion.scripted import Straight
from irsim.occluders import Bar
from irsim.scenario.catalog import examples
from irsim.scenario.loader import dumps, load, loads
from irsim.scenario.model import Scenario
from irsim.targets.point import Point
from irsim.targets.target import Target


def test_yaml_equals_the_scenario_in_python() -> None:
    twin = Scenario(
        about="a point crosses",
        seed=7,
        frames=10,
        camera=Camera(
            size=(64, 48),
            netd_mk=60.0,
            noise=(White(), Ar1(id="flicker", rho=0.9, ratio=0.5)),
            motion=(Pan(azimuth_deg_s=0.5),),
        ),
        background=Sky(clouds=(Clouds(coverage=0.3, wind_mrad_s=(1.0, 0.0)),)),
        targets=(
            Target(id="jet", shape=Point(temperature_k=500.0), path=Straight(start=(10.0, 20.5), speed=2.0)),
            Target(id="far", shape=Point(), path=Straight(start=(30.0, 10.0))),
        ),
        occluders=(Bar(range_m=100.0, center_px=(40.0, 20.0), size_px=(6.0, 60.0)),),
        follow="jet",
    )
    scenario = loads(TEXT)
    assert scenario == twin
    assert scenario.hash == twin.hash
    for (frame, truth), (twin_frame, twin_truth) in zip(irsim.frames(scenario), irsim.frames(twin), strict=True):
        assert np.array_equal(frame.image, twin_frame.image)
        assert truth == twin_truth


def test_files_names_and_texts_are_equal(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(TEXT)
    assert load(path) == load(str(path)) == irsim.loads(TEXT)
    assert irsim.load is load  # no module of that name takes the place of the function
    assert load("sky") == load(examples()["sky"])
    with pytest.raises(InputError, match=r"^skyy: there is no such file and no shipped .*did you mean 'sky'\?$"):
        load("skyy")
    with pytest.raises(InputError, match=r"^skyy.yaml: cannot read it: there is no such file$"):
        load("skyy.yaml")


# A text of TEXT, another in its place, and the beginning and end of the error line.
WRONG = [
    ("frames: 1e1", "framse: 3", "3:1: framse: unknown key; allowed: about, like, seed,", "'frames'?"),
    ("rho:", "rhu:", "9:32: camera.noise.flicker.rhu: unknown key; allowed: kind, ", "'rho'?"),
    ("kind: sky", "kind: sy", "13:9: background.kind: unknown background kind 'sy';", "'sky'?"),
    ("kind: sky", "horizon_k: 280", "13:3: background: the key 'kind' is missing; allowed: sky", ""),
    (
        "{kind: point}",
        "5",
        "21:12: targets.far.shape: expected a mapping with the key 'kind'; allowed kinds: point",
        "",
    ),
    ("1e1", "1.5", "3:9: frames: expected a whole number, not 1.5; allowed: a whole number, from 1 to 10000000", ""),
    ("netd_mk: 60", "netd_mk: yes", "6:12: camera.netd_mk: expected a number, not 'yes'; allowed: a number, ", ""),
    ("seed: 7", "seed: true", "2:7: seed: expected a whole number, not true; allowed: ", ""),
    ("seed: 7", "seed:", "2:6: seed: expected a whole number, not nothing; allowed: ", ""),
    ("60", "-1", "6:12: camera.netd_mk: -1 is out of range; allowed: a number, ", ""),
    ("60", ".inf", "6:12: camera.netd_mk: inf is out of range; allowed: a number, ", ""),
    ("coverage: 0.3", "coverage: 1", "15:18: background.clouds.clouds.coverage: 1 is out of range;", "below 1"),
    ("netd_mk: 60", "band: [3]", "6:9: camera.band: a list of 1 is not allowed; allowed: 'mwir', ", "a number"),
    ("netd_mk: 60", "band: mwri", "6:9: camera.band: 'mwri' is not allowed; allowed: 'mwir', ", "did you mean 'mwir'?"),
    ("netd_mk: 60", "band: [4.9, 3.4]", "6:9: camera.band: 4.9 to 3.4 um is no band; allowed: two limits ", "first"),
    ("netd_mk: 60", "band: [4.0, 4.01]", "6:9: camera.band: 4 to 4.01 um is too narrow; allowed: a width of 0.05", ""),
    ("[64, 48]", "[64, 8]", "5:14: camera.size.1: 8 is out of range; allowed: a whole number, from 16 to 4096", ""),
    ("[64, 48]", "[64]", "5:9: camera.size: too few items; allowed: a list of 2, each a whole", ""),
    ("[64, 48]", "[64, 48, 3]", "5:9: camera.size: too many items; allowed: a list of 2, ", ""),
    ("[64, 48]", "64", "5:9: camera.size: expected a list, not 64; allowed: a list of 2, ", ""),
    ("id: far", "id: 1 x", "20:9: targets.1.id: '1 x' is not allowed; allowed: text, at most 64 char", ""),
    ("    shape: {kind: point}\n", "", "20:5: targets.far.shape: it is missing; allowed: a mapping", ""),
    ("follow: jet", "follow: jat", "25:9: follow: there is no 'jat'; allowed: jet, far;", "'jet'?"),
    ("size: [64, 48]", "range_k: [300, 200]", "5:12: camera.range_k: 300.0 K is not below 200.0 K; allowed: the ", ""),
]


@pytest.mark.parametrize(("old", "new", "begin", "end"), WRONG)
def test_an_error_has_place_key_problem_and_allowed_values(old: str, new: str, begin: str, end: str) -> None:
    (line,) = errors_of(TEXT.replace(old, new, 1))
    assert line.startswith(f"f.yaml:{begin}")
    assert line.endswith(end)


def test_impossible_paths_are_reported_together() -> None:
    text = "background: {kind: ground}\ntargets:\n"
    for name in ("one", "two"):
        path = "{kind: straight, start: [30, 50], ground_m: 10}"
        text += f"  - {{id: {name}, shape: {{kind: car}}, path: {path}}}\n"
    assert [line.split(" px ")[0] for line in errors_of(text)] == [
        "f.yaml:3:41: targets.one.path: at (30, 50)",
        "f.yaml:4:41: targets.two.path: at (30, 50)",
    ]


def test_errors_are_in_file_order() -> None:
    text = TEXT.replace("seed: 7", "seed: -7").replace("60", "x", 1).replace("rho: 0.9", "rho: 9").replace("sky", "sy")
    assert [line.split(": ")[1] for line in errors_of(text)] == [
        "seed",
        "camera.netd_mk",
        "camera.noise.flicker.rho",
        "background.kind",
    ]


def test_a_text_that_is_no_mapping() -> None:
    (line,) = errors_of("[1, 2]")
    assert line.startswith("f.yaml:1:1: expected a mapping; allowed: the keys about, like, seed, frames")
    assert len(errors_of('"fra\\nmes": 3\nbackground: {kind: sky}')) == 1


def test_integers_and_floats_may_be_written_as_each_other() -> None:
    scenario = loads(TEXT, overrides=["frames=2e1", "camera.size=[32.0, 3.2e1]", "camera.netd_mk=50"])
    assert (scenario.frames, scenario.camera.size, scenario.camera.netd_mk) == (20, (32, 32), 50.0)
    assert isinstance(scenario.frames, int)
    assert isinstance(scenario.camera.netd_mk, float)


class Ramp(Sky):
    """A background of a user's own, named in YAML by its place."""

    slope_k: float = 1.0


def test_a_kind_of_the_users_own() -> None:
    text = f"background: {{kind: '{__name__}:Ramp', slope_k: 2}}"
    scenario = loads(text)
    assert scenario.background == Ramp(slope_k=2.0)
    assert loads(dumps(scenario)) == scenario
    (line,) = errors_of(text.replace("slope_k", "slop_k"))
    column = text.index("slope_k") + 1
    assert line.startswith(f"f.yaml:1:{column}: background.slop_k: unknown key; allowed: kind, ")
    assert line.endswith("did you mean 'slope_k'?")


def test_a_ground_path_above_the_horizon_is_an_error() -> None:
    text = """
frames: {frames}
camera: {{size: [160, 120], ifov_mrad: 1, elevation_deg: -2}}
background: {{kind: ground}}
targets:
  - id: car
    shape: {{kind: point}}
    path: {{kind: straight, start: [10, 60], speed: 2, heading_deg: -70, ground_m: 100}}
"""
    with pytest.raises(InputError, match=r"^up:8:\d+: targets.car.path: at \(\d+, \d+\) px it is above the horizon"):
        irsim.loads(text.format(frames=40), "up")
    scenario = irsim.loads(text.format(frames=10), "up")  # only later would it leave the ground
    assert len(list(irsim.Rendering(scenario).truths())) == 10


def test_duplicate_and_unknown_ids_are_reported_together() -> None:
    third = "  - {id: jet, shape: {kind: point}, path: {kind: straight, start: [1, 1]}}\n"
    text = TEXT.replace("id: far", "id: jet").replace("occluders:\n", third + "occluders:\n")
    text = text.replace("follow: jet", "follow: jat")
    assert [line.split("; ")[0] for line in errors_of(text)] == [
        "f.yaml:20:9: targets.1.id: the id 'jet' is used twice, also by targets.0",
        "f.yaml:23:10: targets.2.id: the id 'jet' is used twice, also by targets.0",
        "f.yaml:26:9: follow: there is no 'jat'",
    ]


def test_an_id_of_a_preset_is_reported_at_the_users() -> None:
    """The camera's default parts have no place in the text."""
    noise = "  noise:" + TEXT.split("  noise:")[1].split("  motion:")[0]
    unwritten = TEXT.replace(noise, "")
    assert errors_of(unwritten.replace("id: far", "id: white")) == [
        "f.yaml:17:9: targets.white.id: the id 'white' is used twice, also by camera.noise of the defaults; "
        "allowed: each id once"
    ]
    preset = unwritten.replace("camera:\n", "camera:\n  preset: uncooled_lwir\n")
    assert errors_of(preset.replace("id: far", "id: level")) == [
        "f.yaml:18:9: targets.level.id: the id 'level' is used twice, also by camera.noise of the preset "
        "'uncooled_lwir'; allowed: each id once"
    ]
    assert errors_of(TEXT.replace("id: far", "id: flicker")) == [
        "f.yaml:9:23: camera.noise.flicker.id: the id 'flicker' is used twice, also by targets.flicker; "
        "allowed: each id once"
    ]


def test_unknown_keys_and_ids_are_reported_together() -> None:
    text = TEXT.replace("netd_mk", "netd_k").replace("speed: 2", "sped: 2").replace("follow: jet", "follow: jat")
    assert [line.split("; ")[0] for line in errors_of(text)] == [
        "f.yaml:6:3: camera.netd_k: unknown key",
        "f.yaml:19:47: targets.jet.path.sped: unknown key",
        "f.yaml:25:9: follow: there is no 'jat'",
    ]
    (line,) = errors_of(TEXT.replace("targets:", "target:"))  # which is not the fault of `follow`
    assert line.startswith("f.yaml:16:1: target: unknown key; ")


WRONG_TABLES = """\
severities:
  camera.netd_mk: [10, -3, 90]
  camera.bogus: [1, 2, 3]
  targets.jet.path.speed: [fast, 2, 3]
  camera.rate_hz: [30, 30, -5]
  frames: 5
vary:
  camera.bits: {kind: integers, low: 10, high: 20}
  targets.jat.path.speed: {kind: uniform, low: 1, high: 2}
  camera.time_constant_ms: {kind: unifrm, low: 1, high: 2}
  camera.size.0: {kind: choice, values: [64, none, 0]}
"""


def test_all_faults_of_tables_are_in_file_order(tmp_path: Path) -> None:
    """Unknown keys, invalid entries and invalid values; `load` reports the current severity only."""
    path = tmp_path / "f.yaml"
    path.write_text(TEXT + WRONG_TABLES)
    with pytest.raises(InputError) as caught:
        warnings(path)
    found = [line.removeprefix(f"{path}:").split(":")[0] for line in str(caught.value).splitlines()]
    assert found == ["27", "28", "29", "30", "31", "33", "34", "35", "36", "36"], str(caught.value)
    loaded = [line.split(":")[1] for line in errors_of(TEXT + WRONG_TABLES)]
    assert loaded == ["28", "29", "31", "33", "34", "35", "36", "36"]


def test_table_faults_are_reported_beside_others() -> None:
    lines = errors_of(TEXT.replace("frames: 1e1", "frames: some") + WRONG_TABLES)
    assert [line.split(":")[1] for line in lines] == ["3", "28", "29", "31", "34", "35"]


def test_a_picture_is_neither_scenario_nor_recording(tmp_path: Path) -> None:
    picture = tmp_path / "g.png"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(InputError, match=r"g\.png: is neither a scenario nor a recording, .*irsim import makes"):
        load(picture)
    clip = irsim.record(irsim.Rendering(loads(TEXT)), tmp_path / "clip.mcap", stop=1)
    with pytest.raises(InputError, match=r"clip\.mcap: is a recording, not YAML; irsim info describes it"):
        load(clip)
