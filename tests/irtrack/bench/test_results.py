"""The results file: contents, unreadable files, and reports of a killed bench."""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
import subprocess
import sys
from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
from bench_fakes import Breaker, Strip, Walker

from irtrack.bench import Entry, Key, Results, RunRecord, run_bench
from irtrack.bench.records import pack
from irtrack.bench.schema import SCHEMA_VERSION
from irtrack.errors import InputError
from irtrack.metrics import Score


def test_results_file_round_trip(tmp_path: Path) -> None:
    versions = {"numpy": "2.4"}
    path, trackers = tmp_path / "r.db", [Entry("w", Walker())]
    with run_bench([Strip()], trackers, command="irtrack bench strip", results=path) as results:
        (run,) = results.runs()
        (cell,) = results.cells()
        trace = results.trace(cell.key)
        assert results.trace(replace(cell.key, tracker_seed=5)) is None
        assert run == results.run
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
    figures = dict(sqlite3.connect(tmp_path / "r.db").execute("SELECT name, value FROM scores").fetchall())
    assert [figures[name] for name in ("frames", "error", "lost")] == [19, 0, 0]
    assert figures["success_auc"] == cell.score.success_auc


def test_key_digest_covers_every_field() -> None:
    key = Key("h", "a", "visible", "display", 0, 0, "{}", "c")
    others = [
        replace(key, source_hash="g"), replace(key, target=None), replace(key, start="1,2,3,4@0"),
        replace(key, input="counts"), replace(key, scene_seed=None), replace(key, tracker_seed=1),
        replace(key, config="[]"), replace(key, code_hash="d"), replace(key, task="many"), replace(key, weights="w"),
    ]  # fmt: skip
    assert len({one.digest for one in [key, *others]}) == len(astuple(key)) + 1
    assert replace(key, target="a").digest == key.digest


def test_unreadable_results_files(tmp_path: Path) -> None:
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
    os.mkfifo(tmp_path / "pipe.db")
    with pytest.raises(InputError, match=r"pipe\.db: is no regular file; allowed: a results file"):
        Results(tmp_path / "pipe.db")
    for missing in ("absent.db", "empty.db", "."):
        with pytest.raises(InputError):
            Results(tmp_path / missing)
    assert not (tmp_path / "absent.db").exists()
    Results(tmp_path / "empty.db", create=True).close()  # a kill before the first commit leaves this


DAMAGED = "the results file is damaged: not all in it can be read"


def test_damaged_track_is_an_input_error(tmp_path: Path) -> None:
    path = tmp_path / "r.db"
    with run_bench([Strip()], [Entry("w", Walker())], results=path) as results:
        (cell,) = results.cells()
        arrays = results.arrays(cell.key)
    assert arrays is not None
    blob = pack(arrays)
    flipped = blob[:-1] + bytes([blob[-1] ^ 1])
    misnamed = pack({"centres": arrays["centers"]})
    for changed, said in [(flipped, "ValueError"), (blob[:-1], "ValueError"), (misnamed, "TypeError")]:
        with sqlite3.connect(path) as client:
            client.execute("UPDATE cells SET trace = ?", (changed,))
        with Results(path) as results, pytest.raises(InputError) as caught:
            results.trace(cell.key)
        assert str(caught.value) == f"{path}: {DAMAGED} ({said})"


def modes(path: Path) -> tuple[str, list[str]]:
    """The journal that the file asks for, and what lies beside it."""
    with contextlib.closing(sqlite3.connect(path)) as client:
        mode = client.execute("PRAGMA journal_mode").fetchone()[0]
    return mode, sorted(each.name for each in path.parent.iterdir())


def test_others_read_committed_runs_during_a_bench(tmp_path: Path) -> None:
    path, counts = tmp_path / "r.db", []

    def look(cell: RunRecord) -> None:
        with Results(path) as other:
            counts.append(len(other.cells()))

    with run_bench([Strip()], [Entry("w", Walker(jitter=1.0))], seeds=5, results=path, seen=look) as results:
        assert counts == [1, 2, 3, 4, 5]
        assert len(results.cells()) == 5
        assert [each.name for each in tmp_path.iterdir()] == ["r.db"]
    assert modes(path) == ("delete", ["r.db"])


REPORTING = """
import sys
from bench_fakes import Breaker, Strip, Walker
from irtrack.bench import Entry, run_bench
if __name__ == "__main__":
    report = lambda cell: print(cell.key.digest, flush=True)
    run_bench([Strip()], [Entry("w", Walker(jitter=1.0))], seeds=500, results=sys.argv[1], seen=report)
"""


def test_a_killed_bench_keeps_every_reported_run(tmp_path: Path) -> None:
    path, script = tmp_path / "r.db", tmp_path / "reporting.py"
    script.write_text(REPORTING)
    here = Path(__file__).parents[2] / "support"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(here), str(here.parents[1])])}
    with subprocess.Popen(
        [sys.executable, script, path], env=environment, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        reported = [process.stdout.readline().strip() for _ in range(3)]
        process.kill()
        reported += process.stdout.read().split()
    with Results(path) as left:
        kept = {cell.key.digest for cell in left.cells()}
    assert kept >= set(reported)
    assert len(set(reported)) == len(reported) < 500


def contents(path: Path) -> list[object]:
    with Results(path) as results:
        cells = results.cells()
        traces = [results.trace(cell.key) for cell in cells]
        arrays = [None if each is None else [part.tobytes() for part in vars(each).values()] for each in traces]
        return [repr(results.runs()), repr(results.sources()), repr(cells), arrays]


def test_a_flipped_bit_is_refused_or_changes_nothing(tmp_path: Path) -> None:
    good, path = tmp_path / "good.db", tmp_path / "r.db"
    run_bench([Strip()], [Entry("w", Walker(jitter=1.0)), Entry("b", Breaker())], seeds=2, results=good).close()
    whole, wanted = good.read_bytes(), contents(good)
    rng = np.random.default_rng(5)
    refused = 0
    for at in rng.integers(0, len(whole), 150):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << int(rng.integers(8))]) + whole[at + 1 :])
        try:
            found = contents(path)
        except InputError:
            refused += 1
            continue
        assert found == wanted, at
    assert refused > 20
