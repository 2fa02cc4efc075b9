"""Trackers that end their process or hang: blamed by name and frame, found by falsification, and kept."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import planted_failure
import pytest
from command_line import Call

import irsim
from irtrack.cli.options import FRAME_LIMIT_S
from irtrack.falsify import Failure, Regressions, check_kept, find_failure, kept_failures
from irtrack.falsify.rules import ENDS, RAISES, rules_of
from irtrack.falsify.trial import Subject, Trials, examine, frame_limit
from irtrack.report.finding import write_failure_report
from irtrack.runner.pool import Pool
from irtrack.runner.watchdog import Heartbeat

SCENE = "".join(
    line
    for line in planted_failure.SCENE.replace("start: [4, 4]", "start: [4, 36]").splitlines(keepends=True)
    if not line.startswith(("  targets.point.path.start.1", "  targets.point.shape.area_m2"))
)
"""One range of the planted failure, of which a twentieth fails; severity 3 is the lowest that does."""

LIMIT_S = 30.0
"""Only a tracker that sleeps takes so long."""


@pytest.fixture
def cli(bare_call: Call, tmp_path: Path) -> Call:
    """`irtrack WORDS` in a folder that holds blind.yaml."""
    (tmp_path / "blind.yaml").write_text(SCENE)
    return bare_call


def find(folder: Path, **options: object) -> Failure:
    """The failure of a tracker that ends its process at frame 9."""
    found = find_failure(
        irsim.loads(SCENE),
        "planted_failure:Exiting",
        folder,
        name="blind",
        fresh=5,
        report=write_failure_report,
        **{"frame_limit_s": LIMIT_S, **options},  # type: ignore[arg-type]  # options of any type
    )
    assert isinstance(found, Failure)
    return found


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Failure]:
    """A search by one worker, and its failure; kept beside it."""
    folder = tmp_path_factory.mktemp("deaths") / "out"
    return folder, find(folder, keep_in=folder.parent / "kept")


@pytest.mark.slow
def test_a_scene_that_kills_a_tracker_is_found_and_shrunk(known: tuple[Path, Failure]) -> None:
    """Ten frames, the lowest severity that fails, and no noise."""
    folder, found = known
    point = {"targets.point.path.start.0": planted_failure.LOWEST["targets.point.path.start.0"]}
    assert (found.rule, dict(found.least.point), found.least.without) == (ENDS, point, ("white",))
    assert (found.least.frames, found.repeats, found.sensitivity.is_structural) == (10, True, True)
    died = "frame 9: the process died 2 times while the tracker was at work (exit status 7)"
    report = (folder / "report.md").read_text()
    assert f"planted_failure:Exiting: {died}" in report
    assert "its process dies, or it hangs" in report
    assert died in (folder / "replay.html").read_text()
    scene, recording = irsim.load(folder / "minimal.yaml"), irsim.open_recording(folder / "minimal.mcap")
    frames = irsim.Rendering(scene).frames()
    assert all((a.image == b.image).all() for a, b in zip(frames, recording.frames(), strict=True))


@pytest.mark.slow
def test_a_stopped_search_resumes(known: tuple[Path, Failure], tmp_path: Path) -> None:
    whole = (known[0] / "trials.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "trials.jsonl").write_text("".join(whole[:-3]))
    said: list[str] = []
    assert find(tmp_path, say=said.append) == known[1]
    assert said[-1] == "3 new trials"
    assert (tmp_path / "trials.jsonl").read_text() == "".join(whole)


def broken_scene() -> irsim.Scenario:
    return irsim.change(irsim.loads(SCENE), {"targets.point.path.start": [34, 36]})


def subject(tracker: object) -> Subject:
    return Subject("planted", tracker, "display", rules_of(irsim.loads(SCENE)))


@pytest.fixture(scope="module")
def pool() -> Iterator[Pool]:
    with Pool(1) as found:
        yield found


def test_a_hanging_tracker_is_ended_and_others_go_on(pool: Pool, tmp_path: Path) -> None:
    """Another time limit repeats its trial alone."""
    hanging, scenes = subject(planted_failure.Hanging()), [irsim.loads(SCENE), broken_scene()]

    def new_trials(limit_s: float) -> int:
        trials = Trials(hanging, tmp_path / "trials.jsonl", pool, limit_s)
        fine, hung = trials.verdicts(scenes)
        assert (fine.broken, hung.broken) == (None, ENDS)
        assert hung.raised == f"planted_failure:Hanging: frame 9: hangs: more than {limit_s:g} s in the tracker"
        return trials.run

    assert [new_trials(each) for each in (2.0, 2.0, 1.5)] == [2, 0, 1]


def draw(_: Heartbeat) -> float:
    """From numpy's global state, which other people's trackers may use."""
    return float(np.random.rand())  # noqa: NPY002 - the global state is the test


def test_workers_share_no_global_random_state() -> None:
    found = set()
    for _ in range(2):
        with Pool(1) as one:
            found.add(one.call(draw))
    assert len(found) == 2


def test_an_exception_in_a_worker_is_reported_as_here(pool: Pool) -> None:
    raising, source = subject(planted_failure.Raising()), irsim.Rendering(broken_scene())
    there = examine(raising, source, 1, pool, frame_limit(LIMIT_S))
    assert there[0].broken == RAISES
    assert there == examine(raising, source, 1)


def test_kept_failures_run_in_workers_and_changes_are_reported(known: tuple[Path, Failure], cli: Call) -> None:
    (kept,) = kept_failures(known[0].parent / "kept")
    assert (kept.how, kept.limit_s) == (ENDS, LIMIT_S)
    assert check_kept([kept], jobs=2) == Regressions()
    Path("kept").mkdir()
    trackers = {"dying": ("Crashing", False), "mended": ("Offset", True), "other": ("Raising", True)}
    for name, (tracker, broken) in trackers.items():
        for path in (kept.path, kept.recording):
            shutil.copy(path, Path("kept", name).with_suffix(path.suffix))
        note = {"label": name, "tracker": f"planted_failure:{tracker}", "parameters": {}, "input": "display"}
        Path("kept", f"{name}.json").write_text(json.dumps({**note, "broken": broken}))
    status, out, _ = cli("regress", "kept")
    assert status == 1
    assert "kept/dying.yaml: dying breaks never_lost again, planted_failure:Crashing: frame 9: the process died" in out
    assert "kept/mended.yaml: mended no longer breaks never_lost" in out
    assert out.endswith("kept: failed: 3 failures, 2 changes\n")
    assert cli("regress", "kept", "--update")[0] == 0
    assert {each.label: (each.how, each.limit_s) for each in kept_failures("kept")} == {
        "dying": (ENDS, FRAME_LIMIT_S),
        "mended": (None, FRAME_LIMIT_S),
        "other": (RAISES, FRAME_LIMIT_S),
    }
