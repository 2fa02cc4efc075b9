"""For how long, and how much, occluders that are placed by whom they hide do hide it: warnings against the truth."""

from __future__ import annotations

import re
from typing import Any

import pytest
from test_intent import UPRIGHT, scene, visible

from irsim import InputError, Scenario, load, loads
from irsim.lint.warnings import warnings
from irsim.occluders.solid import Building, Pole
from irsim.occluders.tree import Tree
from irsim.render.frame import Renderer
from irsim.scenario.placement_all import overdone

FIGHTER = "shape: {kind: fighter}, path: {kind: PATH, range_m: 500}"
ASKED = range(14, 21)
PATHS = {
    "across": "straight, start: [10, 50], speed: 2",
    "aslant": "straight, start: [20, 30], speed: 1, heading_deg: 30",
    "weave": "weave, start: [20, 60], speed: 1, amplitude_px: 8, period_frames: 20",
}


def sky(kind: str, path: str, fraction: float) -> str:
    return f"""
frames: 36
camera: {{size: [128, 96], ifov_mrad: 1.2, noise: []}}
background: {{kind: sky}}
targets:
  - {{id: jet, {FIGHTER.replace("PATH", PATHS[path])}}}
occluders:
  - {{kind: {kind}, hides: jet, frames: [14, 20], fraction: {fraction}, range_m: 250}}
"""


def told(path: Any, text: str) -> dict[str, str]:
    """Warnings of the occluder, by its key."""
    (path / "one.yaml").write_text(text)
    found = (re.search(r"occluders\.\w+\.(\w+): warning: (.*)", line) for line in warnings(path / "one.yaml"))
    return {match[1]: match[2] for match in found if match is not None}


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("kind", "path", "fraction"),
    [
        *(("bar", path, fraction) for path in PATHS for fraction in (0.3, 0.5, 0.8)),
        *(("pole", path, 0.5) for path in PATHS),
        *(("building", "aslant", 0.7), ("tree", "across", 0.5), ("tree", "weave", 0.5)),
        *(("smoke", path, 0.5) for path in PATHS),
    ],
)
def test_it_hides_as_much_as_asked_and_what_is_much_more_is_told(
    tmp_path: Any, kind: str, path: str, fraction: float
) -> None:
    text = sky(kind, path, fraction)
    hidden = [1 - share for share in visible(text, range(36))]
    during = {index: hidden[index] for index in ASKED}
    assert min(during.values()) >= fraction - 1e-3
    said = told(tmp_path, text)
    over = [index for index, share in during.items() if share > fraction + 0.2]
    if over:
        assert said["fraction"].startswith(
            f"it hides up to {max(during.values()):.2f} of jet in frames {over[0]} to {over[-1]}, where {fraction:g} is"
        )
    else:
        assert "fraction" not in said
    held = [index for index, share in enumerate(hidden) if share >= 0.98 * fraction]
    if "frames" in said:
        assert said["frames"].startswith(
            f"it hides {0.98 * fraction:.2f} or more of jet in frames {held[0]} to {held[-1]}, {len(held)} of them"
        )
    assert len(held) <= 17 or "frames" in said


@pytest.mark.parametrize(("kind", "most"), [("bar", 0.63), ("pole", 0.67), ("tree", 0.79)])
def test_another_part_hides_less_more_where_the_first_would_hide_all(kind: str, most: float) -> None:
    """A fighter on a weave, of which the half was asked; the lower or the right part of its way hid all of it, a
    strip up to 0.82 (bar) to 0.85 (tree)."""
    shown = visible(sky(kind, "weave", 0.5), ASKED)
    assert 1 - most <= min(shown) <= max(shown) <= 0.501


@pytest.mark.parametrize(("fraction", "most"), [(0.4, 0.44), (0.6, 0.7), (0.8, 0.94)])
def test_a_strip_hides_a_car_in_a_bend_hardly_more_than_asked(fraction: float, most: float) -> None:
    """Bends by 14 degrees in 35 frames, which a strip as high as asked and through the middle leaves by a fifth."""
    asked = [f"occluders.screen.fraction={fraction}", "without=[]"]
    renderer = Renderer(load("stress/occlusion-fraction", overrides=asked))
    shown = [renderer.scene(frame)[1].targets[0].visible for frame in range(40, 75)]
    hidden = [1 - share for share in shown if share is not None]
    assert len(hidden) == 35
    assert fraction - 1e-3 <= min(hidden) <= max(hidden) <= most


@pytest.mark.parametrize(("growth", "said"), [("", True), (", grow_frames: 3, fade_frames: 3", False)])
def test_smoke_that_takes_long_to_grow_and_to_fade_is_told(tmp_path: Any, growth: str, said: bool) -> None:
    text = (
        sky("smoke", "across", 1.0)
        .replace("speed: 2", "speed: 0.5")
        .replace("range_m: 250}", f"range_m: 250{growth}}}")
    )
    hidden = [1 - share for share in visible(text, range(36))]
    held = [index for index, share in enumerate(hidden) if share >= 0.98]
    assert (len(held) > 18) == said
    line = told(tmp_path, text).get("frames")
    how = "try a shorter time to grow and to fade"
    what = (
        f"it hides 0.98 or more of jet in frames {held[0]} to {held[-1]}, {len(held)} of them where 7 are asked: {how}"
    )
    assert line == (what if said else None)


def test_smoke_hides_no_less_than_asked() -> None:
    """Where its puffs are thinnest, too: not in one of the frames at which the search begins to look."""
    text = sky("smoke", "weave", 0.5).replace("sky}", "ground}").replace("fighter", "car")
    text = text.replace("noise: []", "noise: [], elevation_deg: -3")
    assert 0.499 <= max(visible(text, ASKED)) <= 0.501


TANK = """
frames: 60
camera: {size: [160, 96], ifov_mrad: 0.5}
background: {kind: ground}
targets:
  - {id: tank, shape: {kind: tank}, path: {kind: straight, start: [25, 45], speed: SPEED, range_m: RANGE}}
occluders:
  - {kind: KIND, hides: tank, frames: [20, 24], range_m: 100}
"""


@pytest.mark.parametrize(
    ("kind", "speed", "away", "long"),
    [
        ("pole", 0.5, 250, True),
        ("bar", 0.5, 1000, True),
        ("tree", 1, 500, True),
        ("bar", 1, 500, True),
        ("bar", 1, 1000, False),
        ("pole", 4, 250, False),
        ("tree", 4, 500, False),
    ],
)
def test_one_that_hides_a_slow_target_for_long_is_told_in_how_many_frames(
    tmp_path: Any, kind: str, speed: float, away: int, long: bool
) -> None:
    """And what is said to help does: faster targets, and those farther away."""
    text = TANK.replace("KIND", kind).replace("SPEED", str(speed)).replace("RANGE", str(away))
    # A tank at 4 px a frame begins to leave the picture at frame 30.
    held = [index for index, share in enumerate(visible(text, range(60 if speed < 4 else 28))) if share <= 0.02]
    said = told(tmp_path, text)
    if long:
        begin = f"it hides 0.98 or more of tank in frames {held[0]} to {held[-1]}, {len(held)} of them where 5 are "
        begin += "asked: it goes by at "
        assert said["frames"].startswith(begin)
        assert ("a pole, which has straight sides" in said["frames"]) == (kind == "tree")
        assert len(held) > 10
    else:
        assert said == {}
        assert len(held) <= 10 + 2 / speed


@pytest.mark.parametrize(
    ("kind", "told"),
    [("pole", True), ("building", True), ("bar", False), ("smoke, grow_frames: 3, fade_frames: 3", False)],
)
def test_what_hides_far_longer_than_asked_is_told(tmp_path: Any, kind: str, told: bool) -> None:
    """Before a sky nothing can stand above the horizon."""
    change = {**UPRIGHT[90.0], "kind: ground, spread_k: 0": "kind: sky", "elevation_deg: -5": "elevation_deg: 3"}
    text = scene(kind, heading=90.0, change=change)
    (tmp_path / "one.yaml").write_text(text)
    lines = [line for line in warnings(tmp_path / "one.yaml") if "occluders" in line]
    held = [index for index, share in enumerate(visible(text, range(60))) if share <= 0.02]
    if told:
        (line,) = lines
        assert f": occluders.{kind}.frames: warning: it hides 0.98 or more of tank in frames {held[0]} to 6" in line
        assert f"of them where 7 are asked: a {kind} stands on the ground; try a bar, or smoke" in line
        assert len(held) > 30
    else:
        assert lines == []


@pytest.mark.parametrize("kind", ["bar", "pole"])
def test_a_bar_that_hides_a_slow_point_far_longer_than_asked_is_not_told_to_be_one(kind: str) -> None:
    slow = {"kind": "straight", "start": (30, 40), "speed": 0.1, "range_m": 2000}
    scenario = {
        "frames": 80,
        "camera": {"size": (80, 80)},
        "background": {"kind": "ground", "spread_k": 0},
        "targets": [{"id": "slow", "shape": {"kind": "point"}, "path": slow}],
        "occluders": [{"kind": kind, "range_m": 500, "hides": "slow", "frames": (40, 42)}],
    }
    told = overdone(Scenario.model_validate(scenario))
    assert [notice.message.rpartition(": ")[2] for notice in told] == [
        "it goes by at 0.1 px a frame; try a faster target, one farther away, or a place"
    ]


@pytest.mark.parametrize(
    ("kind", "path"),
    [
        ("crosses", "straight, start: [60, 40], speed: 2"),
        ("crosses_m", "straight_m, start_m: [0, 0, 900], velocity_m_s: [200, 0, 0]"),
    ],
)
def test_two_that_never_part_are_told_so_wherever_they_are(kind: str, path: str) -> None:
    """Not that one of them is out of the picture, which is so as well."""
    text = f"""
frames: 60
camera: {{size: [128, 96]}}
background: {{kind: sky}}
targets:
  - {{id: jet, shape: {{kind: fighter}}, path: {{kind: {path}}}}}
  - {{id: other, shape: {{kind: fighter}}, path: {{kind: {kind}, target: jet, at_frame: 50, angle_deg: 0}}}}
"""
    with pytest.raises(InputError, match=r"other\.path\.angle_deg: at this speed and angle it never parts from jet"):
        loads(text)


@pytest.mark.parametrize("kind", ["pole", "building", "tree"])
@pytest.mark.parametrize(("away", "row"), [(400.0, 119.53), (300.0, 132.91), (150.0, 161.5)])
def test_what_stands_on_the_ground_does_so_where_that_is_as_far_away(kind: str, away: float, row: float) -> None:
    """From 16 m up, looking level at 1 mrad a px, ground R m away is tan(asin(16/R)) / 1 mrad below the middle, 79.5:
    53.41 px at 300 m; at 150 m it is below the picture, which ends at 159.5, and feet stand 2 px below that."""
    text = (
        "frames: 70\ncamera: {size: [240, 160], ifov_mrad: 1, netd_mk: 0}\n"
        "background: {kind: landscape, camera_height_m: 16, hills_mrad: 0}\n"
        "targets: [{id: tank, shape: {kind: tank}, path: {kind: straight, start: [60, 100], speed: 1, range_m: 900}}]\n"
        f"occluders: [{{kind: {kind}, hides: tank, frames: [30, 36], range_m: {away}}}]\n"
    )
    (screen,) = Renderer(loads(text)).occluders
    assert isinstance(screen, Pole | Building | Tree)
    assert screen.foot_px is not None
    assert screen.foot_px[1] == pytest.approx(row, abs=0.01)
