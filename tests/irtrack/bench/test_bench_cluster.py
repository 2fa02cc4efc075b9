"""Workers of a dask scheduler: the same rows, whatever becomes of a worker."""

from __future__ import annotations

import os
import signal
import threading
import time
import weakref
from pathlib import Path
from typing import Any

import pytest
from bench_fakes import Breaker, Logger, Strip, Walker
from bench_rows import rows

from irtrack.bench import Entry, cluster, remote, run_bench
from irtrack.errors import InputError

distributed: Any = pytest.importorskip("distributed")
QUIET = {"dashboard_address": None, "silence_logs": "CRITICAL"}


def test_a_scheduler_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "WAIT_S", 0.5)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers: .*start one: dask scheduler"):
        cluster("tcp://127.0.0.1:1").__enter__()
    with pytest.raises(InputError, match="no scheduler answers"):
        cluster("nonsense").__enter__()


def test_nothing_is_left_of_a_client_that_found_no_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    """Or it would be closed whenever memory is collected: for ever, where that is while another one starts."""
    monkeypatch.setattr(remote, "WAIT_S", 0.5)
    made = []

    class Noted(distributed.Client):  # type: ignore[misc]  # it has no types
        def __init__(self, *given: Any, **named: Any) -> None:
            made.append(weakref.ref(self))
            super().__init__(*given, **named)

    monkeypatch.setattr(distributed, "Client", Noted)
    with pytest.raises(InputError, match="no scheduler answers") as raised:
        cluster("tcp://127.0.0.1:1").__enter__()
    assert [each() for each in made] == [None], raised


def test_a_scheduler_without_workers_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "WAIT_S", 2.0)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, **QUIET) as scheduler,
        pytest.raises(InputError, match="the scheduler has no worker; start one: dask worker"),
    ):
        cluster(scheduler.scheduler_address).__enter__()


def test_workers_of_a_scheduler_give_the_same_rows(tmp_path: Path) -> None:
    entries = [Entry("fine", Walker(jitter=1.0)), Entry("breaker", Breaker())]
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, **QUIET) as scheduler,
        cluster(scheduler.scheduler_address) as executor,
        run_bench([Strip()], entries, seeds=3, executor=executor, results=tmp_path / "r.db") as results,
    ):
        found = rows(results)
    with run_bench([Strip()], entries, seeds=3, results=tmp_path / "whole.db") as results:
        assert rows(results) == found


@pytest.mark.slow
def test_a_dask_worker_killed_loses_nothing(tmp_path: Path) -> None:
    log = tmp_path / "log"
    entries = [Entry("slow", Logger(jitter=1.0, log=str(log)))]

    def kill() -> None:
        while not (log.exists() and "\n" in log.read_text()):  # a whole line
            time.sleep(0.01)
        os.kill(int(log.read_text().split()[0]), signal.SIGKILL)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **QUIET) as scheduler:
        threading.Thread(target=kill, daemon=True).start()
        with (
            cluster(scheduler.scheduler_address) as executor,
            run_bench([Strip()], entries, seeds=40, executor=executor, results=tmp_path / "r.db") as results,
        ):
            found = rows(results)
    pids = {line.split()[0] for line in log.read_text().splitlines()}
    assert len(pids) > 1
    with run_bench([Strip()], entries, seeds=40, results=tmp_path / "whole.db") as results:
        assert rows(results) == found
