"""Results file: SQLite, one run a row (table `cells`), committed as runs finish.

A killed bench leaves a valid file (journals of SQLite); the next one continues from there.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields
from html import escape
from math import isnan
from pathlib import Path
from types import TracebackType
from typing import Any
from zlib import crc32

import numpy as np

from irsim.config.paths import check_input, path_of
from irsim.notebook import table
from irtrack.bench.records import Key, Run, RunRecord, SourceRow, pack, unpack
from irtrack.bench.schema import APPLICATION_ID, BOUNDS_TABLE, EXPLANATIONS_TABLE, SCHEMA, SCHEMA_VERSION
from irtrack.bench.summary import RANKED, ranked_texts, summary
from irtrack.errors import InputError, one_line
from irtrack.metrics import Score, Trace
from irtrack.metrics.bound import TargetBound

_NO_ROOM = {sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR}
"""Error codes of SQLite where it cannot write because of a full disk, a quota or a limit."""

_KEY = [field.name for field in fields(Key)]


def checksum(*values: object) -> int:
    """Return the CRC-32 of values as JSON, by which a changed row of a table is detected."""
    return crc32(json.dumps(values).encode())


class Results:
    """Results file. InputError where the file cannot be used, is of another program, or is damaged.

    `create=True` creates a missing file (its folder must exist). `run` is the call of the bench that opened the file;
    None where the file was opened for reading.
    """

    def __init__(self, path: str | Path, create: bool = False) -> None:
        self.path = path_of(path)
        self.run: Run | None = None
        if self.path.is_dir():
            raise InputError(f"{path}: is a folder; allowed: a results file")
        check_input(path, "a results file")
        is_new = not self.path.exists() or (create and self.path.stat().st_size == 0)
        if is_new and not create:
            raise InputError(f"{path}: no such file; allowed: a results file written by irtrack bench")
        if is_new and not self.path.parent.is_dir():
            raise InputError(f"{path}: the folder {self.path.parent} does not exist")
        is_made = not self.path.exists()
        with self._file_errors():
            self._db = sqlite3.connect(self.path, isolation_level=None)
            try:
                if is_new:
                    self._db.executescript(SCHEMA)
                else:
                    with self._reading():
                        self._check_header()
            except BaseException:
                self._db.close()
                if is_made and self.path.stat().st_size == 0:  # a full disk
                    self.path.unlink()
                raise

    def _check_header(self) -> None:
        application = self._db.execute("PRAGMA application_id").fetchone()[0]
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if application != APPLICATION_ID:
            raise InputError(f"{self.path}: is not a results file of irtrack bench")
        if version != SCHEMA_VERSION:
            raise InputError(
                f"{self.path}: results of version {version}; this irtrack reads version {SCHEMA_VERSION}: "
                "give another file name"
            )
        verdict = self._db.execute("PRAGMA integrity_check(1)").fetchone()[0]
        if verdict != "ok":
            raise InputError(f"{self.path}: the results file is damaged: {verdict.splitlines()[0]}")

    @contextmanager
    def _file_errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            code = (
                getattr(error, "sqlite_errorcode", 0) & 0xFF
            )  # primary error code, without the extension in its upper bytes
            hint = "; finished runs are kept: make room and give the same command again" if code in _NO_ROOM else ""
            raise InputError(f"{self.path}: cannot use the results file: {error}{hint}") from error

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Turn errors of reading into InputErrors, including damage that SQLite does not detect."""
        with self._file_errors():
            try:
                yield
            except (sqlite3.Error, InputError):
                raise
            except Exception as error:  # UTF-8, JSON and packed arrays raise different errors for changed bytes
                what = f"not all in it can be read ({type(error).__name__})"
                raise InputError(f"{self.path}: the results file is damaged: {what}") from error

    def close(self) -> None:
        self._db.close()

    def __repr__(self) -> str:
        return f"Results({str(self.path)!r})"

    def _repr_html_(self) -> str:
        try:
            return results_card(self.path.name, self.cells())
        except InputError as error:  # the file is closed or deleted
            return f"<p>{escape(str(error))}</p>"

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def sweep(self) -> Iterator[None]:
        """Make transactions within the block cheap: 0.02 ms each instead of the 16 ms of four waits for the disk.

        SQLite keeps commits in a write-ahead log, NAME-wal, and merges it at the end. A process killed in between
        leaves both files with all that was committed, and the next process to open NAME merges them; a power cut loses
        only what the system has not written yet (sqlite.org/wal.html). Where another process is writing, or the file
        system does not support this log, transactions keep their cost.
        """
        with suppress(sqlite3.Error):
            if self._db.execute("PRAGMA journal_mode = WAL").fetchone()[0] == "wal":
                self._db.execute("PRAGMA synchronous = NORMAL")
        try:
            yield
        finally:
            with suppress(sqlite3.Error):  # fails while another process has the file open
                self._db.execute("PRAGMA synchronous = FULL")  # NORMAL is safe with a write-ahead log only
                self._db.execute("PRAGMA journal_mode = DELETE")

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Commit all writes of the block together, or none."""
        with self._file_errors():
            self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            if self._db.in_transaction:  # on a full disk SQLite has rolled back already
                self._db.execute("ROLLBACK")
            raise
        with self._file_errors():
            self._db.execute("COMMIT")

    def _insert(self, table: str, row: dict[str, Any], or_what: str = "ABORT") -> int:
        marks = ", ".join("?" * len(row))
        with self._file_errors():
            cursor = self._db.execute(
                f"INSERT OR {or_what} INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values())
            )
        return cursor.lastrowid or 0

    def start_run(self, started: str, command: str | None, versions: dict[str, str]) -> Run:
        """Store a call of the bench, make it the current `run`, and return it."""
        row: dict[str, Any] = {"started": started, "command": command, "versions": json.dumps(versions)}
        row["crc"] = checksum(*row.values())
        self.run = Run(self._insert("runs", row), started, command, dict(versions))
        return self.run

    def add_source(self, source: SourceRow) -> None:
        """Store a source; it replaces a source of the same name and hash (a recording may have moved)."""
        row = {field.name: getattr(source, field.name) for field in fields(source)}
        row["columns"], row["rows"] = row.pop("size")
        row |= {"changes": json.dumps(source.changes), "rate_hz": float(source.rate_hz)}
        row["crc"] = checksum(sorted(row.items()))
        self._insert("sources", row, "REPLACE")

    def want(self, run: Run, source: str, label: str, key: Key) -> None:
        """Store that a call includes this run of a source under a label, whether computed by the call or found in the
        file."""
        row = {"run": run.id, "source": source, "label": label, "digest": key.digest}
        self._insert("wanted", row | {"crc": checksum(*row.values())}, "IGNORE")

    def has(self, key: Key) -> bool:
        """Return whether the file has this run and it did not fail; failed runs are tried again."""
        with self._file_errors():
            found = self._db.execute("SELECT 1 FROM cells WHERE digest = ? AND status = 'ok'", (key.digest,))
            return found.fetchone() is not None

    def add(self, cell: RunRecord, arrays: Mapping[str, np.ndarray] | None) -> None:
        """Store the finished run of a tracker and its arrays; its source and the bench command are stored already."""
        row = {name: getattr(cell.key, name) for name in _KEY}
        row |= {"status": cell.status, "failure": cell.failure, "outcome": cell.outcome}
        given = cell.score.as_dict() if cell.score else cell.figures
        figures = {name: None if value is None or isnan(value) else float(value) for name, value in given.items()}
        row["crc"] = checksum(sorted(row.items()), sorted(figures.items()))
        row |= {"digest": cell.key.digest, "trace": None if arrays is None else pack(arrays)}
        self._insert("cells", row, "REPLACE")
        rows = [(cell.key.digest, name, value) for name, value in figures.items()]
        with self._file_errors():
            self._db.execute("DELETE FROM scores WHERE digest = ?", (cell.key.digest,))
            self._db.executemany("INSERT INTO scores VALUES (?, ?, ?)", rows)

    def runs(self) -> list[Run]:
        """Return all calls of the bench, oldest first."""
        with self._reading():
            rows = self._db.execute("SELECT id, started, command, versions, crc FROM runs ORDER BY id").fetchall()
            for _, *values, crc in rows:
                self._expect("runs", crc, *values)
            return [Run(id, started, command, json.loads(versions)) for id, started, command, versions, _ in rows]

    def sources(self) -> dict[tuple[str, str], SourceRow]:
        """Return all sources by (name, hash); sources of different names may have the same content."""
        names = [field.name for field in fields(SourceRow) if field.name != "size"]
        with self._reading():
            read = ["columns", "rows", *names]
            rows = self._db.execute(f"SELECT {', '.join(read)}, crc FROM sources ORDER BY rowid").fetchall()
            for *values, crc in rows:
                self._expect("sources", crc, sorted(zip(read, values, strict=True)))
            sources = [_source(row[:2], dict(zip(names, row[2:-1], strict=True))) for row in rows]
        return {(source.name, source.hash): source for source in sources}

    def cells(self, every: bool = False, run: Run | None = None) -> list[RunRecord]:
        """Return the run records, by source, label and seeds.

        Where a source or a tracker has changed under the same name, only the runs of the version in the latest call are
        returned; `every=True` adds the older ones. With `run`, only the runs that this call included are returned.
        """
        self.sources()  # checks their rows, which the join reads, too
        stored = [*_KEY, "status", "failure", "outcome"]
        columns = ["label", "name", "scene_hash", "severity", *stored]
        sql = f"""
            SELECT max(run), digest, cells.crc, {", ".join(columns)} FROM wanted JOIN cells USING (digest)
            JOIN sources ON sources.name = wanted.source AND sources.hash = cells.source_hash
            WHERE :run IS NULL OR run = :run GROUP BY name, label, digest
            ORDER BY name, scene_hash, label, config, code_hash, scene_seed, tracker_seed, target, input, start
        """
        with self._reading():
            stored_runs = {digest for (digest,) in self._db.execute("SELECT digest FROM cells NOT INDEXED")}
            rows = self._db.execute(sql, {"run": None if run is None else run.id}).fetchall()
            if run is None and not stored_runs <= {digest for _, digest, *_ in rows}:
                raise InputError(
                    f"{self.path}: the results file is damaged: a run is in no call, or its index is wrong"
                )
            scores: dict[str, dict[str, float | None]] = {}
            for digest, name, value in self._db.execute("SELECT digest, name, value FROM scores"):
                scores.setdefault(digest, {})[name] = value
            for *values, crc in self._db.execute("SELECT run, source, label, digest, crc FROM wanted"):
                self._expect("wanted", crc, *values)
            dated = []
            for last, digest, crc, *values in rows:
                row, figures = dict(zip(columns, values, strict=True)), scores.get(digest, {})
                self._expect("cells", crc, sorted((name, row[name]) for name in stored), sorted(figures.items()))
                dated.append((last, _cell(row, figures)))
        if every:
            return [cell for _, cell in dated]
        newest: dict[tuple[str, str], int] = {}
        for last, cell in dated:
            place = (cell.source, cell.label)
            newest[place] = max(last, newest.get(place, 0))
        current = {_version(cell) for last, cell in dated if last == newest[cell.source, cell.label]}
        return [cell for _, cell in dated if _version(cell) in current]

    def rows(self) -> list[dict[str, Any]]:
        """Return the newest runs, each with the columns of `irtrack.export`, such as for a DataFrame."""
        from irtrack.bench.export import row_of  # that module imports this one

        return [row_of(cell) for cell in self.cells()]

    def _expect(self, table: str, crc: int, *values: object) -> None:
        """Raise InputError unless the values of a row match its checksum."""
        if crc != checksum(*values):
            raise InputError(f"{self.path}: the results file is damaged: a row of {table} was changed")

    def arrays(self, key: Key) -> dict[str, np.ndarray] | None:
        """Return the arrays of a run: those of its trace, of its `TrackSet` or its `DetectionSet`; None where it failed
        or is missing."""
        with self._reading():
            row = self._db.execute("SELECT trace FROM cells WHERE digest = ?", (key.digest,)).fetchone()
            return unpack(row[0]) if row and row[0] else None

    def add_bounds(self, source_hash: str, target: str, bound: TargetBound) -> None:
        """Store the bound of a target in a source; it replaces an earlier one."""
        with self._file_errors():
            self._db.execute(BOUNDS_TABLE)
        row = {"source_hash": source_hash, "target": target, "data": pack(bound.arrays())}
        self._insert("bounds", row, "REPLACE")

    def bounds(self, source_hash: str, target: str) -> TargetBound | None:
        """Return the bound of a target in a source; None where the file has none."""
        with self._reading():
            if not self._db.execute("SELECT 1 FROM sqlite_master WHERE name = 'bounds'").fetchone():
                return None
            sql = "SELECT data FROM bounds WHERE source_hash = ? AND target = ?"
            row = self._db.execute(sql, (source_hash, target)).fetchone()
            return None if row is None else TargetBound(**unpack(row[0]))

    def add_explanation(self, key: Key, values: Mapping[str, Any]) -> None:
        """Store the explanation of the loss of a run as JSON; it replaces an earlier one."""
        with self._file_errors():
            self._db.execute(EXPLANATIONS_TABLE)
        self._insert("explanations", {"digest": key.digest, "data": json.dumps(values)}, "REPLACE")

    def explanation(self, key: Key) -> dict[str, Any] | None:
        """Return the explanation of the loss of a run; None where the file has none."""
        with self._reading():
            if not self._db.execute("SELECT 1 FROM sqlite_master WHERE name = 'explanations'").fetchone():
                return None
            row = self._db.execute("SELECT data FROM explanations WHERE digest = ?", (key.digest,)).fetchone()
            return None if row is None else dict(json.loads(row[0]))

    def trace(self, key: Key) -> Trace | None:
        """Return the trace of a run of one target; None where it failed or is missing."""
        arrays = self.arrays(key)
        with self._reading():
            return None if arrays is None or key.task != "single" else Trace(**arrays)


def _version(cell: RunRecord) -> tuple[str, ...]:
    key = cell.key
    rest = (key.input, key.config, key.code_hash, key.task, key.weights)
    return (cell.source, cell.label, cell.scene_hash, str(key.target), key.start, *rest)


def _source(size: tuple[int, int], row: dict[str, Any]) -> SourceRow:
    return SourceRow(size=size, **row | {"changes": tuple(json.loads(row["changes"]))})


def _cell(row: dict[str, Any], scores: dict[str, float | None]) -> RunRecord:
    key = Key(**{name: row[name] for name in _KEY})
    single = key.task == "single"
    score = Score.from_dict(scores) if row["status"] == "ok" and single else None
    rest = (row["status"], row["failure"], score, row["severity"], row["outcome"], {} if single else scores)
    return RunRecord(key, one_line(row["label"]), one_line(row["name"]), row["scene_hash"], *rest)


MAX_ROWS = 40
"""Largest number of rows of the table in a notebook; the report has all rows."""


def results_card(name: str, cells: Iterable[RunRecord]) -> str:
    """Return the ranked table of each source under the name of the file, as HTML."""
    rows = summary(cells)
    more = f"<p>… {len(rows) - MAX_ROWS} more rows</p>" if len(rows) > MAX_ROWS else ""
    shown = table((*RANKED, "source"), [(*ranked_texts(row), row.source) for row in rows[:MAX_ROWS]])
    return f"<p><b>{escape(name)}</b></p>{shown}{more}"
