"""Trackers that raise, scenes without a visible target, and bad input of a bench."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_fakes import Breaker, Eraser, Logger, Raiser, Reader, SaysNan, SaysText, Strip, Vandal, Walker, steps

import irsim
from irsim.types import Box
from irtrack.bench import Entry, run_bench, summary
from irtrack.errors import InputError
from irtrack.registry.table import of


def test_failed_run_is_repeated(tmp_path: Path) -> None:
    log = tmp_path / "log"
    trackers = [Entry("breaker", Breaker()), Entry("vandal", Vandal()), Entry("fine", Logger(log=str(log)))]
    with run_bench([Strip()], trackers, results=tmp_path / "r.db") as results:
        breaker, fine, vandal = results.cells()
        assert results.trace(breaker.key) is None
    assert (breaker.status, fine.status, vandal.status) == ("failed", "ok", "failed")
    assert breaker.score is None
    assert breaker.failure is not None
    assert breaker.failure.startswith("strip, seed 0, frame 5:\nTraceback")
    assert "RuntimeError: the planted failure" in breaker.failure
    assert "read-only" in (vandal.failure or "")
    assert fine.score is not None
    assert fine.score.all.error == 0
    seen: list[tuple[int, int]] = []
    run_bench([Strip()], trackers, results=tmp_path / "r.db", progress=lambda *counts: seen.append(counts)).close()
    assert seen == [(0, 2), (2, 2)]
    assert steps(log)[5] == 1


def test_a_tracker_that_erases_frames_spoils_no_other(tmp_path: Path) -> None:
    trackers = [Entry("eraser", Eraser()), Entry("reader", Reader())]
    with run_bench([Strip()], trackers, seeds=2, results=tmp_path / "r.db") as results:
        found = {(cell.label, cell.score and cell.score.all.error) for cell in results.cells()}
    assert ("reader", 0.0) in found
    assert len(found) == 2


@pytest.mark.parametrize(
    ("tracker", "failure"),
    [
        (of(SaysNan), "bench_fakes:SaysNan: frame 5: the center (nan, 20.0); allowed: finite numbers"),
        (of(SaysText), "bench_fakes:SaysText: frame 5: step gave '1234'; allowed: a Box, cx, cy, w, h in px"),
        (Raiser(what="mute"), "MuteError: <exception str() failed>"),
    ],
    ids=["nan", "text", "no words"],
)
def test_wrong_output_of_a_tracker_fails_its_own_run(tmp_path: Path, tracker: Any, failure: str) -> None:
    with run_bench([Strip()], [Entry("bad", tracker), Entry("fine", Walker())], results=tmp_path / "r.db") as results:
        bad, fine = results.cells()
    assert (bad.status, fine.status) == ("failed", "ok")
    assert failure in (bad.failure or "")
    assert (bad.failure or "").startswith("strip, seed 0")


def test_target_that_is_never_visible(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="target 'a' of strip never shows"):
        run_bench([Strip(visible=(0.0,) * 5)], [Entry("w", Walker())], seeds=10, results=tmp_path / "r.db")
    assert not (tmp_path / "r.db").exists()


def test_a_source_without_truth_runs_from_a_box(tmp_path: Path) -> None:
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
    (row,) = summary([cell])
    assert (row.runs, row.scored, row.lost_share, row.held.error) == (1, 0, None, None)
    assert row.ms_median is not None


@pytest.mark.parametrize(
    ("change", "needle"),
    [
        ({"trackers": ["kalman", "kalman"]}, "two trackers are labelled 'kalman'"),
        ({"sources": [Strip(), Strip(hash="2")]}, "two sources are named 'strip'"),
        ({"target": "b"}, "has no target 'b'; allowed: a"),
        ({"seeds": 0}, "seeds 0"),
        ({"seeds": [1, 1]}, "none twice"),
        ({"seeds": [0, -1]}, "seeds -1: allowed: 0 or more"),
        ({"jobs": 0}, "jobs 0: allowed: 1 or more"),
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
