"""The bench: keyed and resumed cells, any number of workers, failures kept apart, the results file, the table."""

from __future__ import annotations

import math
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Breaker, Logger, Strip, Vandal, Walker

import irsim
import irtrack
from irsim.types import Box
from irtrack.bench import ALL_SOURCES, Cell, Entry, Key, Results, Trace, parse_tracker_spec, parse_trackers, run_bench
from irtrack.bench import summary as summarise
from irtrack.bench.results import SCHEMA_VERSION
from irtrack.errors import InputError
from irtrack.metrics import Score, wilson
from irtrack.types import Tracker

SCENE = """
frames: 6
camera: {size: [48, 32]}
background: {kind: sky}
targets:
  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [20, 16], range_m: 1500}}
"""


def scenario() -> irsim.Scenario:
    return irsim.loads(SCENE)


def rows(results: Results) -> dict[Any, Any]:
    """Everything that the results say, times aside."""
    found = {}
    for cell in results.cells(every=True):
        trace = results.trace(cell.key)
        arrays = trace and [getattr(trace, field.name).tobytes() for field in fields(Trace) if field.name != "step_ms"]
        figures = cell.score and replace(cell.score, ms_mean=None, ms_median=None)
        found[cell.key, cell.label] = (cell.source, cell.scene_hash, cell.status, cell.failure, figures, arrays)
    return found


def steps(log: Path) -> Counter[int]:
    """How often each frame was stepped."""
    return Counter(int(line.split()[1]) for line in log.read_text().splitlines()) if log.exists() else Counter()


# -- keys and resuming


def test_a_second_bench_runs_nothing(tmp_path: Path) -> None:
    log, path = tmp_path / "log", tmp_path / "r.db"
    trackers = [Entry("a", Logger(log=str(log))), Entry("b", Walker(speed=2.0))]
    with run_bench([Strip()], trackers, seeds=3, results=path) as first:
        before = rows(first)
    assert len(before) == 6
    assert steps(log) == dict.fromkeys(range(1, 20), 3)
    with run_bench([Strip()], trackers, seeds=3, results=path) as second:
        assert rows(second) == before
        assert len(second.runs()) == 2
    assert steps(log) == dict.fromkeys(range(1, 20), 3)
    with run_bench([Strip()], trackers, seeds=4, results=path) as third:  # one more seed runs alone
        assert len(rows(third)) == 8
    assert steps(log) == dict.fromkeys(range(1, 20), 4)


@pytest.mark.parametrize(
    "change",
    [
        {"sources": [Strip(hash="other")]},
        {"input": "counts"},
        {"seeds": [9]},
        {"trackers": [Entry("w", Walker(speed=1.5))]},
        {"init": (Box(10.0, 20.0, 5.0, 5.0), 0)},
    ],
)
def test_whatever_decides_the_outcome_makes_another_cell(tmp_path: Path, change: dict[str, Any]) -> None:
    plain: dict[str, Any] = {"sources": [Strip()], "trackers": [Entry("w", Walker())], "seeds": 1}
    run_bench(**plain, results=tmp_path / "r.db").close()
    with run_bench(**plain | change, results=tmp_path / "r.db") as results:
        assert len(results.cells(every=True)) == 2


def test_changed_code_makes_another_cell_and_the_newest_is_shown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = tmp_path / "changing.py"
    text = "from bench_fakes import Walker\nclass Mine(Walker):\n    pass\n"
    module.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "r.db"
    run_bench([Strip()], ["changing:Mine"], results=path).close()
    module.write_text(text + "# mended\n")
    run_bench([Strip()], ["changing:Mine"], results=path).close()
    with Results(path) as results:
        old, new = sorted(results.cells(every=True), key=lambda cell: cell != results.cells()[0])[::-1]
        assert len(results.cells()) == 1
        assert old.key != new.key
        assert replace(old.key, code_hash="") == replace(new.key, code_hash="")
    module.write_text(text)  # back again: known, and now the one that was wanted last
    with run_bench([Strip()], ["changing:Mine"], results=path) as results:
        assert [cell.key for cell in results.cells()] == [old.key]


def test_two_labels_may_stand_for_one_cell(tmp_path: Path) -> None:
    log = tmp_path / "log"
    tracker = Logger(log=str(log))
    with run_bench([Strip()], [Entry("a", tracker), Entry("b", tracker)], results=tmp_path / "r.db") as results:
        a, b = results.cells()
        assert (a.label, b.label) == ("a", "b")
        assert a.key == b.key
    assert steps(log) == dict.fromkeys(range(1, 20), 1)


# -- seeds


def test_seeds_are_paired_over_trackers(tmp_path: Path) -> None:
    with run_bench([scenario()], ["kalman", "template"], seeds=3, results=tmp_path / "r.db") as results:
        cells, sources = results.cells(), results.sources()
    by_label = {label: [cell for cell in cells if cell.label == label] for label in ("kalman", "template")}
    for label in by_label:
        assert [(cell.key.scene_seed, cell.key.tracker_seed) for cell in by_label[label]] == [(0, 0), (1, 1), (2, 2)]
    scenes = [[cell.key.source_hash for cell in members] for members in by_label.values()]
    assert scenes[0] == scenes[1]
    assert len(set(scenes[0])) == 3
    assert len({cell.scene_hash for cell in cells}) == 1
    for cell in cells:  # the source's row gives the very scene back
        kept = irsim.loads(sources[cell.key.source_hash].text)
        assert kept.hash == cell.key.source_hash
        assert kept.seed == cell.key.scene_seed


def test_a_cell_equals_a_run_with_its_seeds(tmp_path: Path) -> None:
    with run_bench([scenario()], ["g=grey_pf:particles=40"], seeds=[4], results=tmp_path / "r.db") as results:
        (cell,) = results.cells()
        trace = results.trace(cell.key)
    assert trace is not None
    tracker = irtrack.make("grey_pf", cell.config["parameters"])
    track = irtrack.run(tracker, scenario().model_copy(update={"seed": 4}), seed=4)
    assert np.array_equal(track.centers, trace.centers)
    assert track.config == cell.config
    assert trace.statuses.tolist() == list(track.statuses)


def test_a_recording_repeats_tracker_seeds(tmp_path: Path) -> None:
    with run_bench([Strip()], [Entry("w", Walker(jitter=1.0))], seeds=2, results=tmp_path / "r.db") as results:
        cells = results.cells()
        traces = [results.trace(cell.key) for cell in cells]
        (source,) = results.sources().values()
    assert [(cell.key.scene_seed, cell.key.tracker_seed) for cell in cells] == [(None, 0), (None, 1)]
    assert not np.array_equal(traces[0].centers, traces[1].centers)  # type: ignore[union-attr]
    assert (source.kind, source.length, source.size, source.rate_hz) == ("recording", 20, (64, 48), 10.0)


# -- workers


def test_one_and_two_workers_give_the_same_rows(tmp_path: Path) -> None:
    log = tmp_path / "log"
    foreign = [Entry("logger", Logger(log=str(log))), Entry("breaker", Breaker(at=3))]
    trackers: list[str | Tracker | Entry] = ["grey_pf", *foreign]
    counts: list[tuple[int, int]] = []
    sources = [scenario(), Strip()]

    def progress(done: int, total: int) -> None:
        counts.append((done, total))

    with run_bench(sources, trackers, seeds=2, jobs=2, results=tmp_path / "2.db", progress=progress) as two:
        found = rows(two)
    pids = {line.split()[0] for line in log.read_text().splitlines()}
    assert str(os.getpid()) not in pids
    assert counts[-1] == (12, 12)
    with run_bench(sources, trackers, seeds=2, jobs=1, results=tmp_path / "1.db") as one:
        assert rows(one) == found
    assert len(found) == 12


KILLED = """
import sys
from bench_fakes import Logger, Strip
from irtrack.bench import Entry, run_bench
if __name__ == "__main__":
    log, path, jobs = sys.argv[1:]
    tracker = Entry("slow", Logger(jitter=1.0, log=log, seconds=0.005))
    run_bench([Strip()], [tracker], seeds=8, jobs=int(jobs), results=path)
"""


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_bench_goes_on_where_it_stopped(tmp_path: Path, jobs: int) -> None:
    log, path, script = tmp_path / "log", tmp_path / "r.db", tmp_path / "killed.py"
    script.write_text(KILLED)
    here = str(Path(__file__).parent)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([here, str(Path(here).parent)])}
    process = subprocess.Popen([sys.executable, script, log, path, str(jobs)], env=environment)
    try:
        wait_for(lambda: count_cells(path) >= 2)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    workers = {int(line.split()[0]) for line in log.read_text().splitlines()} - {process.pid}
    assert len(workers) == (2 if jobs == 2 else 0)
    wait_for(lambda: not any(is_alive(pid) for pid in workers))  # no worker waits on for work
    with Results(path) as left:
        done = rows(left)
    assert 2 <= len(done) < 8
    before = steps(log)[19]
    tracker = Entry("slow", Logger(jitter=1.0, log=str(log), seconds=0.005))
    with run_bench([Strip()], [tracker], seeds=8, results=path) as resumed:
        found = rows(resumed)
    assert steps(log)[19] - before == 8 - len(done)  # what was there is not run again
    assert found.items() >= done.items()
    with run_bench([Strip()], [tracker], seeds=8, results=tmp_path / "whole.db") as whole:
        assert rows(whole) == found


def wait_for(condition: Any, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def count_cells(path: Path) -> int:
    try:
        with Results(path) as results:
            return len(results.cells())
    except InputError:
        return 0  # not there yet, or just being written


def is_alive(pid: int) -> bool:
    """Runs, and is no zombie that nobody has reaped."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# -- failures


def test_a_failing_tracker_fails_alone_and_is_tried_again(tmp_path: Path) -> None:
    log = tmp_path / "log"
    trackers = [Entry("breaker", Breaker()), Entry("vandal", Vandal()), Entry("fine", Logger(log=str(log)))]
    with run_bench([Strip()], trackers, results=tmp_path / "r.db") as results:
        breaker, fine, vandal = results.cells()
        assert results.trace(breaker.key) is None
    assert (breaker.status, fine.status, vandal.status) == ("failed", "ok", "failed")
    assert breaker.score is None
    assert breaker.failure is not None
    assert breaker.failure.startswith("frame 5:\nTraceback")
    assert "RuntimeError: the planted failure" in breaker.failure
    assert "read-only" in (vandal.failure or "")
    assert fine.score is not None
    assert fine.score.error == 0
    seen: list[tuple[int, int]] = []
    run_bench([Strip()], trackers, results=tmp_path / "r.db", progress=lambda *counts: seen.append(counts)).close()
    assert seen == [(2, 2)]
    assert steps(log)[5] == 1


def test_a_scene_that_never_shows_its_target_is_a_failed_cell(tmp_path: Path) -> None:
    hidden = Strip(visible=(0.0,) * 5)
    with run_bench([hidden], [Entry("w", Walker())], results=tmp_path / "r.db") as results:
        (cell,) = results.cells()
    assert cell.status == "failed"
    assert "never shows" in (cell.failure or "")


def test_a_source_without_truth_runs_from_a_box_and_scores_nothing(tmp_path: Path) -> None:
    bare = Strip(has_truth=False)
    with pytest.raises(InputError, match="no truth"):
        run_bench([bare], [Entry("w", Walker())], results=tmp_path / "r.db")
    assert not (tmp_path / "r.db").exists()
    start = (Box(10.0, 20.0, 5.0, 5.0), 2)
    with run_bench([bare], [Entry("w", Walker())], init=start, results=tmp_path / "r.db") as results:
        (cell,) = results.cells()
        trace = results.trace(cell.key)
    assert cell.key.start == "10.0,20.0,5.0,5.0@2"
    assert cell.score is not None
    assert (cell.score.frames, cell.score.lost) == (0, None)
    assert trace is not None
    assert trace.indices.tolist() == list(range(2, 20))
    assert np.isnan(trace.truth_centers).all()
    (row,) = summarise([cell])
    assert (row.runs, row.scored, row.lost_share, row.error) == (1, 0, None, None)
    assert row.ms_median is not None


@pytest.mark.parametrize(
    ("change", "needle"),
    [
        ({"trackers": []}, "no trackers"),
        ({"trackers": ["kalman", "kalman"]}, "two trackers are labelled 'kalman'"),
        ({"trackers": ["kalmann"]}, "did you mean 'kalman'?"),
        ({"sources": [Strip(), Strip(hash="2")]}, "two sources are named 'strip'"),
        ({"sources": ["absent.mcap"]}, "absent.mcap"),
        ({"seeds": 0}, "seeds 0"),
        ({"seeds": [1, 1]}, "none twice"),
        ({"jobs": 0}, "jobs 0"),
        ({"results": Path("absent") / "r.db"}, "absent does not exist"),
    ],
)
def test_bad_input_is_one_line_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: dict[str, Any], needle: str
) -> None:
    monkeypatch.chdir(tmp_path)
    plain: dict[str, Any] = {"sources": [Strip()], "trackers": [Entry("w", Walker())], "results": "r.db"}
    with pytest.raises((InputError, irsim.InputError)) as caught:
        run_bench(**plain | change)
    assert needle in str(caught.value)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


# -- the results file


def test_a_results_file_keeps_what_it_is_given(tmp_path: Path) -> None:
    versions = {"numpy": "2.4"}
    path, trackers = tmp_path / "r.db", [Entry("w", Walker())]
    with run_bench([Strip()], trackers, command="irtrack bench strip", results=path) as results:
        (run,) = results.runs()
        (cell,) = results.cells()
        trace = results.trace(cell.key)
        assert results.trace(replace(cell.key, tracker_seed=5)) is None
        again = results.start_run("2026-11-21T00:00:00+00:00", "x", versions)
        assert results.runs()[1] == again
    assert run.command == "irtrack bench strip"
    assert run.versions["numpy"] == np.__version__
    assert cell.config == {"tracker": "bench_fakes:Walker", "parameters": {"speed": 1.0, "jitter": 0.0}}
    assert isinstance(cell.score, Score)
    assert cell.score.lost is False
    assert trace is not None
    assert trace.truth_centers.tolist() == [[10.0 + index, 20.0] for index in range(20)]
    assert trace.truth_sizes[0].tolist() == [4.0, 3.0]
    assert trace.step_ms.shape == trace.accuracy.shape == trace.visible.shape == (20,)
    # a plain SQLite client reads the figures by their names
    row = sqlite3.connect(tmp_path / "r.db").execute("SELECT frames, error, lost, success_auc FROM cells").fetchone()
    assert row == (19, 0.0, 0, cell.score.success_auc)


def test_keys_differ_wherever_a_field_does() -> None:
    key = Key("h", "a", "visible", "display", 0, 0, "{}", "c")
    others = [
        replace(key, source_hash="g"), replace(key, target=None), replace(key, start="1,2,3,4@0"),
        replace(key, input="counts"), replace(key, scene_seed=None), replace(key, tracker_seed=1),
        replace(key, config="[]"), replace(key, code_hash="d"),
    ]  # fmt: skip
    assert len({one.digest for one in [key, *others]}) == len(astuple(key)) + 1
    assert replace(key, target="a").digest == key.digest


def test_foreign_broken_and_other_versions_are_one_line(tmp_path: Path) -> None:
    good = tmp_path / "good.db"
    run_bench([Strip()], [Entry("w", Walker())], seeds=30, results=good).close()
    (tmp_path / "text.db").write_text("not a database, but long enough to look like one" * 40)
    (tmp_path / "empty.db").touch()
    sqlite3.connect(tmp_path / "foreign.db").execute("CREATE TABLE t (a)").connection.close()
    shutil.copy(good, tmp_path / "newer.db")
    sqlite3.connect(tmp_path / "newer.db").execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}").connection.close()
    (tmp_path / "cut.db").write_bytes(good.read_bytes()[: good.stat().st_size // 2])
    damaged = bytearray(good.read_bytes())
    damaged[4096 * 2 : 4096 * 6] = bytes(4096 * 4)
    (tmp_path / "damaged.db").write_bytes(damaged)
    expected = {
        "text": "not a database", "foreign": "not a results file", "newer": f"version {SCHEMA_VERSION + 1}",
        "cut": "malformed|damaged", "damaged": "malformed|damaged",
    }  # fmt: skip
    for name, message in expected.items():
        before = (tmp_path / f"{name}.db").read_bytes()
        for create in (False, True):
            with pytest.raises(InputError, match=message) as caught:
                Results(tmp_path / f"{name}.db", create=create)
            assert f"{name}.db: " in str(caught.value)
            assert "\n" not in str(caught.value)
        assert (tmp_path / f"{name}.db").read_bytes() == before
    for missing in ("absent.db", "empty.db", "."):
        with pytest.raises(InputError):
            Results(tmp_path / missing)
    assert not (tmp_path / "absent.db").exists()
    Results(tmp_path / "empty.db", create=True).close()  # a kill before the first commit leaves this


# -- specs


def test_tracker_specs() -> None:
    big, mine = "big=grey_pf:particles=500:resampling=systematic", "mine=bench_fakes:Logger:log=a:b:speed=2"
    entries = parse_trackers(f"grey_pf,{big},{mine}")
    assert [one.label for one in entries] == ["grey_pf", "big", "mine"]
    assert entries[0].tracker == irtrack.make("grey_pf")
    assert entries[1].tracker == irtrack.make("grey_pf", {"particles": 500, "resampling": "systematic"})
    assert entries[2].tracker == Logger(log="a:b", speed=2)
    assert parse_tracker_spec("grey_pf:particles=50").label == "grey_pf:particles=50"
    assert parse_tracker_spec("bench_fakes:Walker") == Entry("bench_fakes:Walker", Walker())
    (listed,) = parse_trackers("bench_fakes:Logger:log=[1, 'x,:]', {a: b}]")
    assert listed.tracker == Logger(log=[1, "x,:]", {"a": "b"}])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "needle"),
    [
        ("", "no name"),
        ("a=", "no name"),
        ("kalman,", "no name"),
        ("a b=kalman", "label 'a b'"),
        ("=kalman", "label ''"),
        ("klman", "did you mean 'kalman'?"),
        ("kalman:gat=3", "kalman.gat: unknown parameter"),
        ("grey_pf:bins=1:bins=2", "'bins' is given twice"),
        ("grey_pf:bins=many", "bins"),
        ("grey_pf:bins=[1", "bins"),
        ("absent_module:Thing", "absent_module"),
    ],
)
def test_bad_specs_are_one_line(text: str, needle: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_trackers(text)
    assert needle in str(caught.value)
    assert "\n" not in str(caught.value)


# -- the table


def cell(label: str, source: str = "s", **figures: Any) -> Cell:
    key = Key(source, "a", "visible", "display", 0, 0, "{}", "c")
    if not figures:
        return Cell(key, label, source, source, "failed", "broke")
    unsaid = {field.name: None for field in fields(Score)} | {"frames": 10, "held_frames": 10, "lost": False}
    return Cell(key, label, source, source, "ok", score=Score(**unsaid | figures))


def test_the_table_pools_frames_before_loss_by_hand() -> None:
    long = cell("t", held_frames=30, error_held=2.0, abs_x_held=1.0, sd_x_held=0.0, rmse_held=2.0, success_auc=0.6)
    held: dict[str, Any] = {"held_frames": 10, "error_held": 6.0, "abs_x_held": 5.0, "sd_x_held": 2.0, "rmse_held": 6.0}
    short = cell("t", lost=True, success_auc=0.2, **held)
    gone = cell("t", held_frames=0, lost=True)
    (row,) = summarise([long, short, gone, cell("t")])
    assert (row.runs, row.failed, row.scored, row.lost) == (4, 1, 3, 2)
    assert row.lost_share == pytest.approx(2 / 3)
    assert (row.lost_low, row.lost_high) == wilson(2, 3)
    assert row.error == pytest.approx((30 * 2 + 10 * 6) / 40)
    assert row.abs_x == pytest.approx((30 * 1 + 10 * 5) / 40)
    # thirty values 1 and ten of mean 5, sd 2: say five 3s and five 7s
    assert row.sd_x == pytest.approx(np.std([1.0] * 30 + [3.0] * 5 + [7.0] * 5))
    assert row.rmse == pytest.approx(math.sqrt((30 * 4 + 10 * 36) / 40))
    assert row.success_auc == pytest.approx(0.4)
    assert row.abs_y is None


def test_the_table_ranks_by_loss_then_share_off_then_error_then_time() -> None:
    told: dict[str, Any] = {"off_share": 0.0, "error_held": 1.0, "ms_median": 1.0}
    cells = [
        cell("failed"),
        cell("lost", lost=True, **told),
        cell("off", **told | {"off_share": 0.1}),
        cell("far", **told | {"error_held": 2.0}),
        cell("slow", **told | {"ms_median": 2.0}),
        cell("best", **told),
    ]
    assert [(row.label, row.rank) for row in summarise(cells)] == [
        ("best", 1), ("slow", 2), ("far", 3), ("off", 4), ("lost", 5), ("failed", 6),
    ]  # fmt: skip


def test_the_table_by_source_and_over_all() -> None:
    cells = [cell("a", "one", error_held=1.0), cell("a", "two", error_held=3.0), cell("b", "two", error_held=2.0)]
    assert [(row.source, row.label, row.rank) for row in summarise(cells)] == [
        ("one", "a", 1), ("two", "b", 1), ("two", "a", 2),
    ]  # fmt: skip
    overall = summarise(cells, overall=True)
    assert {(row.source, row.label): row.error for row in overall} == {
        (ALL_SOURCES, "a"): 2.0, (ALL_SOURCES, "b"): 2.0,
    }  # fmt: skip
    assert overall[0].as_dict()["runs"] == 2
