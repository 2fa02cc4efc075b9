"""Occluders placed by whom they hide, against the truth of the rendered frames; crossings that cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from irsim import InputError, loads, open_recording, record
from irsim.cli.app import app
from irsim.lint.warnings import warnings
from irsim.occluders import OCCLUDERS
from irsim.render.frame import Renderer
from irsim.render.sources import open_rendering
from irsim.scenario.placement_all import placed

SCENE = """
frames: 70
camera:
  size: [120, 80]
  netd_mk: 0
  elevation_deg: -5
  motion: [{kind: jitter, rms_px: 0.5}, {kind: pan, azimuth_deg_s: 0.1}]
background: {kind: ground, spread_k: 0}
targets:
  - {id: tank, shape: {kind: SHAPE}, path: {kind: straight, range_m: 900, start: [15, 50], HOW}}
occluders:
  - {kind: KIND, hides: tank, frames: [30, 36], fraction: FRACTION, range_m: 200}
"""


def scene(
    kind: str, fraction: float = 1.0, shape: str = "tank", heading: float = 0.0, change: dict[str, str] | None = None
) -> str:
    text = SCENE.replace("KIND", kind).replace("FRACTION", str(fraction)).replace("SHAPE", shape)
    text = text.replace("HOW", f"speed: 1.2, heading_deg: {heading}")
    for old, new in (change or {}).items():
        text = text.replace(old, new)
    return text


def visible(text: str, frames: range = range(70), overrides: tuple[str, ...] = ()) -> list[float]:
    renderer = Renderer(loads(text, overrides=overrides))
    found = [renderer.scene(frame)[1].targets[0].visible for frame in frames]
    assert None not in found
    return [share for share in found if share is not None]


@pytest.mark.sampled
@pytest.mark.parametrize("kind", [name for name, _ in OCCLUDERS])
@pytest.mark.parametrize("fraction", [1.0, 0.4])
def test_truth_shows_that_it_was_hidden_then_and_not_otherwise(kind: str, fraction: float) -> None:
    shown = visible(scene(kind, fraction))
    assert max(shown[30:37]) <= 1 - fraction + 0.02
    # No more than asked where it is worst seen; smoke is uneven, and leaves are.
    assert max(shown[30:37]) >= 1 - fraction - 0.02
    assert min(shown[:3]) == pytest.approx(1)
    assert min(shown[66:]) == pytest.approx(1)


def at_the_edge(first: int, last: int) -> str:
    """A jet on its way out at the left, and a bar that is to hide it."""
    way = "{kind: straight, start: [8, 60], speed: 1, heading_deg: 180, range_m: 2000}"
    return (
        "{frames: 40, camera: {size: [160, 120], ifov_mrad: 0.3}, background: {kind: sky}, "
        f"targets: [{{id: jet, shape: {{kind: fighter}}, path: {way}}}], "
        f"occluders: [{{kind: bar, hides: jet, frames: [{first}, {last}], range_m: 900}}]}}"
    )


def test_what_is_in_the_picture_of_a_target_at_its_edge_is_hidden() -> None:
    assert max(visible(at_the_edge(2, 5), range(2, 6))) < 1e-3


@pytest.mark.sampled
@pytest.mark.parametrize("seed", range(5))
def test_a_tree_hides_hardly_longer_than_a_house_does(seed: int) -> None:
    """What a house hides beyond the seven frames is what a box is wider than the tank in it. A crown that had no gaps
    in its inner 0.6 alone would hide for twelve frames more, and longer."""
    house, tree = (
        sum(share <= 0.02 for share in visible(f"seed: {seed}\n" + scene(kind))) for kind in ("building", "tree")
    )
    assert 7 <= house <= tree <= house + 8


@pytest.mark.parametrize("heading", [90.0, -60.0])
def test_it_hides_what_goes_up_or_down_too(heading: float) -> None:
    text = scene("bar", 0.5, heading=heading, change={"[15, 50]": "[60, 2]" if heading > 0 else "[40, 90]"})
    shown = visible(text, range(25, 42))
    assert max(shown[5:12]) == pytest.approx(0.5, abs=0.02)


UPRIGHT = {
    90.0: {"[15, 50]": "[60, 2]"},
    -90.0: {"[15, 50]": "[60, 90]", "frames: [30, 36]": "frames: [40, 46]"},
}


@pytest.mark.parametrize("kind", ["pole", "building"])
@pytest.mark.parametrize("heading", UPRIGHT)
def test_what_stands_on_the_ground_hides_what_goes_up_or_down_no_longer_than_a_bar(kind: str, heading: float) -> None:
    """Of seven frames that are asked for; down to the picture's lower edge it would hide for twenty more."""
    own, bar = (
        [
            index
            for index, share in zip(
                range(20, 58),
                visible(scene(each, 0.5, heading=heading, change=UPRIGHT[heading]), range(20, 58)),
                strict=True,
            )
            if share <= 0.52
        ]
        for each in (kind, "bar")
    )
    assert 7 <= len(bar) <= 10
    assert own == bar


def test_it_hides_a_point_with_its_skirts() -> None:
    shown = visible(scene("pole", shape="point"))
    assert max(shown[30:37]) <= 0.02
    assert min(shown[:15]) == pytest.approx(1)


def test_fewer_frames_leave_it_where_it_is(tmp_path: Any) -> None:
    """Frames before those in which it hides, of the scenario and of a recording of it."""
    path = tmp_path / "scene.yaml"
    path.write_text(scene("bar"))
    whole = list(open_rendering(path)[0].truths())
    rendering, start, stop = open_rendering(path, frames=(25, 33))
    assert list(rendering.truths(start, stop)) == whole[25:33]
    few, start, stop = open_rendering(record(rendering, tmp_path / "a.mcap", start, stop), frames=(2, 5))
    assert list(few.truths(start, stop)) == whole[27:30]
    longer, start, stop = open_rendering(path, frames=(68, 72))
    assert (start, stop) == (68, 72)
    assert list(longer.truths(68, 70)) == whole[68:]


def test_too_few_frames_say_how_to_render_fewer(tmp_path: Any) -> None:
    """And what they say works."""
    path = tmp_path / "scene.yaml"
    path.write_text(scene("bar"))
    with pytest.raises(InputError) as caught:
        open_rendering(path, ["frames=20"])
    said = f"{path}:12:38: occluders.bar.frames: there is no frame 36; allowed: 0 to 19, or more frames, of which "
    assert str(caught.value) == said + "the first 20 can be rendered alone (stop=N)"
    done = CliRunner().invoke(app, ["render", str(path), "--frames", "20", "-o", str(tmp_path / "few.mcap")])
    assert done.exit_code == 0
    assert len(open_recording(tmp_path / "few.mcap")) == 20


def test_it_stays_where_it_is_when_other_things_are_switched_off() -> None:
    text = scene("bar")
    whole, still = Renderer(loads(text)), Renderer(loads(text, overrides=["without=[jitter, pan, tank]"]))
    assert whole.occluders == still.occluders


def test_it_hides_from_a_camera_that_moves_aside() -> None:
    """Something 200 m away shifts by 5 m / 200 m / 0.5 mrad = 50 px when the camera has gone 5 m."""
    moved = scene("bar", change={"{kind: pan, azimuth_deg_s: 0.1}": "{kind: platform, velocity_m_s: [4, 0, 0]}"})
    shown = visible(moved)
    assert max(shown[30:37]) <= 0.02
    assert min(shown[:10]) == pytest.approx(1)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"hides: tank": "hides: tnak"}, "12:24: occluders.bar.hides: there is no 'tnak'"),
        ({"[30, 36]": "[30, 99]"}, "occluders.bar.frames: there is no frame 99; allowed: 0 to 69"),
        ({"range_m: 200": "range_m: 2000"}, "occluders.bar.range_m: tank is 900 m away at frame 30"),
        ({"start: [15, 50]": "start: [-90, 50]"}, "occluders.bar.frames: tank is out of the picture at frame 30"),
        ({"heading_deg: 0.0}": "heading_deg: 0.0}, absent: [[33, 34]]"}, "frames: tank is not there at frame 33"),
        ({"speed: 1.2": "speed: 0.0", "[15, 50]": "[60, 50]"}, "hides 1.00 of it at frame 29 too"),
        ({"frames: [30, 36], ": ""}, "occluders.bar.frames: 'hides' needs the frames to hide it in"),
        ({"hides: tank, ": ""}, "occluders.bar.center_px: it is missing"),
        ({"hides: tank": "hides: tank, size_px: [3, 4]"}, "its place follows from 'hides'"),
    ],
)
def test_an_intent_that_cannot_be_met_is_refused_with_its_place(change: dict[str, str], line: str) -> None:
    with pytest.raises(InputError) as caught:
        loads(scene("bar", change=change), name="")
    assert line.split(": ", 1)[-1] in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_one_that_hides_nobody_is_told(tmp_path: Any) -> None:
    text = scene("bar", change={"hides: tank, frames: [30, 36]": "center_px: [60, 10], size_px: [20, 5]"})
    (tmp_path / "one.yaml").write_text(text)
    (line,) = warnings(tmp_path / "one.yaml")
    assert line.endswith("one.yaml:12:5: occluders.bar: warning: it hides no target in any frame")
    (tmp_path / "one.yaml").write_text(text.replace("[60, 10]", "[60, 48]"))
    assert warnings(tmp_path / "one.yaml") == []


@pytest.mark.parametrize(
    ("camera", "absent", "told"),
    [
        ("", "[[60, 69]]", []),
        ("", "[[69, 99]]", ["7:25: targets.tank.absent.0: warning: it goes on until frame 99, after the last, 69"]),
        ("", "[[3, 9], [70, 99]]", ["7:33: targets.tank.absent.1: warning: it begins at frame 70, after the last, 69"]),
        (
            "",
            "[[0, 30], [31, 99]]",
            [
                "7:34: targets.tank.absent.1: warning: it goes on until",
                "7:24: targets.tank.absent: warning: tank is there in no frame",
            ],
        ),
        ("correction: {frames: [30, 80]},", "[]", ["camera.correction.frames.1: warning: it begins at frame 80"]),
        ("faults: [{kind: drop, frames: [80]}],", "[]", ["camera.faults.drop.frames.0: warning: it begins at"]),
    ],
)
def test_what_comes_after_the_last_frame_is_told(tmp_path: Any, camera: str, absent: str, told: list[str]) -> None:
    (tmp_path / "one.yaml").write_text(f"""
frames: 70
camera: {{{camera} size: [120, 80]}}
background: {{kind: ground}}
targets:
  - {{id: other, shape: {{kind: point}}, path: {{kind: straight, start: [9, 9]}}}}
  - {{id: tank, absent: {absent}, shape: {{kind: point}}, path: {{kind: straight, start: [9, 9]}}}}
""")
    lines = warnings(tmp_path / "one.yaml")
    assert len(lines) == len(told)
    assert all(what in line for what, line in zip(told, lines, strict=True))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({}, False),
        ({"start: [15, 50]": "start: [-300, 50]"}, True),
        ({"heading_deg: 0.0}": "heading_deg: 0.0}, absent: [[0, 69]]"}, True),
    ],
    ids=["in view", "out of view", "absent"],
)
def test_one_that_is_never_in_the_picture_is_told(tmp_path: Any, change: dict[str, str], told: bool) -> None:
    off = {"hides: tank, frames: [30, 36]": "center_px: [60, 48], size_px: [20, 5]"}
    (tmp_path / "one.yaml").write_text(scene("bar", change={**off, **change}))
    lines = [line for line in warnings(tmp_path / "one.yaml") if line.endswith("never in the picture")]
    assert [line.split("warning: ")[-1] for line in lines] == [
        "tank, whom trackers follow, is never in the picture"
    ] * told


CROSSING = """
frames: 70
camera: {size: [120, 80], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets:
  - {id: jet, shape: {kind: point}, path: {kind: straight, start: [15, 40], speed: 1.0}}
  - {id: other, shape: {kind: point}, path: {kind: crosses, target: jet, at_frame: 45, angle_deg: 40, farther_m: -100}}
"""


def test_a_crossing_is_in_the_truth_at_its_frame() -> None:
    renderer = Renderer(loads(CROSSING))
    crossing = [all(target.crossing for target in renderer.scene(frame)[1].targets) for frame in range(70)]
    assert crossing[45]
    assert not crossing[30]
    jet, other = renderer.scene(45)[1].targets
    np.testing.assert_allclose(jet.center, other.center, atol=1e-6)
    assert jet.occluders == ("other",)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"at_frame: 45": "at_frame: 99"}, "targets.other.path.at_frame: there is no frame 99; allowed: 0 to 69"),
        ({"[15, 40]": "[-60, 40]"}, "targets.other.path.at_frame: jet is out of the picture at frame 45"),
        (
            {"angle_deg: 40": "angle_deg: 0, speed: 1.0"},
            "path.angle_deg: at this speed and angle it never parts from jet",
        ),
        ({"-100": "-2000"}, "targets.other.path.farther_m: jet is 1000 m away; allowed: more than -1000"),
        ({"speed: 1.0}}": "speed: 1.0}, absent: [[44, 60]]}"}, "path.at_frame: jet is not there at frame 45"),
        ({"at_frame: 45": "at_frame: 45, miss_px: 300"}, "at_frame: other is out of the picture at frame 45"),
    ],
)
def test_a_crossing_that_cannot_happen_is_refused(change: dict[str, str], line: str) -> None:
    text = CROSSING
    for old, new in change.items():
        text = text.replace(old, new)
    with pytest.raises(InputError) as caught:
        loads(text)
    assert line in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_a_place_is_looked_for_once() -> None:
    """For all that look at a scenario, whatever is off in it; in another one, anew."""
    loaded = loads(scene("bar"))
    (screen,) = placed(loaded)
    assert placed(loaded.model_copy(update={"without": ("jitter",)}))[0] is screen
    assert Renderer(loaded).occluders[0] is screen
    moved = loads(scene("bar", change={"speed: 1.2": "speed: 1.1"}))
    assert placed(moved)[0] != screen
