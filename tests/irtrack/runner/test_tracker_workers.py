"""Worker processes whatever they are for: what is told of those that fail, and by whom."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
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


def test_dying_workers_end_a_bench_in_one_line(tmp_path: Path) -> None:
    """A bench in a results file; a baseline has none."""
    suite = Suite("", [*source_specs(Mute())], [FINE], seeds=1, tracker_seeds=1, input="display", time_limit_s=None)
    with pytest.raises(
        IrtrackError, match=r"\(SIGKILL\); 0 runs of this call kept in .*r\.db; the same command resumes"
    ):
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
def test_an_error_of_a_source_reaches_the_parent(tmp_path: Path, what: str, said: str) -> None:
    with pytest.raises(IrtrackError, match=f"^{said}$"):
        run_bench([Raises(what=what)], [FINE], jobs=2, results=tmp_path / "r.db")


def asleep(heartbeat: Heartbeat, seconds: float) -> None:
    time.sleep(seconds)


def test_a_worker_closed_by_another_thread() -> None:
    worker = Worker()
    threading.Timer(0.2, worker.close).start()
    with pytest.raises(WorkerDiedError) as gone:
        worker.call(NO_LIMIT, asleep, 600.0)
    assert gone.value.how == "closed"
