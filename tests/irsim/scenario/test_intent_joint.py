"""What occluders that are placed by whom they hide do together, and to others: warnings against the truth."""

from __future__ import annotations

import re
from pathlib import Path

import carried
import pytest

from irsim import loads
from irsim.lint import doubts
from irsim.lint.warnings import warnings
from irsim.render.frame import Renderer

HEAD = "frames: 110\ncamera: {size: [160, 120], ifov_mrad: 0.5, noise: []}\nbackground: {kind: ground, spread_k: 0}\n"


def target(name: str, x: float = 20, y: float = 60, shape: str = "tank", speed: float = 1, heading: float = 0) -> str:
    away = 700 if shape == "tank" else 600
    way = f"start: [{x}, {y}], speed: {speed}, heading_deg: {heading}"
    path = f"{{kind: straight, range_m: {away}, {way}}}"
    return f"  - {{id: {name}, shape: {{kind: {shape}}}, path: {path}}}\n"


def screen(name: str, hides: str, frames: tuple[int, int], fraction: float = 1.0, kind: str = "bar") -> str:
    asked = f"hides: {hides}, frames: [{frames[0]}, {frames[1]}], fraction: {fraction}"
    return f"  - {{kind: {kind}, id: {name}, {asked}, range_m: 200}}\n"


TANK, VAN, A = target("tank"), target("van", x=-10, shape="car"), screen("a", "tank", (50, 56))


def scene(targets: str, occluders: str, end: str = "") -> str:
    return f"{HEAD}targets:\n{targets}occluders:\n{occluders}{end}"


def told(folder: Path, text: str) -> dict[str, str]:
    """Warnings by the occluder and its key, but for those of one that hides its own target for long."""
    (folder / "one.yaml").write_text(text)
    found = (re.search(r"occluders\.(\w+\.\w+): warning: (.*)", line) for line in warnings(folder / "one.yaml"))
    return {match[1]: match[2] for match in found if match is not None and "are asked: it goes by" not in match[2]}


def hidden(text: str, name: str, frames: range, overrides: tuple[str, ...] = ()) -> list[float]:
    """Of the target, or out of the picture, in each of the frames; 0 where it is not in view."""
    renderer = Renderer(loads(text, overrides=overrides))
    truths = (renderer.scene(frame)[1].target(name) for frame in frames)
    return [0.0 if seen is None or seen.visible is None or not seen.in_view else 1 - seen.visible for seen in truths]


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("frames", "fraction", "kind", "told_at"),
    [
        ((50, 56), 0.5, "bar", None),  # the lower half, both times
        ((47, 56), 1.0, "bar", "a"),
        ((42, 48), 0.5, "smoke", "a"),
        ((40, 46), 0.7, "smoke", None),  # 0.85 of it, where 0.7 is asked by one of them
        ((70, 76), 1.0, "bar", None),
    ],
)
def test_more_than_asked_by_two_is_told(
    tmp_path: Path, frames: tuple[int, int], fraction: float, kind: str, told_at: str | None
) -> None:
    text = scene(TANK, screen("a", "tank", (40, 46), 0.5) + screen("b", "tank", frames, fraction, kind))
    said = told(tmp_path, text)
    if told_at is None:
        assert said == {}
        return
    shares = hidden(text, "tank", range(40, 47))
    over = [index for index, share in enumerate(shares, 40) if share > 0.7]
    line = f"with b it hides up to {max(shares):.2f} of tank in frames {over[0]} to {over[-1]}, where 0.5 is asked"
    assert list(said) == ["a.fraction"]
    assert said["a.fraction"].startswith(line)


@pytest.mark.parametrize(("begin", "said"), [(51, False), (54, True), (72, True), (80, False)])
def test_two_between_which_the_target_is_not_seen_are_told(tmp_path: Path, begin: int, said: bool) -> None:
    """A gap of four frames is told no more than four frames too many of one are; in a wide one it comes out."""
    text = scene(TANK, screen("a", "tank", (40, 46)) + screen("b", "tank", (begin, begin + 6)))
    gap = hidden(text, "tank", range(47, begin))
    if len(gap) > 4:
        assert (min(gap) >= 0.98) == said
    end = begin + 6
    line = f"with a it hides 0.98 or more of tank in frames 40 to {end} without a break, where 40 to 46 and {begin} to "
    line += f"{end} are asked"
    lines = told(tmp_path, text)
    assert list(lines) == ["b.frames"] * said
    assert all(each.startswith(line) for each in lines.values())


def test_another_that_it_hides_unasked_is_told_with_what_helps(tmp_path: Path) -> None:
    """And what is said to help does."""
    text = scene(TANK + VAN, A)
    shares = hidden(text, "van", range(60, 110))
    over = [index for index, share in enumerate(shares, 60) if share > 0.2]
    lines = told(tmp_path, text)
    assert lines == {
        "a.hides": f"it hides van too, up to {max(shares):.2f} of it in frames {over[0]} to {over[-1]}, where nobody "
        "asks that: try other frames, or a range_m from 601 on; if it does not matter, say so by 'follow: tank'"
    }
    assert told(tmp_path, text + "follow: tank\n") == {}
    farther = text.replace("range_m: 200", "range_m: 601")
    assert told(tmp_path, farther) == {}
    assert max(hidden(farther, "van", range(60, 110, 5))) < 1e-6
    assert "a.hides" in told(tmp_path, text + "follow: van\n")


@pytest.mark.parametrize(
    ("targets", "occluders"),
    [
        (TANK + target("van", y=30, shape="car"), A),
        (TANK + target("van", y=95, shape="car"), A),
        # It goes by in a few frames.
        (TANK + target("van", x=150, shape="point", speed=20, heading=180), A),
        (TANK + "  - {id: o, shape: {kind: car}, path: {kind: crosses, target: tank, at_frame: 53, speed: 1}}\n", A),
        (TANK + "  - {id: o, shape: {kind: car}, path: {kind: follow, target: tank, lag_frames: 25}}\n", A),
        (TANK + target("van", y=75), A + screen("b", "van", (52, 58))),
        (TANK + VAN, "  - {kind: bar, id: b, center_px: [70, 60], size_px: [30, 30], range_m: 200}\n"),
    ],
    ids=["above", "below", "fast", "crossing", "convoy", "both asked", "placed"],
)
def test_what_is_meant_or_slight_is_not_told(tmp_path: Path, targets: str, occluders: str) -> None:
    assert told(tmp_path, scene(targets, occluders)) == {}


def test_a_crossing_that_is_not_hidden_itself_is_no_excuse(tmp_path: Path) -> None:
    oncoming = "{kind: crosses, target: tank, at_frame: 65, angle_deg: 180, speed: 1}"
    text = scene(TANK + f"  - {{id: o, shape: {{kind: car}}, path: {oncoming}}}\n", A)
    assert told(tmp_path, text)["a.hides"].startswith("it hides o too, up to 1.00 of it in frames 5")


def test_several_that_it_hides_unasked_are_one_line(tmp_path: Path) -> None:
    more = [target(f"van{index}", x=-10 - 4 * index, shape="car") for index in range(3)]
    lines = told(tmp_path, scene(TANK + "".join(more[:2]), A))
    assert [re.search(r"\(.*\)", line)[0] for line in lines.values()] == ["(and van1 as well)"]  # type: ignore[index]  # it is told of both
    lines = told(tmp_path, scene(TANK + "".join(more), A))
    assert [re.search(r"\(.*\)", line)[0] for line in lines.values()] == ["(and 2 more, such as van1)"]  # type: ignore[index]  # of all


def test_one_that_spoils_what_another_is_asked_to_hide_is_told_where_that_is_asked(tmp_path: Path) -> None:
    text = scene(TANK + VAN, A + screen("b", "van", (80, 86), 0.5), "follow: tank\n")
    shares = hidden(text, "van", range(80, 87))
    lines = told(tmp_path, text)
    assert lines["b.fraction"] == (
        f"with a, which shall hide tank, it hides up to {max(shares):.2f} of van in frames 80 to 86, where 0.5 is "
        "asked: try frames farther apart, or another range_m"
    )
    assert "if it does not matter" not in lines["a.hides"]  # it does: something shall hide it
    assert max(hidden(text, "van", range(80, 87), ("without=[a]",))) < 0.7
    (tmp_path / "off.yaml").write_text(text)
    assert not any(
        "with a," in line or "occluders.a" in line for line in warnings(tmp_path / "off.yaml", ["without=[a]"])
    )


@pytest.mark.parametrize(
    ("kind", "range_m", "velocity_m_s", "wide"),
    [
        ("pole", 300.0, (30.0, 0.0, 0.0), True),
        ("tree", 300.0, (30.0, 0.0, 0.0), True),
        ("bar", 300.0, (30.0, 0.0, 0.0), False),  # which may be a wall
        ("pole", 1900.0, (30.0, 0.0, 0.0), False),
        ("pole", 300.0, (0.0, 0.0, 0.0), False),
        ("pole", 300.0, (0.0, 30.0, 0.0), False),  # towards it
    ],
)
def test_a_pole_that_a_carried_camera_makes_a_wall_is_told(
    kind: str, range_m: float, velocity_m_s: tuple[float, float, float], wide: bool
) -> None:
    """In 8 steps of 1/30 s the car goes 5.3 m, 5.3 px at 2 km, and is 6 px long: 13 with the margins. The camera goes
    8 m, and its line to the car 0.85 8 + 0.15 5.3 = 7.6 m at 300 m, 51 px (0.5 mrad a pixel)."""
    path = {"kind": "straight_m", "axes": "world", "start_m": (0.0, 2e3, 0.0), "velocity_m_s": (20.0, 0.0, 0.0)}
    car = {"id": "car", "shape": {"kind": "hot_spot", "size_m": (6.0, 3.0)}, "path": path}
    hider = {"kind": kind, "range_m": range_m, "hides": "car", "frames": (20, 28)}
    ground, camera = {"kind": "ground"}, {"elevation_deg": 0.0}
    scenario = carried.scene(ground, velocity_m_s, camera=camera, targets=[car], occluders=[hider])
    told = [notice.message for notice in doubts(scenario) if notice.at == ("occluders", 0, "range_m")]
    assert len(told) == wide
    assert all(f"a {kind} 61 px or 9.1 m wide" in what and "need 13 px" in what for what in told)
