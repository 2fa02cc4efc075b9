"""The results as one table, a run a row, for other programs: CSV and Parquet."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from irsim.config.files import check_output, path_of, replacing, replacing_text
from irtrack.bench.records import Key, RunRecord
from irtrack.bench.results import Results
from irtrack.errors import InputError
from irtrack.metrics import FIGURES

_TEXT = ("source", "family", "label", "status", "failure", "outcome")
_KINDS: dict[str, type] = {
    **dict.fromkeys(_TEXT, str),
    "severity": int,
    **{field.name: int if field.name.endswith("_seed") else str for field in fields(Key)},
    **{name: figure.kind for name, figure in FIGURES.items()},
}
"""The columns and what is in them; any may be empty."""


def export(results: Results | str | Path, out: str | Path) -> Path:
    """Write the newest runs of a results file as a table, by the ending of `out`: .csv or .parquet (or .pq).

    A run is a row: what decides it (`irtrack.bench.Key`), how it went, and every figure of
    `irtrack.metrics.FIGURES`; empty (null) where nothing tells it. InputError where it cannot be written.
    """
    if not isinstance(results, Results):
        with Results(results) as opened:
            return export(opened, out)
    path = path_of(out)
    check_output(path, results.path, endings=(".csv", ".parquet", ".pq"))
    rows = [_row(cell) for cell in results.cells()]
    if not rows:
        raise InputError(f"{results.path}: holds no finished run; run irtrack bench first")
    if path.suffix.lower() == ".csv":
        _write_csv(rows, path)
    else:
        _write_parquet(rows, path)
    return path


def _row(cell: RunRecord) -> dict[str, Any]:
    key = {field.name: getattr(cell.key, field.name) for field in fields(Key)}
    figures = dict.fromkeys(FIGURES) if cell.score is None else cell.score.as_dict()
    told = {name: getattr(cell, name) for name in (*_TEXT, "severity")}
    return {name: {**told, **key, **figures}[name] for name in _KINDS}


def _write_csv(rows: Sequence[dict[str, Any]], path: Path) -> None:
    with replacing_text(path) as file:
        writer = csv.DictWriter(file, list(_KINDS))
        writer.writeheader()
        writer.writerows(rows)


def _write_parquet(rows: Sequence[dict[str, Any]], path: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet takes pyarrow: pip install 'irtrack[parquet]'; or name a .csv") from None
    kinds = {str: pyarrow.string(), int: pyarrow.int64(), bool: pyarrow.bool_(), float: pyarrow.float64()}
    schema = pyarrow.schema([(name, kinds[kind]) for name, kind in _KINDS.items()])
    with replacing(path) as file:
        parquet.write_table(pyarrow.Table.from_pylist(list(rows), schema), file)
