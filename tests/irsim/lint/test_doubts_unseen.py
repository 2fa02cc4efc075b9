"""A target that is hidden for most of the time is warned of, whatever hides it."""

from __future__ import annotations

from pathlib import Path

import pytest

from irsim.lint import doubts
from irsim.lint.warnings import warnings
from irsim.scenario.loader import loads

SCENE = """
frames: 100
camera: {{size: [160, 120], elevation_deg: 0}}
background: {background}
targets:
  - {{id: tank, shape: {{kind: point}}, path: {{kind: straight, start: [30, 62], speed: 1, range_m: 300}}}}
  - {{id: other, shape: {{kind: point}}, path: {{kind: straight, start: [20, 62], range_m: 300}}}}
occluders: [{occluders}]
"""
PLAIN = "{kind: landscape, camera_height_m: 4}"
ROW = "{kind: landscape, camera_height_m: 4, buildings: [{range_m: 200, spacing_m: 10, width_m: [30, 31]}]}"
BAR = "{{kind: bar, range_m: {range_m}, center_px: [{middle}, 62], size_px: [{wide}, 40]}}"


def told(background: str = PLAIN, occluders: str = "", *overrides: str) -> list[tuple[tuple[str | int, ...], str]]:
    scenario = loads(SCENE.format(background=background, occluders=occluders), overrides=overrides)
    return [(each.at, each.message) for each in doubts(scenario) if "is more than half hidden" in each.message]


@pytest.mark.parametrize(("wide", "said"), [(48, False), (56, True)])
def test_a_placed_occluder_that_hides_it_in_most_frames_is_told(wide: int, said: bool) -> None:
    """The tank goes from 30 to 129 px, the bar begins at 40: of 24 frames, 4.3 px apart, 11 or 13 are behind it."""
    assert (
        told(occluders=BAR.format(range_m=100, middle=40 + wide / 2, wide=wide))
        == [
            (
                ("targets", 0, "path"),
                "tank, whom trackers follow, is more than half hidden, by bar, in 13 of the 24 frames that were looked "
                "at; irsim info tells all of them",
            )
        ]
        * said
    )


def test_a_row_of_buildings_is_told_too() -> None:
    ((place, what),) = told(ROW)
    assert place == ("targets", 0, "path")
    assert "by buildings, in 24 of the 24 frames" in what


def test_what_is_behind_it_or_switched_off_or_before_another_is_not_told() -> None:
    assert told(ROW, "", "without=[buildings]") == []
    assert told(ROW, "", "background.buildings.0.range_m=400") == []
    assert told(occluders=BAR.format(range_m=400, middle=80, wide=150)) == []
    still = BAR.format(range_m=100, middle=20, wide=10)
    assert told(occluders=still) == []
    assert len(told(PLAIN, still, "follow=other")) == 1


@pytest.mark.parametrize("last", [99, 60])
def test_what_is_asked_to_hide_it_is_told_of_where_it_is_never_seen(last: int) -> None:
    """To frame 99 it is hidden all the time; to 60 for most of it, as it is asked for."""
    wall = "{{kind: bar, id: wall, range_m: 100, hides: tank, frames: [0, {last}]}}"
    assert told(PLAIN, wall.format(last=last)) == [
        (
            ("targets", 0, "path"),
            "tank, whom trackers follow, is more than half hidden, by wall, in 24 of the 24 frames that were looked "
            "at; irsim info tells all of them",
        )
    ] * (last == 99)
    assert told(PLAIN, wall.format(last=last), "without=[wall]") == []


LEAVES = """
frames: 100
camera: {size: [160, 120]}
background: {kind: ground}
targets:
  - {id: jet, shape: {kind: point, area_m2: 3}, path: {kind: straight, start: [59.6, 62], speed: 1, range_m: 300}}
"""


@pytest.mark.parametrize(("speed", "outside"), [(1.0, 0), (2.0, 50), (2.1, 52), (5.0, 80), (1e4, 99)])
def test_a_target_that_is_out_of_the_picture_for_most_of_the_time_is_told(speed: float, outside: int) -> None:
    """From 59.6 px on it has 99.9 px to the right edge, at 159.5."""
    scenario = loads(LEAVES, overrides=[f"targets.jet.path.speed={speed}"])
    told = [each for each in doubts(scenario) if "out of the picture" in each.message]
    assert [each.at for each in told] == [("targets", 0, "path")] * (outside > 50)
    for each in told:
        assert each.message == (
            f"jet, whom trackers follow, is out of the picture in {outside} of the 100 frames in which it is there; "
            "irsim info tells which"
        )


def test_warnings_name_the_severities_that_bring_them(tmp_path: Path) -> None:
    path = tmp_path / "f.yaml"
    path.write_text(
        f"{LEAVES}severities:\n  targets.jet.path.range_m: [900, 3, 900, 3]\n  camera.netd_mk: [9, 9, 9, 9]\n"
    )
    (line,) = warnings(path)
    assert line.startswith(f"{path}:8:35: targets.jet.path.range_m: warning: at severities 1 and 3: 3 is allowed but ")
    assert warnings(path, ["severity=2"]) == []
    (alone,) = warnings(path, ["severity=3"])
    assert alone.startswith(f"{path}:8:43: targets.jet.path.range_m: warning: 3 is allowed but ")
    (always,) = warnings(path, ["targets.jet.path.range_m=3"])
    assert always.startswith("override targets.jet.path.range_m: warning: 3 is allowed but ")
