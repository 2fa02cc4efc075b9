"""irtrack falsify from end to end, beside a planted failure whose smallest case is known."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import planted_failure
import pytest
from command_line import Call

import irsim
from irtrack.falsify import Failure, Nearest, find_failure
from irtrack.falsify.falsification import UNSURE, Hunt
from irtrack.falsify.rules import rules_of
from irtrack.falsify.trial import Subject, Trials, examine
from irtrack.metrics import wilson


@pytest.fixture
def cli(bare_call: Call, tmp_path: Path) -> Call:
    """`irtrack falsify WORDS` in a folder that holds blind.yaml."""
    (tmp_path / "blind.yaml").write_text(planted_failure.SCENE)
    return lambda *words: bare_call("falsify", *words)


def hunt(
    folder: Path, seed: int = 1, tracker: str = "Blind", text: str = planted_failure.SCENE, **options: object
) -> Failure | Nearest:
    return find_failure(
        irsim.loads(text),
        f"planted_failure:{tracker}",
        folder,
        seed=seed,
        name="blind",
        **options,  # type: ignore[arg-type]  # options of any type
    )


def is_least(found: Failure | Nearest) -> bool:
    """Is it the planted minimum: severities within one, every other part off, no frame too many?"""
    assert isinstance(found, Failure)
    space = irsim.variations(irsim.loads(planted_failure.SCENE))
    lowest = space.at_severities([3, 4, 0])
    assert dict(lowest) == planted_failure.LOWEST
    steps = [abs(found.least.point[knob.key] - lowest[knob.key]) for knob in space.knobs]
    assert found.luck.is_structural
    assert found.repeats
    # never_lost needs ten frames off in a row; the start is given
    return (
        steps[0] <= 10
        and steps[1] <= 8
        and steps[2] == 0
        and "white" in found.least.without
        and found.least.frames == 11
    )


def test_the_planted_failure_holds_in_half_a_percent_of_the_space() -> None:
    """By counting on a grid, and the tracker loses where `inside` says so."""
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
def known(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Failure | Nearest]:
    """The folder of a hunt that ran to its end by one process, and what it found."""
    folder = tmp_path_factory.mktemp("known") / "out"
    return folder, hunt(folder)


def test_it_is_found_and_made_as_small_as_it_gets(known: tuple[Path, Failure | Nearest]) -> None:
    assert is_least(known[1])


@pytest.mark.slow
def test_it_is_found_in_nine_of_ten_searches(tmp_path: Path) -> None:
    """20 searches of at most 500 runs; all that are found are shrunk to within a severity of the minimum."""
    found = [hunt(tmp_path / str(seed), seed) for seed in range(20)]
    failures = [each for each in found if isinstance(each, Failure)]
    assert len(failures) >= 18
    assert all(map(is_least, failures))


def test_the_command_leaves_a_scene_its_frames_and_a_report(cli: Call, known: tuple[Path, Failure | Nearest]) -> None:
    """By two workers it finds what one process has found, and has tried the same."""
    status, out, _ = cli("blind.yaml", "--tracker", "planted_failure:Blind", "--jobs", "2", "-o", "out")
    assert status == 1
    assert "never_lost is broken" in out
    assert "structural: 20 of 20" in out
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
    assert "irtrack falsify blind.yaml --tracker planted_failure:Blind --jobs 2 -o out" in report
    assert "never_lost is broken here" in Path("out/minimal.yaml").read_text().splitlines()[0]
    assert "planted_failure:Blind" in Path("out/replay.html").read_text()


def test_what_was_tried_is_not_tried_again(known: tuple[Path, Failure | Nearest], tmp_path: Path) -> None:
    said: list[str] = []
    whole = (known[0] / "trials.jsonl").read_text()
    journal = tmp_path / "trials.jsonl"
    journal.write_text(whole[:-30])  # cut off in the middle of its last line
    assert hunt(tmp_path, say=said.append) == known[1]
    assert said[-1] == "1 new trial"
    assert journal.read_text() == whole


def test_ctrl_c_loses_nothing_that_was_found(
    cli: Call, known: tuple[Path, Failure | Nearest], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stopped in the midst of shrinking: what it had is there, and the same command ends as if never stopped."""
    shutil.copytree(known[0], "out", ignore=shutil.ignore_patterns("[!t]*"))
    words = ("blind.yaml", "--tracker", "planted_failure:Blind", "-o", "out")
    with monkeypatch.context() as patch:
        patch.setattr(Hunt, "_shrink", stop)
        status, _, err = cli(*words)
    assert status == 130
    assert err == "irtrack: stopped; what is known is in out, and the same command goes on from there\n"
    assert "the hunt was stopped" in Path("out/report.md").read_text()
    assert irsim.load("out/minimal.yaml").frames == 13
    assert cli(*words)[0] == 1
    assert irsim.load("out/minimal.yaml").frames == 11


def test_ctrl_c_before_the_first_trial_is_done_says_so(cli: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Trials, "verdicts", stop)
    status, _, err = cli("blind.yaml", "--tracker", "planted_failure:Blind", "-o", "out")
    assert (status, err) == (130, "irtrack: stopped before the first trial was done: nothing is known yet\n")
    assert not list(Path("out").iterdir())


def stop(*_: object) -> None:
    raise KeyboardInterrupt


def test_a_tracker_that_raises_is_a_failure_too(tmp_path: Path) -> None:
    near = planted_failure.SCENE.replace("low: 4, high: 54", "low: 32, high: 36")
    found = hunt(tmp_path, tracker="Raising", text=near)
    assert isinstance(found, Failure)
    assert (found.rule, found.least.frames) == ("raises", 10)
    assert "frame 9: ValueError: planted" in (tmp_path / "report.md").read_text()


def test_luck_is_told_from_structure(tmp_path: Path) -> None:
    found = hunt(tmp_path, tracker="Lucky", fresh=12)
    assert isinstance(found, Failure)
    assert found.luck.seeds == 12
    assert not found.luck.is_structural
    low, high = wilson(found.luck.broken, found.luck.seeds)
    assert low < 0.5 < high


def test_a_tracker_that_does_not_repeat_itself_is_told(tmp_path: Path) -> None:
    found = hunt(tmp_path, tracker="Unrepeatable")
    assert isinstance(found, Failure)
    assert not found.repeats
    assert "NOT the same again" in (tmp_path / "report.md").read_text()


def test_a_rule_that_nothing_puts_to_the_test_is_told(cli: Call) -> None:
    words = ("blind.yaml", "targets.point.path.start.0=4", "--tracker", "planted_failure:Blind", "--budget", "2")
    rules = "expect=[{kind: reacquired_within, frames: 3}, {kind: error_below, px: 900}]"
    status, out, _ = cli(*words, rules)
    assert status == 0
    assert "no run puts reacquired_within (frames 3) to the test" in out
    assert "no run puts error_below" not in out
    assert json.loads(cli(*words, rules, "--json")[1])["untried"] == ["reacquired_within (frames 3)"]


def test_a_tracker_that_breaks_nothing_and_does_not_repeat_itself_is_warned_of(tmp_path: Path) -> None:
    said: list[str] = []
    easy = planted_failure.SCENE + "expect: [{kind: error_below, px: 1000}]\n"
    for tracker in ("Unrepeatable", "Offset"):
        assert isinstance(hunt(tmp_path / tracker, tracker=tracker, text=easy, budget=1, say=said.append), Nearest)
    assert said == [UNSURE]


def test_where_nothing_breaks_the_nearest_is_told(cli: Call) -> None:
    words = ("blind.yaml", "targets.point.path.start.0=4", "--tracker", "planted_failure:Blind", "--budget", "20")
    status, out, _ = cli(*words)
    assert status == 0
    assert "breaks nothing in 20 runs; the least margin is 0." in out
    assert "targets.point.path.start.1=" in out
    assert max(len(line.partition("=")[2].lstrip("0.").replace(".", "")) for line in out.splitlines()) <= 6
    assert "breaks nothing in 1 run;" in cli(*words[:-1], "1")[1]
    found = json.loads(cli(*words, "--json")[1])
    assert found["failure"] is None
    assert found["runs"] == 20
    folder = Path("falsified/blind-planted_failure-Blind")
    (folder / "report.md").write_text("of an earlier search")
    (folder / "mine.txt").write_text("nobody else's")
    assert cli(*words)[0] == 0
    assert {path.name for path in folder.iterdir()} == {"trials.jsonl", "mine.txt"}


def test_what_other_code_has_judged_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = irsim.loads(planted_failure.SCENE)
    subject = Subject("blind", planted_failure.Blind(), "display", rules_of(scene))

    def new_trials() -> int:
        trials = Trials(subject, tmp_path / "trials.jsonl")
        list(trials.verdicts([scene]))
        return trials.run

    assert [new_trials(), new_trials()] == [1, 0]
    monkeypatch.setattr(Path, "read_bytes", lambda path: Path.open(path, "rb").read() + edit(path))
    assert [new_trials(), new_trials()] == [1, 0]


def edit(path: Path) -> bytes:
    """One more comment in the rules, which the tracker does not import."""
    return b"# edited" if path.parts[-2:] == ("falsify", "rules.py") else b""
