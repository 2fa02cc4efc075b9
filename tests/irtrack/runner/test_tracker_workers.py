"""Worker processes that fail: their errors reach the caller."""

from __future__ import annotations

import multiprocessing
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from bench_fakes import Strip, Walker

from irtrack.bench import Entry, run_bench
from irtrack.errors import IrtrackError
from irtrack.runner.watchdog import NO_LIMIT, Heartbeat, WorkerDiedError
from irtrack.runner.worker import Worker

FINE = Entry("fine", Walker(jitter=1.0))


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


def limited_bench(path: str) -> list[str]:
    with run_bench([Strip()], [FINE], time_limit_s=60.0, results=path) as results:
        return [cell.status for cell in results.cells()]


@pytest.mark.slow
def test_a_daemonic_worker_may_limit_times(tmp_path: Path) -> None:
    """Those of `dask worker` are daemonic."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(limited_bench, (str(tmp_path / "r.db"),)) == ["ok"]
