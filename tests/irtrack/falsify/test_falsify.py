"""irtrack falsify end to end, against a planted failure with a known minimum."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import planted_failure
import pytest
from command_line import Call

import irsim
from irtrack.falsify import Failure, NoFailure, find_failure
from irtrack.falsify.falsification import Falsification
from irtrack.falsify.rules import rules_of
from irtrack.falsify.trial import Subject, examine
from irtrack.metrics import wilson
from irtrack.report.finding import write_failure_report


@pytest.fixture
def cli(bare_call: Call, tmp_path: Path) -> Call:
    """`irtrack falsify WORDS` in a folder that holds blind.yaml."""
    (tmp_path / "blind.yaml").write_text(planted_failure.SCENE)
    return lambda *words: bare_call("falsify", *words)


NEAR = planted_failure.SCENE.replace("low: 4, high: 54", "low: 32, high: 36")
"""Half of its space breaks the tracker."""


SAME = ("--seed", "22", "--fresh", "5")
"""Options of the search `known`; its eighth run fails."""


def hunt(
    folder: Path, seed: int = 22, tracker: str = "Blind", text: str = planted_failure.SCENE, **options: object
) -> Failure | NoFailure:
    return find_failure(
        irsim.loads(text),
        f"planted_failure:{tracker}",
        folder,
        seed=seed,
        name="blind",
        report=write_failure_report,
        **options,  # type: ignore[arg-type]  # options of any type
    )


def is_least(found: Failure | NoFailure) -> bool:
    """Return whether it is the planted minimum: severities within one, other parts off, no surplus frames."""
    assert isinstance(found, Failure)
    space = irsim.variations(irsim.loads(planted_failure.SCENE))
    lowest = space.at_severities([3, 4, 0])
    assert dict(lowest) == planted_failure.LOWEST
    steps = [abs(found.least.point[knob.key] - lowest[knob.key]) for knob in space.knobs]
    assert found.sensitivity.is_structural
    assert found.repeats
    # never_lost needs ten frames off in a row; the start is given
    return (
        steps[0] <= 10
        and steps[1] <= 8
        and steps[2] == 0
        and "white" in found.least.without
        and found.least.frames == 11
    )


def test_planted_failure_fills_half_a_percent_of_the_space() -> None:
    """By a grid; the tracker loses the target where `inside` is above 0."""
    grid = np.stack(np.meshgrid(*2 * [(np.arange(100) + 0.5) / 100]), axis=-1).reshape(-1, 2)
    share = np.mean([planted_failure.inside((x, y)) > 0 for x, y in planted_failure.LOW + grid * planted_failure.WIDTH])
    assert share == pytest.approx(0.005, abs=2e-4)
    scene = irsim.loads(planted_failure.SCENE)
    subject = Subject("blind", planted_failure.Blind(), "display", rules_of(scene))
    for start in ([33.1, 34.5], [35.4, 37.5], [33.1, 33.5], [32.8, 36.0], [4.0, 4.0]):
        at = irsim.change(scene, {"targets.point.path.start": start})
        verdict, _ = examine(subject, irsim.Rendering(at), 1)
        assert (verdict.margin < 0) == (planted_failure.inside((start[0], start[1])) > 0)


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Failure | NoFailure]:
    """Folder and result of a complete search in one process."""
    folder = tmp_path_factory.mktemp("known") / "out"
    return folder, hunt(folder, fresh=5)


def test_planted_failure_is_found_and_shrunk(known: tuple[Path, Failure | NoFailure]) -> None:
    assert is_least(known[1])


def test_command_writes_scene_frames_and_report(cli: Call, known: tuple[Path, Failure | NoFailure]) -> None:
    """Two workers have the same trials and the same result as one process."""
    status, out, _ = cli("blind.yaml", "--tracker", "planted_failure:Blind", *SAME, "--jobs", "2", "-o", "out")
    assert status == 1
    assert "never_lost is broken" in out
    assert "structural: 5 of 5" in out
    assert "failure: out/report.md" in out
    assert Path("out/trials.jsonl").read_text() == (known[0] / "trials.jsonl").read_text()
    scene, recording = irsim.load("out/minimal.yaml"), irsim.open_recording(Path("out/minimal.mcap"))
    assert scene == irsim.load(known[0] / "minimal.yaml")
    assert not scene.vary
    assert [rule.kind for rule in scene.expect] == ["never_lost"]
    drawn = list(irsim.Rendering(scene).frames())
    assert len(drawn) == len(recording) == 11
    assert all((a.image == b.image).all() for a, b in zip(drawn, recording.frames(), strict=True))
    report = Path("out/report.md").read_text()
    assert "| `targets.point.path.start.0` | 4 | 3" in report
    assert "irtrack run planted_failure:Blind out/minimal.yaml --seed 1" in report
    assert "irtrack falsify blind.yaml --tracker planted_failure:Blind --seed 22 --fresh 5 --jobs 2 -o out" in report
    assert "never_lost is broken, found in blind" in Path("out/minimal.yaml").read_text().splitlines()[0]
    assert "planted_failure:Blind" in Path("out/replay.html").read_text()


def test_search_resumes_from_the_journal(known: tuple[Path, Failure | NoFailure], tmp_path: Path) -> None:
    said: list[str] = []
    whole = (known[0] / "trials.jsonl").read_text()
    journal = tmp_path / "trials.jsonl"
    journal.write_text(whole[:-30])  # an incomplete last line
    assert hunt(tmp_path, fresh=5, say=said.append) == known[1]
    assert said[-1] == "1 new trial"
    assert journal.read_text() == whole


def test_ctrl_c_keeps_the_failure(
    cli: Call, known: tuple[Path, Failure | NoFailure], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interrupted while shrinking: the failure is written, and the same command completes the search."""
    shutil.copytree(known[0], "out", ignore=shutil.ignore_patterns("[!t]*"))
    words = ("blind.yaml", "--tracker", "planted_failure:Blind", *SAME, "-o", "out")
    with monkeypatch.context() as patch:
        patch.setattr(Falsification, "_shrink", stop)
        status, _, err = cli(*words)
    assert status == 130
    assert err == "irtrack: stopped; all results so far are in out, and the same command resumes there\n"
    assert "the search was interrupted" in Path("out/report.md").read_text()
    assert irsim.load("out/minimal.yaml").frames == 13
    assert cli(*words)[0] == 1
    assert irsim.load("out/minimal.yaml").frames == 11


def stop(*_: object) -> None:
    raise KeyboardInterrupt


def test_exception_is_a_failure(tmp_path: Path) -> None:
    found = hunt(tmp_path, tracker="Raising", text=NEAR, fresh=5)
    assert isinstance(found, Failure)
    assert (found.rule, found.least.frames) == ("raises", 10)
    assert "frame 9: ValueError: planted" in (tmp_path / "report.md").read_text()


def test_seed_dependent_failure(tmp_path: Path) -> None:
    found = hunt(tmp_path, seed=1, tracker="Lucky", fresh=12)
    assert isinstance(found, Failure)
    assert found.sensitivity.seeds == 12
    assert not found.sensitivity.is_structural
    low, high = wilson(found.sensitivity.broken, found.sensitivity.seeds)
    assert low < 0.5 < high


def test_nondeterministic_tracker_is_reported(tmp_path: Path) -> None:
    found = hunt(tmp_path, tracker="Unrepeatable", text=NEAR, fresh=5)
    assert isinstance(found, Failure)
    assert not found.repeats
    assert "NOT repeated" in (tmp_path / "report.md").read_text()


def test_without_failure_the_least_margin_is_printed(cli: Call) -> None:
    words = ("blind.yaml", "targets.point.path.start.0=4", "--tracker", "planted_failure:Blind", "--budget", "3")
    status, out, _ = cli(*words)
    assert status == 0
    assert "breaks no rule in 3 runs; the least margin is 0." in out
    assert "targets.point.path.start.1=" in out
    assert max(len(line.partition("=")[2].lstrip("0.").replace(".", "")) for line in out.splitlines()) <= 6
    found = json.loads(cli(*words, "--json")[1])
    assert found["failure"] is None
    assert found["runs"] == 3
    folder = Path("falsified/blind-planted_failure-Blind")
    (folder / "report.md").write_text("of an earlier search")
    (folder / "mine.txt").write_text("mine")
    assert cli(*words)[0] == 0
    assert {path.name for path in folder.iterdir()} == {"trials.jsonl", "mine.txt"}
