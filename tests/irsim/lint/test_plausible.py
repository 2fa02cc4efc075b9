"""Numbers that are allowed but hardly meant are warned of with their place; those of the shipped scenes are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.config import yaml_text
from irsim.config.schema import Slot
from irsim.lint.plausible import implausible
from irsim.lint.warnings import warnings
from irsim.scenario.catalog import examples
from irsim.scenario.model import Scenario

SCENE = """\
frames: 4
camera: {{size: [64, 48]}}
background: {{kind: ground}}
targets:
  - id: drone
    shape: {{kind: point, temperature_k: {kelvin}, area_m2: {area}}}
    path: {{kind: straight, start: [30, 20], range_m: {range}}}
"""


def test_each_slip_is_one_line_with_its_place_and_no_error(tmp_path: Path) -> None:
    scene = tmp_path / "slips.yaml"
    scene.write_text(SCENE.format(kelvin=47, area=30000, range=1.2))
    done = CliRunner().invoke(app, ["check", str(scene)])
    assert done.exit_code == 0
    assert done.stdout == f"{scene}: ok\n"
    lines = [line for line in done.stderr.splitlines() if "hardly meant" in line]
    assert lines == [
        f"{scene}:6:41: targets.drone.shape.temperature_k: warning: 47 is allowed but hardly meant; "
        "plausible: 150 to 3500 K (degrees Celsius + 273.15)",
        f"{scene}:6:54: targets.drone.shape.area_m2: warning: 30000 is allowed but hardly meant; "
        "plausible: 0.0001 to 5000 m2",
        f"{scene}:7:54: targets.drone.path.range_m: warning: 1.2 is allowed but hardly meant; plausible: 5 to 100000 m",
    ]


@pytest.mark.parametrize(
    ("kelvin", "area", "range", "warned"),
    [(150, 1e-4, 5, []), (3500, 5000, 100_000, []), (149, 1, 50, ["temperature_k"]), (300, 1, 2e5, ["range_m"])],
)
def test_the_ends_of_a_range_are_plausible(kelvin: float, area: float, range: float, warned: list[str]) -> None:
    document = yaml_text.parse_yaml(SCENE.format(kelvin=kelvin, area=area, range=range))
    assert [notice.at[-1] for notice in implausible(Slot.of(Scenario), document.value)] == warned


@pytest.mark.parametrize(
    ("background", "warned"),
    [
        ("{kind: landscape, camera_height_m: 90000}", ["camera_height_m"]),
        ("{kind: landscape, camera_height_m: 0.01}", ["camera_height_m"]),
        ("{kind: sea, camera_height_m: 90000}", ["camera_height_m"]),
        ("{kind: landscape, hills_mrad: 4000, correlation_mrad: 1e6}", ["hills_mrad", "correlation_mrad"]),
        ("{kind: ground, roads: {width_mrad: 0.000001}}", ["width_mrad"]),
        ("{kind: ground, roads: {width_mrad: 4000}, water: {size_mrad: 0.001}}", ["width_mrad", "size_mrad"]),
        ("{kind: ground, fields: {size_mrad: 1e5, lane_mrad: 1e5}}", ["size_mrad", "lane_mrad"]),
        ("{kind: sky, clouds: [{correlation_mrad: 1e5}]}", ["correlation_mrad"]),
        ("{kind: sky, clouds: [{wind_mrad_s: [3, -1e6], sunlit_k: 900}]}", [1, "sunlit_k"]),
        ("{kind: ground, spread_k: 900}", ["spread_k"]),
        ("{kind: landscape, trees: [{height_m: 4000}], buildings: [{height_m: [3, 9000]}]}", ["height_m", 1]),
        ("{kind: landscape, camera_height_m: 20000, hills_mrad: 0, trees: [{height_m: 100}], roads: {}}", []),
    ],
)
def test_a_background_that_no_country_is_like_is_told(background: str, warned: list[str | int]) -> None:
    document = yaml_text.parse_yaml(f"background: {background}")
    assert [notice.at[-1] for notice in implausible(Slot.of(Scenario), document.value)] == warned


@pytest.mark.parametrize(
    ("path", "warned"),
    [
        ("kind: straight, start: [9, 9], closing_m_s: -9000, ground_m: 90000", ["closing_m_s", "ground_m"]),
        ("kind: straight_m, start_m: [0, 900, 0], velocity_m_s: [0, -9000, 0]", [1]),
        ("kind: waypoints_m, points: [[0, 900, 0], [0, 9, 0]], speed_m_s: 9000", ["speed_m_s"]),
        ("kind: turns_m, start_m: [0, 900, 0], speed_m_s: 3000, turns: [[5, 30, 120]]", []),
        ("kind: straight, start: [9, 9], speed: 1e6", ["speed"]),
        ("kind: waypoints, points: [[9, 9], [90, 9]], speed: 1e6", ["speed"]),
        ("kind: weave, start: [9, 9], speed: 11, heading_deg: -400, phase_deg: 1e5", ["phase_deg"]),
    ],
)
def test_a_way_that_nothing_takes_is_told(path: str, warned: list[str | int]) -> None:
    targets = f"targets: [{{id: jet, shape: {{kind: fighter}}, path: {{{path}}}}}]"
    document = yaml_text.parse_yaml(f"background: {{kind: ground}}\n{targets}\n")
    assert [notice.at[-1] for notice in implausible(Slot.of(Scenario), document.value)] == warned


def test_what_turns_faster_than_anything_is_told() -> None:
    scene = {"camera": {"motion": [{"kind": "pan", "azimuth_deg_s": 1e6, "elevation_deg_s": -90}]}}
    target = {"spin_deg_s": [0, 1e5, 400], "shape": {"kind": "tank"}}
    told = implausible(Slot.of(Scenario), {**scene, "targets": [target]})
    assert [notice.at[-2:] for notice in told] == [(0, "azimuth_deg_s"), ("spin_deg_s", 1)]


def test_nothing_of_the_shipped_examples_is_implausible() -> None:
    for name, path in examples().items():
        assert not list(implausible(Slot.of(Scenario), yaml_text.read_yaml(path).value)), name


@pytest.mark.parametrize(
    "data",
    [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", bytes(5000), np.arange(5000, dtype="<u2").tobytes(), b"\xff\xfe\0\xd8\0\0"],
)
def test_what_is_no_text_is_neither_scenario_nor_recording(tmp_path: Path, data: bytes) -> None:
    picture = tmp_path / "g.png"
    picture.write_bytes(data)
    done = CliRunner().invoke(app, ["info", str(picture)])
    assert str(done.exception).startswith(f"{picture}: is neither a scenario nor a recording")


def test_a_zero_byte_in_a_text_is_told_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "zero.yaml"
    path.write_bytes(b"frames: 3\0\n")
    done = CliRunner().invoke(app, ["info", str(path)])
    assert str(done.exception) == f"{path}:1:10: a zero byte stands here; allowed: text, without any"


def test_an_optional_temperature_has_its_range_too() -> None:
    told = implausible(Slot.of(Scenario), {"atmosphere": {"temperature_k": 15}})
    assert [notice.at for notice in told] == [("atmosphere", "temperature_k")]


@pytest.mark.parametrize(
    ("camera", "more", "warned"),
    [
        ("preset: cooled_mwir, netd_mk: 100", "", ["camera.netd_mk"]),
        ("range_k: [250, 300], detector: {kind: electrons}", "", ["camera.range_k"]),
        ("preset: cooled_mwir, smear: {time_ms: 3}", "", ["camera.smear.time_ms"]),
        ("preset: cooled_mwir, smear: {time_ms: 10}", "", []),
        ("preset: uncooled_lwir, netd_mk: 100", "", []),
        ("preset: uncooled_lwir, noise: [{kind: shot}], detector: {kind: electrons}", "", []),
        ("band: mwir", "atmosphere: {visibility_km: 8}", ["atmosphere.visibility_km"]),
        ("band: mwir", "atmosphere: {visibility_km: 8, preset: tropical}", []),
    ],
)
def test_what_has_no_effect_is_told(tmp_path: Path, camera: str, more: str, warned: list[str]) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"camera: {{{camera}, size: [64, 64]}}\n{more}\nbackground: {{kind: ground}}\n")
    told = [line.split()[1].rstrip(":") for line in warnings(scene) if "its pixels are full" not in line]
    assert told == warned


@pytest.mark.parametrize(
    ("background", "shape", "path", "warned"),
    [
        ("kind: ground", "scr: 5, temperature_k: 400", "", ["shape.temperature_k"]),
        ("kind: ground", "scr: 5, emissivity: 0.9", "", ["shape.emissivity"]),
        ("kind: ground", "contrast_k: 5, temperature_k: 400", "", ["shape.temperature_k"]),
        ("kind: ground", "contrast_k: null, temperature_k: 400", "", []),
        ("kind: ground, beta: 2, betas: [2, 3]", "contrast_k: 5", "", ["background.beta"]),
        ("kind: sky, preset: tropical, zenith_k: 220", "contrast_k: 5", "", ["background.zenith_k"]),
        ("kind: sky, clouds: [{beta: 2, betas: [2, 3]}]", "contrast_k: 5", "", ["background.clouds.clouds.beta"]),
        ("kind: ground", "contrast_k: 5", ", ground_m: 50, range_m: 900", ["path.range_m"]),
    ],
)
def test_a_key_in_whose_place_another_holds_is_told(
    tmp_path: Path, background: str, shape: str, path: str, warned: list[str]
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        f"background: {{{background}}}\ncamera: {{size: [64, 64], elevation_deg: -5}}\n"
        f"targets: [{{id: p, shape: {{kind: point, {shape}}}, path: {{kind: straight, start: [32, 32]{path}}}}}]\n"
    )
    told = [line.split()[1].rstrip(":") for line in warnings(scene) if "does not count beside" in line]
    assert [key.removeprefix("targets.p.") for key in told] == warned


@pytest.mark.parametrize(
    ("shape", "camera", "what"),
    [
        ("area_m2: 0.05, scr: -60", "", "p asks for an SCR of -60: at frame 0 -"),
        ("area_m2: 30, scr: -60", "", None),
        ("area_m2: 0.05, scr: 60", "", None),
        (
            "area_m2: 0.05, scr: 60",
            ", range_k: [285, 295]",
            "p asks for an SCR of 60: at frame 0 ",
        ),
        ("area_m2: 0.05, contrast_k: -320", "", "p asks for -320 K: at frame 0 -2"),
        ("area_m2: 30, contrast_k: 200", "", "p asks for 200 K: at frame 0 "),
        ("area_m2: 30, contrast_k: 90", "", None),
        ("area_m2: 30, contrast_k: -200, flicker: {kind: blink}", "", None),
    ],
)
def test_a_point_that_asks_for_what_cannot_be_is_told(
    tmp_path: Path, shape: str, camera: str, what: str | None
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        f"frames: 9\ncamera: {{size: [96, 96], bits: 16{camera}}}\n"
        "background: {kind: ground, mean_k: 290, spread_k: 0.1}\n"
        f"targets: [{{id: p, shape: {{kind: point, {shape}}},\n"
        "  path: {kind: straight, start: [40, 40], speed: 0.3, range_m: 1500}}]\n"
    )
    told = warnings(scene)
    key = "scr" if "scr" in shape else "contrast_k"
    assert [line.split("warning: ")[1][: len(what or "")] for line in told] == ([what] if what else [])
    assert all(f"targets.p.shape.{key}" in line for line in told)
    assert all(("full" if "-" not in shape else "darker than without any light") in line for line in told)


@pytest.mark.parametrize(
    ("camera", "ground_k", "contrast_k", "what"),
    [
        ("range_k: [280, 310]", 250, 5, "0% of that is left, as pixels are at count 0"),
        ("range_k: [280, 310]", 281, -20, "as pixels are at count 0"),
        ("range_k: [280, 310]", 330, -10, "0% of that is left, as pixels are full"),
        ("range_k: [280, 310]", 305, 30, "as pixels are full"),
        ("range_k: [280, 310]", 295, -10, None),
        ("range_k: [220, 310], falloff: {vignetting: 0.5}", 300, 20, None),
        ("range_k: [280, 310], falloff: {vignetting: 0.5}", 295, -5, "as pixels are at count 0"),
        ("range_k: [220, 310]", 300, 20, "as pixels are full"),
    ],
)
def test_what_either_end_of_the_scale_cuts_off_is_told(
    tmp_path: Path, camera: str, ground_k: float, contrast_k: float, what: str | None
) -> None:
    """Of a point in the corner, where a lens may darken."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        f"frames: 2\ncamera: {{size: [96, 96], bits: 16, {camera}}}\n"
        f"background: {{kind: ground, mean_k: {ground_k}, spread_k: 0.1}}\n"
        f"targets: [{{id: p, shape: {{kind: point, area_m2: 30, contrast_k: {contrast_k}}},\n"
        "  path: {kind: straight, start: [3, 3], speed: 0, range_m: 1500}}]\n"
    )
    told = [line for line in warnings(scene) if "targets.p.shape.contrast_k" in line]
    assert len(told) == (what is not None)
    assert all((what or "") in line for line in told)


@pytest.mark.parametrize("what", ["kind: ground, spread_k: 0", "kind: sky, horizon_k: 270, zenith_k: 270"])
@pytest.mark.parametrize(("camera", "told"), [("netd_mk: 0", True), ("noise: []", True), ("netd_mk: 30", False)])
def test_a_point_whose_scr_has_nothing_to_stand_out_from_is_told(
    tmp_path: Path, what: str, camera: str, told: bool
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        f"frames: 9\ncamera: {{size: [96, 96], {camera}}}\nbackground: {{{what}}}\n"
        "targets: [{id: p, shape: {kind: point, scr: 9}, path: {kind: straight, start: [40, 40], speed: 0.3}}]\n"
    )
    line = "p asks for an SCR of 9: at frame 0 neither noise nor clutter is around it, and it is invisible;"
    assert [line in warning for warning in warnings(scene)] == ([True] if told else [])


def test_a_point_that_is_not_there_asks_for_nothing(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "frames: 9\ncamera: {size: [96, 96]}\nbackground: {kind: ground}\nwithout: [p]\n"
        "targets: [{id: p, shape: {kind: point, scr: -1e6},\n"
        "  path: {kind: straight, start: [40, 40], range_m: 1500}}]\n"
    )
    assert warnings(scene) == []


def test_air_is_as_warm_as_air_on_earth(tmp_path: Path) -> None:
    """184 K and 330 K have been measured; a sun of 5000 K is no air."""
    scene = tmp_path / "air.yaml"
    scene.write_text("frames: 2\natmosphere: {temperature_k: 5000}\nbackground: {kind: ground}\n")
    told = [line for line in warnings(scene) if "hardly meant" in line]
    assert told == [
        f"{scene}:2:29: atmosphere.temperature_k: warning: 5000 is allowed but hardly meant; plausible: 180 to 335 K "
        "(degrees Celsius + 273.15)"
    ]
    for kelvin in (184, 330):
        assert not any("hardly meant" in line for line in warnings(scene, [f"atmosphere.temperature_k={kelvin}"]))
