"""Export of results as one table, a run a row: CSV and Parquet."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from irsim.config.paths import path_of
from irsim.recording.output import atomic_file, atomic_text, check_output
from irtrack.bench.records import Key, RunRecord
from irtrack.bench.results import Results
from irtrack.errors import InputError
from irtrack.metrics.tasks import ALL_FIGURES

_TEXT = ("source", "family", "label", "status", "failure", "outcome")
_KINDS: dict[str, type] = {
    **dict.fromkeys(_TEXT, str),
    "severity": int,
    **{field.name: int if field.name.endswith("_seed") else str for field in fields(Key)},
    **{name: figure.kind for name, figure in ALL_FIGURES.items()},
}
"""Columns and their types; any value may be missing."""


def export(results: Results | str | Path, out: str | Path) -> Path:
    """Write the newest runs of a results file as a table, by the ending of `out`: .csv or .parquet (or .pq).

    A row has the key of a run (`irtrack.bench.Key`), its outcome, and every figure of
    `irtrack.metrics.tasks.ALL_FIGURES`; a cell is empty (null) where the run has no value. InputError where the table
    cannot be written.
    """
    if not isinstance(results, Results):
        with Results(results) as opened:
            return export(opened, out)
    path = path_of(out)
    check_output(path, results.path, endings=(".csv", ".parquet", ".pq"))
    rows = results.rows()
    if not rows:
        raise InputError(f"{results.path}: holds no finished run; run irtrack bench first")
    if path.suffix.lower() == ".csv":
        _write_csv(rows, path)
    else:
        _write_parquet(rows, path)
    return path


def row_of(cell: RunRecord) -> dict[str, Any]:
    """Return the row of a run: the value of each column, None where there is none."""
    key = {field.name: getattr(cell.key, field.name) for field in fields(Key)}
    figures = dict.fromkeys(ALL_FIGURES) | (dict(cell.figures) if cell.score is None else cell.score.as_dict())
    named = {name: getattr(cell, name) for name in (*_TEXT, "severity")}
    return {name: {**named, **key, **figures}[name] for name in _KINDS}


def _write_csv(rows: Sequence[dict[str, Any]], path: Path) -> None:
    with atomic_text(path) as file:
        writer = csv.DictWriter(file, list(_KINDS))
        writer.writeheader()
        writer.writerows(rows)


def _write_parquet(rows: Sequence[dict[str, Any]], path: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow: pip install 'irtrack[parquet]'; or name a .csv") from None
    kinds = {str: pyarrow.string(), int: pyarrow.int64(), bool: pyarrow.bool_(), float: pyarrow.float64()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in _KINDS.items()])
    with atomic_file(path) as file:
        parquet.write_table(pyarrow.Table.from_pylist(list(rows), schema), file)
