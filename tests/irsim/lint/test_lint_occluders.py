"""Warnings about placed occluders, against the ground truth of rendered frames."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from placement_scenes import DOWNWARDS, scene, visible

from irsim import loads
from irsim.lint import lint
from irsim.lint.warnings import warnings
from irsim.render.frame import Renderer

HEAD = "frames: 110\ncamera: {size: [160, 120], ifov_mrad: 0.5, noise: []}\nbackground: {kind: ground, spread_k: 0}\n"


def target(name: str, x: float = 20, y: float = 60, shape: str = "tank", speed: float = 1, heading: float = 0) -> str:
    away = 700 if shape == "tank" else 600
    path = f"{{kind: straight, range_m: {away}, start: [{x}, {y}], speed: {speed}, heading_deg: {heading}}}"
    return f"  - {{id: {name}, shape: {{kind: {shape}}}, path: {path}}}\n"


def other(path: str) -> str:
    return f"  - {{id: o, shape: {{kind: car}}, path: {{{path}}}}}\n"


def screen(name: str, hides: str, frames: tuple[int, int], fraction: float = 1.0, kind: str = "bar") -> str:
    placed = f"hides: {hides}, frames: [{frames[0]}, {frames[1]}], fraction: {fraction}"
    return f"  - {{kind: {kind}, id: {name}, {placed}, range_m: 200}}\n"


TANK, VAN, A = target("tank"), target("van", x=-10, shape="car"), screen("a", "tank", (50, 56))


def two(targets: str, occluders: str, end: str = "") -> str:
    return f"{HEAD}targets:\n{targets}occluders:\n{occluders}{end}"


def warned(folder: Path, text: str) -> dict[str, str]:
    """Return the messages by occluder and key."""
    (folder / "one.yaml").write_text(text)
    found = (re.search(r"occluders\.(\w+\.\w+): warning: (.*)", line) for line in warnings(folder / "one.yaml"))
    return {match[1]: match[2] for match in found if match is not None}


def hidden(text: str, name: str, frames: range) -> list[float]:
    """Return the hidden fraction of a target in each frame; 0 out of view."""
    renderer = Renderer(loads(text))
    truths = (renderer.scene(frame)[1].target(name) for frame in frames)
    return [0.0 if each is None or each.visible is None or not each.in_view else 1 - each.visible for each in truths]


SKY = """
frames: 36
camera: {size: [128, 96], ifov_mrad: 1.2, noise: []}
background: {kind: sky}
targets: [{id: jet, shape: {kind: fighter}, path: {kind: PATH, range_m: 500}}]
occluders: [{kind: KIND, id: one, hides: jet, frames: [14, 20], fraction: FRACTION, range_m: 250}]
"""
WEAVE = "weave, start: [20, 60], speed: 1, amplitude_px: 8, period_frames: 20"


@pytest.mark.parametrize(
    ("kind", "path", "fraction"),
    [
        ("bar", "straight, start: [10, 50], speed: 2", 0.3),
        ("tree", WEAVE, 0.5),
        ("smoke", WEAVE, 0.5),
    ],
)
def test_more_than_required(tmp_path: Path, kind: str, path: str, fraction: float) -> None:
    text = SKY.replace("PATH", path).replace("KIND", kind).replace("FRACTION", str(fraction))
    during = {frame: share for frame, share in enumerate(hidden(text, "jet", range(36))) if 14 <= frame <= 20}
    assert min(during.values()) >= fraction - 1e-3
    found = warned(tmp_path, text)
    over = [frame for frame, share in during.items() if share > fraction + 0.2]
    assert ("one.fraction" in found) == bool(over)
    if over:
        line = f"it hides up to {max(during.values()):.2f} of jet in frames {over[0]} to {over[-1]} instead of"
        assert found["one.fraction"].startswith(line)


@pytest.mark.parametrize(
    ("kind", "speed", "range_m", "long"),
    [("pole", 0.5, 250, True), ("tree", 4, 500, False)],
)
def test_longer_than_required(tmp_path: Path, kind: str, speed: float, range_m: float, long: bool) -> None:
    text = f"""
frames: 60
camera: {{size: [160, 96], ifov_mrad: 0.5}}
background: {{kind: ground}}
targets:
  - {{id: tank, shape: {{kind: tank}}, path: {{kind: straight, start: [25, 45], speed: {speed}, range_m: {range_m}}}}}
occluders: [{{kind: {kind}, hides: tank, frames: [20, 24], range_m: 100}}]
"""
    held = [frame for frame, share in enumerate(visible(text, range(60 if speed < 4 else 28))) if share <= 0.02]
    found = warned(tmp_path, text)
    line = f"it hides 0.98 or more of tank in {len(held)} frames, {held[0]} to {held[-1]}, instead of 5: it passes at "
    assert list(found) == [f"{kind}.frames"] * long
    assert all(message.startswith(line) for message in found.values())


@pytest.mark.parametrize(("growth", "long"), [("", True), (", grow_frames: 3, fade_frames: 3", False)])
def test_slow_smoke(tmp_path: Path, growth: str, long: bool) -> None:
    text = SKY.replace("PATH", "straight, start: [10, 50], speed: 0.5").replace("FRACTION", f"1{growth}")
    found = warned(tmp_path, text.replace("KIND", "smoke"))
    assert ("try a shorter time to grow and to fade" in found.get("one.frames", "")) == long


@pytest.mark.parametrize(("kind", "long"), [("pole", True), ("bar", False)])
def test_standing_occluder_before_a_sky(tmp_path: Path, kind: str, long: bool) -> None:
    """Nothing can stand above the horizon."""
    change = {**DOWNWARDS, "kind: ground, spread_k: 0": "kind: sky", "elevation_deg: -5": "elevation_deg: 3"}
    found = warned(tmp_path, scene(kind, heading=90.0, change=change))
    assert list(found) == [f"{kind}.frames"] * long
    assert all(message.endswith(f"a {kind} stands on the ground; try a bar, or smoke") for message in found.values())


@pytest.mark.parametrize(
    ("frames", "fraction", "kind", "over"),
    [
        ((50, 56), 0.5, "bar", False),  # the lower half, both times
        ((47, 56), 1.0, "bar", True),
    ],
)
def test_more_than_required_together(
    tmp_path: Path, frames: tuple[int, int], fraction: float, kind: str, over: bool
) -> None:
    text = two(TANK, screen("a", "tank", (40, 46), 0.5) + screen("b", "tank", frames, fraction, kind))
    found = {place: message for place, message in warned(tmp_path, text).items() if "it passes at" not in message}
    assert list(found) == ["a.fraction"] * over
    if over:
        shares = hidden(text, "tank", range(40, 47))
        during = [frame for frame, share in enumerate(shares, 40) if share > 0.7]
        line = f"with b it hides up to {max(shares):.2f} of tank in frames {during[0]} to {during[-1]} instead of 0.5"
        assert found["a.fraction"].startswith(line)


def test_other_target_and_remedies(tmp_path: Path) -> None:
    text = two(TANK + VAN, A)
    shares = hidden(text, "van", range(60, 110))
    over = [frame for frame, share in enumerate(shares, 60) if share > 0.2]
    assert warned(tmp_path, text) == {
        "a.hides": f"it also hides up to {max(shares):.2f} of van in frames {over[0]} to {over[-1]}, which is not "
        "required: try other frames, or a range_m from 601 on; to ignore it, write 'follow: tank'"
    }
    assert warned(tmp_path, text + "follow: tank\n") == {}
    assert warned(tmp_path, text.replace("range_m: 200", "range_m: 601")) == {}
    vans = [target(f"van{index}", x=-10 - 4 * index, shape="car") for index in range(3)]
    assert " (and van1, van2), which" in warned(tmp_path, two(TANK + "".join(vans), A))["a.hides"]


@pytest.mark.parametrize(
    ("targets", "occluders", "place"),
    [
        (TANK + target("van", x=150, shape="point", speed=20, heading=180), A, None),
        (TANK + other("kind: crosses, target: tank, at_frame: 53, speed: 1"), A, None),
        (TANK + other("kind: crosses, target: tank, at_frame: 65, angle_deg: 180, speed: 1"), A, "a.hides"),
        (TANK + VAN, "  - {kind: bar, id: b, center_px: [70, 60], size_px: [30, 30], range_m: 200}\n", None),
    ],
    ids=["fast", "crossing while hidden", "crossing later", "at a place"],
)
def test_intended_other_targets(tmp_path: Path, targets: str, occluders: str, place: str | None) -> None:
    assert list(warned(tmp_path, two(targets, occluders))) == ([] if place is None else [place])


def test_disabled_occluder_is_not_reported() -> None:
    text = two(TANK, screen("a", "tank", (40, 46), 0.5) + screen("b", "tank", (47, 56)))
    for off, reported in (((), True), (("without=[b]",), False)):
        places = [notice.at for notice in lint(loads(text, overrides=off))]
        assert (("occluders", 0, "fraction") in places) == reported
