"""Workers of a dask scheduler give the same rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from bench_fakes import Breaker, Strip, Walker
from bench_rows import rows

from irtrack.bench import Entry, cluster, remote, run_bench
from irtrack.errors import InputError, WorkerError

distributed: Any = pytest.importorskip("distributed")
QUIET = {"dashboard_address": None, "silence_logs": "CRITICAL"}


def test_missing_scheduler_is_an_input_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "WAIT_S", 0.5)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:1: no scheduler answers: .*start one: dask scheduler"):
        cluster("tcp://127.0.0.1:1").__enter__()
    with pytest.raises(InputError, match="no scheduler answers"):
        cluster("nonsense").__enter__()


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


def test_a_bench_ends_without_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(remote, "WAIT_S", 2.0)
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, **QUIET) as scheduler,
        cluster(scheduler.scheduler_address) as executor,
    ):
        scheduler.scale(0)
        with pytest.raises(WorkerError, match="no worker is left; finished runs are kept"):
            run_bench([Strip()], [Entry("fine", Walker())], executor=executor, results=tmp_path / "r.db")
