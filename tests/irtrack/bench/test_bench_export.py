"""The table of runs for other programs, read back by other programs."""

from __future__ import annotations

import csv
import multiprocessing
import resource
import sys
from pathlib import Path

import pytest
from bench_fakes import Breaker, Strip, Walker
from pyarrow import parquet

import irsim
from irtrack.bench import Entry, Results, export, run_bench
from irtrack.errors import InputError
from irtrack.metrics import FIGURES


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("export") / "r.db"
    entries = [Entry("w,\n", Walker(jitter=1.0)), Entry("b", Breaker())]
    run_bench([Strip(), irsim.open_source("sky", ["frames=3"])], entries, seeds=2, results=path).close()
    return path


def test_tables_equal_the_results(results: Path, tmp_path: Path) -> None:
    export(results, tmp_path / "x.csv")
    with (tmp_path / "x.csv").open(newline="", encoding="utf-8") as file:
        as_csv = list(csv.DictReader(file))
    table = parquet.read_table(export(results, tmp_path / "x.parquet")).to_pylist()
    with Results(results) as opened:
        cells = opened.cells()
    assert len(as_csv) == len(table) == len(cells) == 8
    for cell, text, row in zip(cells, as_csv, table, strict=True):
        assert list(text) == list(row)
        assert (row["label"], row["source"], row["status"]) == (cell.label, cell.source, cell.status)
        assert (row["tracker_seed"], row["scene_seed"]) == (cell.key.tracker_seed, cell.key.scene_seed)
        assert text["label"] == cell.label
        assert text["failure"] == (cell.failure or "")
        figures = {} if cell.score is None else cell.score.as_dict()
        for name in FIGURES:
            assert row[name] == figures.get(name)
            assert text[name] == ("" if figures.get(name) is None else str(figures[name]))


def test_bad_exports_are_input_errors(results: Path, tmp_path: Path) -> None:
    for name, what in {"x.txt": r"ends in \.csv or \.parquet", "absent/x.csv": "does not exist"}.items():
        with pytest.raises(InputError, match=what):
            export(results, tmp_path / name)
    with pytest.raises(InputError, match="would replace"):
        export(results, results)
    Results(tmp_path / "empty.db", create=True).close()
    with pytest.raises(InputError, match="no finished run"):
        export(tmp_path / "empty.db", tmp_path / "x.csv")
    assert not (tmp_path / "x.csv").exists()


def limited_sweep(path: Path, most_bytes: int) -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))
    try:
        run_bench([Strip()], [Entry("w", Walker(jitter=1.0))], seeds=60, results=path).close()
    except InputError as error:
        sys.exit(1 if "finished runs are kept" in str(error) else str(error))


def test_full_disk_keeps_finished_runs(tmp_path: Path) -> None:
    """The system itself refuses to write, in the results file or in what SQLite keeps beside it."""
    path = tmp_path / "r.db"
    process = multiprocessing.get_context("fork").Process(target=limited_sweep, args=(path, 80_000))
    process.start()
    process.join()
    assert process.exitcode == 1
    with Results(path) as left:
        assert 0 < len(left.cells()) < 60
    with run_bench([Strip()], [Entry("w", Walker(jitter=1.0))], seeds=60, results=path) as results:
        assert len(results.cells()) == 60
