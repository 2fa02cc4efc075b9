"""What a results file says, times aside."""

from __future__ import annotations

from typing import Any

from irtrack.bench import Results

TIMES = ("ms_mean", "ms_median", "cpu_ms_mean", "cpu_ms_median")


def rows(results: Results) -> dict[Any, Any]:
    """(key, label) of every cell, with everything else; `RunRecord.outcome` tells the tracks frame by frame."""
    found = {}
    for cell in results.cells(every=True):
        trace = results.trace(cell.key)
        assert trace is None or trace.digest == cell.outcome
        figures = cell.score and cell.score.as_dict() | dict.fromkeys(TIMES)
        told = (cell.source, cell.scene_hash, cell.severity, cell.status, cell.failure, cell.outcome)
        found[cell.key, cell.label] = (*told, figures)
    return found
