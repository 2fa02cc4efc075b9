"""Trackers that end their process or hang on some scenes: found, made small and kept as those that raise are."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import planted_failure
import pytest
from bench_fakes import Closer, Killer, LateMute, Strip, Walker
from command_line import Call

import irsim
from irtrack.cli.options import FRAME_LIMIT_S
from irtrack.errors import InputError, IrtrackError
from irtrack.falsify import Failure, Regressions, check_kept, find_failure, kept_failures
from irtrack.falsify.rules import ENDS, RAISES, rules_of
from irtrack.falsify.trial import Subject, Trials, examine, frame_limit
from irtrack.replay.replay import BLOCK_FRAMES
from irtrack.report.finding import write_failure_report
from irtrack.runner.pool import Pool
from irtrack.runner.watchdog import Heartbeat

SCENE = "".join(
    line
    for line in planted_failure.SCENE.replace("start: [4, 4]", "start: [4, 36]").splitlines(keepends=True)
    if not line.startswith(("  targets.point.path.start.1", "  targets.point.shape.area_m2"))
)
"""Of the planted failure's ranges the one in which a twentieth fails; severity 3 is the lowest that does."""

LIMIT_S = 30.0
"""So long that nothing but what sleeps for minutes takes it."""


@pytest.fixture
def cli(bare_call: Call, tmp_path: Path) -> Call:
    """`irtrack WORDS` in a folder that holds blind.yaml."""
    (tmp_path / "blind.yaml").write_text(SCENE)
    return bare_call


def found_of(tracker: str, folder: Path, **options: object) -> Failure:
    found = find_failure(
        irsim.loads(SCENE),
        f"planted_failure:{tracker}",
        folder,
        name="blind",
        fresh=5,
        report=write_failure_report,
        **{"frame_limit_s": LIMIT_S, **options},  # type: ignore[arg-type]  # options of any type
    )
    assert isinstance(found, Failure)
    return found


def is_least(found: Failure) -> bool:
    """Frame 9 is where it ends: ten frames, the lowest severity that fails, and no noise."""
    point = {"targets.point.path.start.0": planted_failure.LOWEST["targets.point.path.start.0"]}
    return (found.rule, dict(found.least.point), found.least.without, found.least.frames) == (
        ENDS,
        point,
        ("white",),
        10,
    )


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Failure]:
    """A hunt by one worker for where a tracker ends its process, kept beside it."""
    folder = tmp_path_factory.mktemp("deaths") / "out"
    return folder, found_of("Exiting", folder, keep_in=folder.parent / "kept")


def test_a_scene_that_kills_a_tracker_is_found_and_shrunk(known: tuple[Path, Failure]) -> None:
    folder, found = known
    assert is_least(found)
    assert found.repeats
    assert found.sensitivity.is_structural
    died = "frame 9: the process died 2 times while the tracker was at work (exit status 7)"
    report = (folder / "report.md").read_text()
    assert f"planted_failure:Exiting: {died}" in report
    assert "its process dies, or it hangs" in report
    assert died in (folder / "replay.html").read_text()
    scene, recording = irsim.load(folder / "minimal.yaml"), irsim.open_recording(folder / "minimal.mcap")
    drawn = irsim.Rendering(scene).frames()
    assert all((a.image == b.image).all() for a, b in zip(drawn, recording.frames(), strict=True))


def test_the_command_finds_a_crash_by_two_workers(cli: Call, known: tuple[Path, Failure]) -> None:
    """The same scenes are tried with the same outcome as by one worker, but for how the process ends."""
    words = ("--tracker", "planted_failure:Crashing", "--fresh", "5", "--jobs", "2", "--keep", "-o", "out")
    status, out, err = cli("falsify", "blind.yaml", *words)
    assert (status, err) == (1, "")
    assert "frame 9: the process died 2 times while the tracker was at work (SIGSEGV)" in out
    assert irsim.load("out/minimal.yaml") == irsim.load(known[0] / "minimal.yaml")
    rows = [journal(folder, ending) for folder, ending in ((Path("out"), "(SIGSEGV)"), (known[0], "(exit status 7)"))]
    assert rows[0] == rows[1]
    assert cli("regress", "scenarios/regressions")[:2] == (0, "scenarios/regressions: ok: 1 failure, 0 changes\n")


def journal(folder: Path, ending: str) -> list[tuple[list[float], bool]]:
    """Of each trial the margins, and whether the process ended so."""
    rows = map(json.loads, (folder / "trials.jsonl").read_text().splitlines())
    return [(row["margins"], str(row["raised"]).endswith(ending)) for row in rows]


def test_a_hunt_that_was_stopped_goes_on(known: tuple[Path, Failure], tmp_path: Path) -> None:
    whole = (known[0] / "trials.jsonl").read_text().splitlines(keepends=True)
    (tmp_path / "trials.jsonl").write_text("".join(whole[:-9]))
    said: list[str] = []
    assert found_of("Exiting", tmp_path, say=said.append) == known[1]
    assert said[-1] == "9 new trials"
    assert (tmp_path / "trials.jsonl").read_text() == "".join(whole)


@pytest.mark.slow
def test_a_scene_that_hangs_a_tracker_is_found_and_shrunk(tmp_path: Path) -> None:
    assert is_least(found_of("Hanging", tmp_path, frame_limit_s=3.0, jobs=2))
    assert "frame 9: hangs: more than 3 s in the tracker" in (tmp_path / "report.md").read_text()


# -- one trial


def broken_scene() -> irsim.Scenario:
    return irsim.change(irsim.loads(SCENE), {"targets.point.path.start": [34, 36]})


def subject(tracker: object) -> Subject:
    return Subject("planted", tracker, "display", rules_of(irsim.loads(SCENE)))  # type: ignore[arg-type]  # a planted one, no tracker to mypy


@pytest.fixture
def pool() -> Iterator[Pool]:
    with Pool(1) as found:
        yield found


def test_a_tracker_that_hangs_is_ended_there_and_others_go_on(pool: Pool, tmp_path: Path) -> None:
    """Another time limit tries it again, and what went well not."""
    hanging, scenes = subject(planted_failure.Hanging()), [irsim.loads(SCENE), broken_scene()]

    def new_trials(limit_s: float) -> int:
        trials = Trials(hanging, tmp_path / "trials.jsonl", pool, limit_s)
        fine, hung = trials.verdicts(scenes)
        assert fine.broken is None
        assert hung.broken == ENDS
        assert hung.raised == f"planted_failure:Hanging: frame 9: hangs: more than {limit_s:g} s in the tracker"
        return trials.run

    assert [new_trials(each) for each in (3.0, 3.0, 2.0)] == [2, 0, 1]


def test_a_worker_killed_by_chance_breaks_nothing(pool: Pool, tmp_path: Path) -> None:
    chance = Killer(at=7, once=str(tmp_path / "killed"))
    verdict, _ = examine(subject(chance), irsim.Rendering(broken_scene()), 1, pool, frame_limit(LIMIT_S))
    assert (tmp_path / "killed").exists()
    assert verdict.raised is None


def test_a_tracker_that_breaks_its_process_breaks_the_scene(
    pool: Pool,
) -> None:
    verdict, _ = examine(subject(Closer()), Strip(), 1, pool, frame_limit(LIMIT_S))
    assert verdict.broken == ENDS
    assert verdict.raised == (
        "bench_fakes:Closer: frame 19: the process died 2 times after the tracker had been at work (exit status 1)"
    )


def test_a_source_that_kills_late_is_not_blamed_on_a_tracker(pool: Pool) -> None:
    late = LateMute(visible=(1.0,) * (BLOCK_FRAMES + 1))
    with pytest.raises(IrtrackError, match="died again and again while no tracker was at work"):
        examine(subject(Walker()), late, 1, pool, frame_limit(LIMIT_S))


def drawn(_: Heartbeat) -> float:
    """From a state that this project never draws from, but other people's trackers may."""
    return float(np.random.rand())  # noqa: NPY002 - the global state is the test


def test_workers_share_no_global_state() -> None:
    """Each begins with a seed of its own, though they are copies of one process."""
    found = set()
    for _ in range(3):
        with Pool(1) as one:
            found.add(one.call(drawn))
    assert len(found) == 3


def test_what_is_raised_apart_is_told_as_here(pool: Pool) -> None:
    raising, source = subject(planted_failure.Raising()), irsim.Rendering(broken_scene())
    there = examine(raising, source, 1, pool, frame_limit(LIMIT_S))
    assert there[0].broken == RAISES
    assert there == examine(raising, source, 1)


def test_a_tracker_that_cannot_be_sent_runs_here_alone(tmp_path: Path) -> None:
    class Local(planted_failure.Blind):
        pass

    for options in ({"jobs": 2}, {"frame_limit_s": LIMIT_S}):
        with pytest.raises(InputError, match=r"the tracker cannot be sent to a worker process: .*Local"):
            find_failure(irsim.loads(SCENE), Local(), tmp_path, budget=2, **options)
    found = find_failure(irsim.loads(SCENE), Local(), tmp_path, fresh=5)
    assert isinstance(found, Failure)


def test_a_time_limit_is_above_0(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="time limit 0 s: allowed: above 0"):
        find_failure(irsim.loads(SCENE), "kalman", tmp_path, frame_limit_s=0)


# -- what is kept


def test_a_kept_death_is_tried_apart(known: tuple[Path, Failure], cli: Call) -> None:
    """In a test too, where nobody says so: its note does."""
    shutil.copytree(known[0].parent / "kept", "kept")
    (kept,) = kept_failures("kept")
    assert (kept.how, kept.limit_s) == (ENDS, LIMIT_S)
    assert not kept.changes()
    assert check_kept([kept], jobs=2) == Regressions()
    with pytest.raises(InputError, match=r"^jobs '2': allowed: a whole number, 1 or more$"):
        check_kept([kept], jobs="2")  # type: ignore[arg-type]  # what is wrong is the test


def test_a_death_that_is_mended_or_new_is_told_and_others_go_on(known: tuple[Path, Failure], cli: Call) -> None:
    (kept,) = kept_failures(known[0].parent / "kept")
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
    assert cli("regress", "kept")[0] == 0
