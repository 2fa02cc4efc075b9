"""The bench: keyed and resumed cells, any number of workers, failures kept apart."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Breaker, Logger, Still, Strip, Walker, steps
from bench_rows import rows
from processes import runs, wait_until

import irsim
import irtrack
from irsim.types import Box
from irtrack.bench import Entry, Results, run_bench
from irtrack.errors import InputError
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
def test_run_key_has_every_cause(tmp_path: Path, change: dict[str, Any]) -> None:
    plain: dict[str, Any] = {"sources": [Strip()], "trackers": [Entry("w", Walker())], "seeds": 1}
    run_bench(**plain, results=tmp_path / "r.db").close()
    with run_bench(**plain | change, results=tmp_path / "r.db") as results:
        assert len(results.cells(every=True)) == 2


def test_changed_code_makes_another_run_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_call_returns_its_own_runs(tmp_path: Path) -> None:
    path, trackers = tmp_path / "r.db", [Entry("w", Walker())]
    run_bench([Strip()], trackers, seeds=5, results=path).close()
    with run_bench([Strip()], trackers, seeds=[1, 7], results=path) as results:
        assert [cell.key.tracker_seed for cell in results.cells(run=results.run)] == [1, 7]
        assert [cell.key.tracker_seed for cell in results.cells()] == [0, 1, 2, 3, 4, 7]
    with Results(path) as results:
        assert results.run is None


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
        kept = irsim.loads(sources[cell.source, cell.key.source_hash].text)
        assert kept.hash == cell.key.source_hash
        assert kept.seed == cell.key.scene_seed


def test_a_bench_run_equals_irtrack_run(tmp_path: Path) -> None:
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
    assert not np.array_equal(traces[0].centers, traces[1].centers)  # type: ignore[union-attr]  # not None, or the test fails
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
    log, hold, path = sys.argv[1:]
    tracker = Entry("slow", Logger(jitter=1.0, log=log, hold=hold, patience=95))
    run_bench([Strip()], [tracker], seeds=8, jobs=2, results=path)
"""


def test_killed_bench_resumes(tmp_path: Path) -> None:
    """It is held after 95 steps: at least three runs of 19 by two workers."""
    log, hold, path, script = tmp_path / "log", tmp_path / "hold", tmp_path / "r.db", tmp_path / "killed.py"
    hold.touch()
    script.write_text(KILLED)
    here = str(Path(__file__).parents[2] / "support")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([here, str(Path(here).parents[1])])}
    process = subprocess.Popen([sys.executable, script, log, hold, path], env=environment)
    try:
        wait_until(lambda: count_cells(path) >= 3)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    workers = {int(line.split()[0]) for line in log.read_text().splitlines()} - {process.pid}
    assert workers
    wait_until(lambda: not any(runs(pid) for pid in workers))  # no worker waits on for work
    with Results(path) as left:
        done = rows(left)
    assert 3 <= len(done) < 8
    hold.unlink()
    before = steps(log)[19]
    tracker = Entry("slow", Logger(jitter=1.0, log=str(log), hold=str(hold), patience=95))
    with run_bench([Strip()], [tracker], seeds=8, results=path) as resumed:
        found = rows(resumed)
    assert steps(log)[19] - before == 8 - len(done)  # what was there is not run again
    assert found.items() >= done.items()
    with run_bench([Strip()], [tracker], seeds=8, results=tmp_path / "whole.db") as whole:
        assert rows(whole) == found


def count_cells(path: Path) -> int:
    try:
        with Results(path) as results:
            return len(results.cells())
    except InputError:
        return 0  # not there yet, or just being written


def test_entries_hold_whatever_a_bench_takes(tmp_path: Path) -> None:
    """A name, a spec, a class, and a plain tracker; rows of the results suit a DataFrame."""
    trackers = ["template", "bench_fakes:Walker:jitter=2", Walker, Still()]
    entries = [Entry(f"e{k}", tracker) for k, tracker in enumerate(trackers)]
    with run_bench([Strip()], entries, results=tmp_path / "r.db") as results:
        rows = results.rows()
    assert {(row["label"], row["status"], row["frames"]) for row in rows} == {(f"e{k}", "ok", 19) for k in range(4)}
