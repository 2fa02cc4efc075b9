"""Commands that look at every frame of a scenario tell how far they are, and look no more often than they must."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from weakref import ref

import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.cli.terminal import progress_bar
from irsim.geometry.context import SceneContext
from irsim.lint import CHECKS
from irsim.lint.occluders import placed_occluder_excessive
from irsim.lint.warnings import warnings
from irsim.occluders import Occluder
from irsim.occluders.tree import Tree
from irsim.scenario.placement import placed_occluders
from irsim.scenario.visibility import TargetVisibility
from irsim.targets.target import Target
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Box

SCENE = """\
frames: 30
camera: {size: [64, 48]}
background: {kind: sky}
targets:
  - id: a
    shape: {kind: point}
    path: {kind: straight, start: [2, 20], speed: 2, range_m: 500}
"""
HIDDEN = SCENE + "occluders:\n  - {kind: tree, id: oak, range_m: 100, hides: a, frames: [12, 15]}\n"


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[tuple[int, ...]]]:
    """What is told to each bar, by its label."""
    bars: dict[str, list[tuple[int, ...]]] = {}

    @contextmanager
    def bar(label: str, total: int | None = None) -> Iterator[object]:
        counts = bars[label] = [] if total is None else [(0, total)]
        yield lambda *given: counts.append(given)

    for module in ("irsim.cli.app", "irsim.cli.info"):
        monkeypatch.setattr(f"{module}.progress_bar", bar)
    return bars


def scene(folder: Path, text: str = SCENE) -> str:
    file = folder / "scene.yaml"
    file.write_text(text)
    return str(file)


def test_a_check_tells_of_each_doubt(told: dict[str, list[tuple[int, ...]]], tmp_path: Path) -> None:
    file = scene(tmp_path)
    done = CliRunner().invoke(app, ["check", file])
    assert (done.exit_code, done.stdout) == (0, f"{file}: ok\n")
    assert told == {f"check {file}": [(done, len(CHECKS)) for done in range(1, len(CHECKS) + 1)]}


def test_a_check_of_several_severities_tells_of_all(tmp_path: Path) -> None:
    file, counts = scene(tmp_path, SCENE + "severities: {camera.netd_mk: [40, 80, 160]}\n"), list[tuple[int, int]]()
    warnings(file, progress=lambda *given: counts.append(given))
    assert counts == [(done, 3 * len(CHECKS)) for done in range(1, 3 * len(CHECKS) + 1)]
    counts.clear()
    warnings(file, ["severity=1"], lambda *given: counts.append(given))
    assert counts[-1] == (len(CHECKS), len(CHECKS))


def test_info_tells_of_each_frame(told: dict[str, list[tuple[int, ...]]], tmp_path: Path) -> None:
    assert CliRunner().invoke(app, ["info", scene(tmp_path)]).exit_code == 0
    assert told == {"info scene": [(0, 30), *((done,) for done in range(1, 31))]}


def test_nothing_is_told_where_nobody_sees_it(tmp_path: Path) -> None:
    assert CliRunner().invoke(app, ["check", scene(tmp_path)]).stderr == ""


def test_an_occluder_of_a_scene_read_twice_is_placed_once_and_measured_once_a_look(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What it may cover is the same in all frames."""
    asked: list[Tree] = []
    extent = Tree.extent

    def counted(self: Tree, stage: SceneContext) -> Box:
        asked.append(self)
        return extent(self, stage)

    monkeypatch.setattr(Tree, "extent", counted)
    first = placed_occluders(irsim.loads(HIDDEN))
    assert 0 < len(asked) == len(set(asked))
    asked.clear()
    assert placed_occluders(irsim.loads(HIDDEN)) == first
    assert asked == []
    assert placed_occluders(irsim.loads(HIDDEN, overrides=["targets.a.path.speed=2.1"])) != first


def test_what_an_occluder_hides_is_found_in_each_frame_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever placed it knows. With something off it is found anew, and comes to the same: a tank hidden long."""
    slow = HIDDEN.replace("speed: 2", "speed: 0.5").replace("frames: 30", "frames: 90").replace("[12, 15]", "[40, 41]")
    slow = slow.replace("kind: point", "kind: tank")
    asked: list[int] = []
    occluded = TargetVisibility.occluded

    def counted(self: TargetVisibility, occluders: Sequence[Occluder], name: str, index: int) -> float:
        asked.append(index)
        return occluded(self, occluders, name, index)

    scenario = irsim.loads(slow)
    monkeypatch.setattr(TargetVisibility, "occluded", counted)
    told = list(placed_occluder_excessive(scenario))
    assert asked == []
    assert list(placed_occluder_excessive(scenario.model_copy(update={"without": ("agc",)}))) == told
    assert len(asked) >= 90
    assert [notice.at for notice in told] == [("occluders", 0, "frames")]


def test_targets_as_they_are_drawn_are_not_kept_of_all_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a million frames they would be some 15 GB."""
    monkeypatch.setattr("irsim.scenario.visibility._CACHED_FRAME_SPRITES", 8)
    watch = TargetVisibility(irsim.loads(SCENE))
    drawn = [ref(sprite.cover) for index in range(30) if (sprite := watch.sprite("a", index)) is not None]
    assert len(drawn) == 30
    assert 1 <= sum(cover() is not None for cover in drawn) <= 8


def test_a_check_of_many_frames_works_out_the_ways_of_targets_only_where_something_may_hide_them(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Of a million frames each of these takes seconds."""
    asked: list[str] = []
    ways = TargetTrajectory.of.__func__  # type: ignore[attr-defined]

    def counted(cls: type[TargetTrajectory], target: Target, *given: object) -> TargetTrajectory:
        asked.append(target.id)
        found: TargetTrajectory = ways(cls, target, *given)
        return found

    monkeypatch.setattr(TargetTrajectory, "of", classmethod(counted))
    assert warnings(scene(tmp_path)) == []
    assert asked == []


class Terminal(io.StringIO):
    """What takes itself for a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_bar_takes_a_name_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brackets mark up text elsewhere: this one would close what was never opened."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with progress_bar("check x[/b]/h.yaml", 3) as move:
        assert move is not None
        move(1)
    assert "check x[/b]/h.yaml" in shown.getvalue()


def test_long_work_tells_how_far_it_is_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seconds = iter([0.0, 4.0, 11.0, 14.0, 22.0])
    monkeypatch.setattr("irsim.cli.terminal.monotonic", lambda: next(seconds))
    with progress_bar("check long") as move:
        for done in range(1, 5):
            move(done, 5)
    assert capsys.readouterr().err == "check long: 2 of 5, 11 s\ncheck long: 4 of 5, 22 s\n"
