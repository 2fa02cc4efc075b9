"""Placed occluders against the ground truth of rendered frames; impossible placements and crossings are faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from placement_scenes import DOWNWARDS, scene, visible

from irsim import InputError, load, loads, record
from irsim.occluders.solid import Building, Pole
from irsim.occluders.tree import Tree
from irsim.render.frame import Renderer
from irsim.render.sources import open_rendering
from irsim.scenario.placement import placed_occluders


@pytest.mark.parametrize(("kind", "fraction"), [("bar", 1.0), ("pole", 0.4), ("smoke", 0.4)])
def test_truth_is_hidden_in_required_frames(kind: str, fraction: float) -> None:
    shown = visible(scene(kind, fraction))
    assert 1 - fraction - 0.02 <= max(shown[30:37]) <= 1 - fraction + 0.02
    assert min(shown[:3]) == pytest.approx(1)
    assert min(shown[66:]) == pytest.approx(1)


def test_part_of_a_target_inside_the_picture_is_hidden() -> None:
    path = "{kind: straight, start: [8, 60], speed: 1, heading_deg: 180, range_m: 2000}"
    text = (
        "{frames: 40, camera: {size: [160, 120], ifov_mrad: 0.3}, background: {kind: sky}, "
        f"targets: [{{id: jet, shape: {{kind: fighter}}, path: {path}}}], "
        "occluders: [{kind: bar, hides: jet, frames: [2, 5], range_m: 900}]}"
    )
    assert max(visible(text, range(2, 6))) < 1e-3


def test_vertical_motion() -> None:
    """A pole down to the lower edge of the picture would hide the target for twenty frames more."""
    shown = visible(scene("pole", 0.5, heading=90.0, change=DOWNWARDS), range(20, 58))
    assert max(shown[10:17]) == pytest.approx(0.5, abs=0.02)
    assert 7 <= sum(share <= 0.52 for share in shown) <= 10


def test_moving_camera() -> None:
    """An object 200 m away shifts by 5 m / 200 m / 0.5 mrad = 50 px when the camera has moved 5 m."""
    shown = visible(
        scene("bar", change={"{kind: pan, azimuth_deg_s: 0.1}": "{kind: platform, velocity_m_s: [4, 0, 0]}"})
    )
    assert max(shown[30:37]) <= 0.02
    assert min(shown[:10]) == pytest.approx(1)


def test_point_is_hidden_with_its_skirts() -> None:
    shown = visible(scene("pole", shape="point"))
    assert max(shown[30:37]) <= 0.02
    assert min(shown[:15]) == pytest.approx(1)


def test_fraction_of_a_car_in_a_bend() -> None:
    """It bends by 14 degrees in 35 frames: a strip through the middle would leave a fifth more."""
    renderer = Renderer(load("stress/occlusion-fraction", ["occluders.screen.fraction=0.4", "without=[]"]))
    shown = [renderer.scene(frame)[1].targets[0].visible for frame in range(40, 75)]
    hidden = [1 - share for share in shown if share is not None]
    assert len(hidden) == 35
    assert 0.4 - 1e-3 <= min(hidden) <= max(hidden) <= 0.44


@pytest.mark.parametrize(
    ("kind", "range_m", "row"), [("pole", 400.0, 119.53), ("tree", 300.0, 132.91), ("building", 150.0, 161.5)]
)
def test_foot_stands_on_the_ground(kind: str, range_m: float, row: float) -> None:
    """From 16 m up at 1 mrad a px, ground R m away is tan(asin(16/R)) / 1 mrad below the middle, 79.5. At 150 m it is
    below the picture, which ends at 159.5, and feet stand 2 px below that."""
    text = (
        "frames: 70\ncamera: {size: [240, 160], ifov_mrad: 1, netd_mk: 0}\n"
        "background: {kind: landscape, camera_height_m: 16, hills_mrad: 0}\n"
        "targets: [{id: tank, shape: {kind: tank}, path: {kind: straight, start: [60, 100], speed: 1, range_m: 900}}]\n"
        f"occluders: [{{kind: {kind}, hides: tank, frames: [30, 36], range_m: {range_m}}}]\n"
    )
    (screen,) = placed_occluders(loads(text))
    assert isinstance(screen, Pole | Building | Tree)
    assert screen.foot_px is not None
    assert screen.foot_px[1] == pytest.approx(row, abs=0.01)


def test_fewer_frames_leave_the_place(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(scene("bar"))
    whole = list(open_rendering(path)[0].truths())
    rendering, start, stop = open_rendering(path, frames=(25, 33))
    assert list(rendering.truths(start, stop)) == whole[25:33]
    few, start, stop = open_rendering(record(rendering, tmp_path / "a.mcap", start, stop), frames=(2, 5))
    assert list(few.truths(start, stop)) == whole[27:30]
    with pytest.raises(InputError) as caught:
        open_rendering(path, ["frames=20"])
    line = f"{path}:12:38: occluders.bar.frames: there is no frame 36; allowed: 0 to 19, or more frames, of which "
    assert str(caught.value) == line + "the first 20 can be rendered alone (stop=N)"


def test_disabled_parts_leave_the_place() -> None:
    whole, still = (Renderer(loads(scene("bar"), overrides=off)) for off in ([], ["without=[jitter, pan, tank]"]))
    assert whole.occluders == still.occluders


def test_placement_is_computed_once() -> None:
    loaded = loads(scene("bar"))
    (screen,) = placed_occluders(loaded)
    assert placed_occluders(loaded.model_copy(update={"without": ("jitter",)}))[0] is screen
    assert placed_occluders(loads(scene("bar")))[0] is screen
    assert placed_occluders(loads(scene("bar", change={"speed: 1.2": "speed: 1.1"})))[0] != screen


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"hides: tank": "hides: tnak"}, "12:24: occluders.bar.hides: there is no 'tnak'"),
        ({"[30, 36]": "[30, 99]"}, "occluders.bar.frames: there is no frame 99; allowed: 0 to 69"),
        ({"range_m: 200": "range_m: 2000"}, "occluders.bar.range_m: tank is at 900 m in frame 30"),
        ({"start: [15, 50]": "start: [-90, 50]"}, "occluders.bar.frames: tank is outside the picture in frame 30"),
        ({"heading_deg: 0.0}": "heading_deg: 0.0}, absent: [[33, 34]]"}, "frames: tank does not exist in frame 33"),
        ({"speed: 1.2": "speed: 0.0", "[15, 50]": "[60, 50]"}, "also hides 1.00 of it in frame 29"),
        ({"frames: [30, 36], ": ""}, "occluders.bar.frames: 'hides' needs the frames to hide it in"),
        ({"hides: tank, ": ""}, "occluders.bar.center_px: it is missing"),
        ({"hides: tank": "hides: tank, size_px: [3, 4]"}, "its place follows from 'hides'"),
    ],
)
def test_infeasible_placements(change: dict[str, str], line: str) -> None:
    with pytest.raises(InputError) as caught:
        loads(scene("bar", change=change), name="")
    assert line.split(": ", 1)[-1] in str(caught.value)
    assert str(caught.value).count("\n") == 0


CROSSING = """
frames: 70
camera: {size: [120, 80], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets:
  - {id: jet, shape: {kind: point}, path: {kind: straight, start: [15, 40], speed: 1.0}}
  - {id: other, shape: {kind: point}, path: {kind: crosses, target: jet, at_frame: 45, angle_deg: 40, farther_m: -100}}
"""


def test_truth_of_a_crossing() -> None:
    renderer = Renderer(loads(CROSSING))
    crossing = [all(target.crossing for target in renderer.scene(frame)[1].targets) for frame in (30, 45)]
    assert crossing == [False, True]
    jet, other = renderer.scene(45)[1].targets
    np.testing.assert_allclose(jet.center, other.center, atol=1e-6)
    assert jet.occluders == ("other",)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"at_frame: 45": "at_frame: 99"}, "targets.other.path.at_frame: there is no frame 99; allowed: 0 to 69"),
        ({"[15, 40]": "[-60, 40]"}, "targets.other.path.at_frame: jet is outside the picture in frame 45"),
        ({"angle_deg: 40": "angle_deg: 0, speed: 1.0"}, "path.angle_deg: at this speed and angle it never separates"),
        ({"-100": "-2000"}, "targets.other.path.farther_m: jet is at 1000 m; allowed: more than -1000"),
        ({"speed: 1.0}}": "speed: 1.0}, absent: [[44, 60]]}"}, "path.at_frame: jet does not exist in frame 45"),
        ({"at_frame: 45": "at_frame: 45, miss_px: 300"}, "at_frame: other is outside the picture in frame 45"),
    ],
)
def test_infeasible_crossings(change: dict[str, str], line: str) -> None:
    text = CROSSING
    for old, new in change.items():
        text = text.replace(old, new)
    with pytest.raises(InputError) as caught:
        loads(text)
    assert line in str(caught.value)
    assert str(caught.value).count("\n") == 0
