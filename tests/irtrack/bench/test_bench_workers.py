"""Workers of a bench that hang, die or are killed, and other executors: the same rows."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from bench_fakes import Breaker, Forker, Hanger, Killer, Mute, Strip, Walker
from bench_rows import rows

from irtrack.bench import Entry, run_bench
from irtrack.errors import InputError, WorkerError

FINE = Entry("fine", Walker(jitter=1.0))


def test_a_tracker_that_hangs_fails_alone(tmp_path: Path) -> None:
    """At frames 3 and 4, unless the machine is so slow that they come late before."""
    hanging = [Entry(f"hanging {at}", Hanger(at=at)) for at in (3, 4)]
    with run_bench([Strip()], [*hanging, FINE], time_limit_s=2.0, results=tmp_path / "r.db") as results:
        found = {cell.label: cell for cell in results.cells()}
    for each in hanging:
        failure = found[each.label].failure or ""
        assert re.fullmatch(r"strip, seed 0, frame \d: timed out: more than 2 s in the tracker", failure)
    with run_bench([Strip()], [FINE], results=tmp_path / "alone.db") as alone:
        (cell,) = alone.cells()
    assert found["fine"].outcome == cell.outcome


def test_a_tracker_that_kills_its_process_fails_alone(tmp_path: Path) -> None:
    entries = [FINE, Entry("killer", Killer(at=7)), Entry("breaker", Breaker())]
    with run_bench([Strip()], entries, jobs=2, results=tmp_path / "r.db") as results:
        cells = results.cells()
    failures = {cell.label: cell.failure or "" for cell in cells}
    assert (
        failures["killer"] == "strip, seed 0, frame 7: the process died 2 times while the tracker was at work (SIGKILL)"
    )
    assert failures["breaker"].endswith("RuntimeError: the planted failure")
    assert [cell.status for cell in cells if cell.label == "fine"] == ["ok"]


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_tracker_that_forks_loses_no_rows(tmp_path: Path, jobs: int) -> None:
    entries = [Entry("forker", Forker(jitter=1.0)), Entry("fine", Forker(at=99, jitter=1.0))]
    with run_bench([Strip()], entries, seeds=4, jobs=jobs, results=tmp_path / "r.db") as results:
        cells = results.cells()
    outcomes = {label: [cell.outcome for cell in cells if cell.label == label] for label in ("forker", "fine")}
    assert len(set(outcomes["fine"])) == 4
    assert outcomes["forker"] == outcomes["fine"]


def test_worker_killed_once_loses_nothing(tmp_path: Path) -> None:
    entries: list[Any] = [FINE, Entry("chance", Killer(at=7, once=str(tmp_path / "killed"), jitter=1.0))]
    with run_bench([Strip()], entries, seeds=4, jobs=2, results=tmp_path / "r.db") as results:
        killed = rows(results)
    assert (tmp_path / "killed").exists()
    with run_bench([Strip()], entries, seeds=4, results=tmp_path / "whole.db") as results:
        assert rows(results) == killed


def test_source_that_kills_workers_ends_the_bench(tmp_path: Path) -> None:
    with pytest.raises(WorkerError, match=r"died again and again while no tracker was at work \(SIGKILL\)$"):
        run_bench([Mute()], [FINE], jobs=2, results=tmp_path / "r.db")


@pytest.mark.parametrize(("kind", "limit"), [(ProcessPoolExecutor, None), (ThreadPoolExecutor, 30.0)])
def test_any_executor_gives_the_same_rows(tmp_path: Path, kind: Any, limit: float | None) -> None:
    entries = [FINE, Entry("breaker", Breaker())]
    with kind(2) as executor:
        arguments: dict[str, Any] = {"executor": executor, "time_limit_s": limit}
        with run_bench([Strip()], entries, seeds=2, results=tmp_path / "r.db", **arguments) as results:
            found = rows(results)
        assert executor.submit(abs, -1).result() == 1  # left open
    with run_bench([Strip()], entries, seeds=2, results=tmp_path / "whole.db") as results:
        assert rows(results) == found


def test_unpicklable_tracker_is_an_input_error(tmp_path: Path) -> None:
    class Local(Walker):
        pass

    with pytest.raises(InputError, match=r"strip: cannot be sent to a worker process: .*Local.*; allowed: a class at"):
        run_bench([Strip()], [Entry("local", Local())], seeds=2, jobs=2, results=tmp_path / "r.db")


def test_a_bench_that_is_stopped_leaves_no_process(tmp_path: Path) -> None:
    """Ctrl-C while every worker hangs."""
    entries = [Entry("hanging", Hanger(at=1))]
    threading.Timer(3.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        run_bench([Strip()], entries, seeds=2, jobs=2, results=tmp_path / "r.db")
    children = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(os.getpid())], capture_output=True, text=True)
    left = [word for line in children.stdout.splitlines() if "forkserver" in line for word in line.split()[:1]]
    copies = subprocess.run(["ps", "-o", "pid=", "--ppid", ",".join(left)], capture_output=True, text=True)
    assert "spawn_main" not in children.stdout
    assert left or sys.platform != "linux"  # there the workers are copies of a server
    assert (copies.stdout.strip(), copies.stderr) == ("", "")
