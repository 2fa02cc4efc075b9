"""Worker processes whatever they are for: what is told of those that fail, and by whom."""

from __future__ import annotations

import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import pytest
from bench_fakes import Mute, Strip, Walker

from irtrack.bench import Entry, baseline, run_bench
from irtrack.bench.spec import source_specs
from irtrack.bench.suite import Suite
from irtrack.cli.bench import sweep
from irtrack.errors import IrtrackError, WorkerError
from irtrack.runner.watchdog import NO_LIMIT, Heartbeat, WorkerDiedError
from irtrack.runner.worker import Worker

FINE = Entry("fine", Walker(jitter=1.0))


def test_what_is_kept_of_a_bench_whose_workers_die_is_told_by_who_keeps_it(tmp_path: Path) -> None:
    """A bench in a results file; a baseline has none."""
    suite = Suite("", [*source_specs(Mute())], [FINE], seeds=1, tracker_seeds=1, input="display", time_limit_s=None)
    with pytest.raises(IrtrackError, match=r"\(SIGKILL\); 0 runs of this call kept in .*r\.db, the same command goes"):
        sweep(suite, tmp_path / "r.db", jobs=2)
    with pytest.raises(WorkerError, match=r"\(SIGKILL\)$"):
        baseline.measure(suite, jobs=2)


class ChoosyError(Exception):
    """Takes two arguments, which Exception is not given: it cannot be read from a pickle."""

    def __init__(self, frame: int, what: str) -> None:
        super().__init__(f"frame {frame}: {what}")


class StubbornError(Exception):
    def __reduce__(self) -> Any:
        raise RuntimeError("never pickled")


@dataclass(frozen=True, eq=False)
class Raises(Strip):
    """A source that raises."""

    what: str = ""

    def frame(self, index: int, input: Any = "counts") -> Any:
        raise ChoosyError(index, "torn") if self.what == "choosy" else StubbornError("torn")


@pytest.mark.parametrize(
    ("what", "said"), [("choosy", "ChoosyError: frame 0: torn"), ("stubborn", "StubbornError: torn")]
)
def test_what_a_source_raises_in_a_worker_is_told_whatever_its_class(tmp_path: Path, what: str, said: str) -> None:
    with pytest.raises(IrtrackError, match=f"^{said}$"):
        run_bench([Raises(what=what)], [FINE], jobs=2, results=tmp_path / "r.db")


def asleep(heartbeat: Heartbeat, seconds: float) -> None:
    time.sleep(seconds)


def test_whoever_waits_for_a_process_that_another_thread_closes_learns_just_that() -> None:
    worker = Worker()
    threading.Timer(0.2, worker.close).start()
    with pytest.raises(WorkerDiedError) as gone:
        worker.call(NO_LIMIT, asleep, 600.0)
    assert gone.value.how == "closed"


def ends(heartbeat: Heartbeat, status: int) -> None:
    with heartbeat.frame(0):
        os._exit(status)


@pytest.mark.skipif(sys.platform != "linux", reason="of the fork server")
def test_how_a_process_ends_is_told_though_others_start_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python reads it once, and whoever starts a process reads it of all that have ended: here while it is read."""
    read, main = forkserver.read_signed, threading.get_ident()

    def slowly(file: int) -> Any:
        time.sleep(0.2 if threading.get_ident() == main else 0.0)
        return read(file)

    monkeypatch.setattr(forkserver, "read_signed", slowly)
    done = threading.Event()

    def start_others() -> None:
        while not done.is_set():
            with closing(Worker()) as other:
                other.call(NO_LIMIT, asleep, 0.0)

    with ThreadPoolExecutor(1) as beside:
        starting = beside.submit(start_others)
        with pytest.raises(WorkerDiedError) as gone:
            Worker().call(NO_LIMIT, ends, 7)
        done.set()
        starting.result()
    assert gone.value.how == "exit status 7"
