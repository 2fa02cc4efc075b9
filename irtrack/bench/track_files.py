"""Tracks and detections as files: recordings (MCAP), CSV, MOTChallenge text, and Parquet."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from irsim import TrackHeader, TrackState, read_tracks, write_tracks
from irsim.config.paths import path_of
from irsim.recording.output import atomic_file, atomic_text, check_output
from irsim.types import Box
from irtrack.detectors.from_file import DETECTION_COLUMNS, box_rows
from irtrack.errors import InputError
from irtrack.tracks import STATUSES, DetectionSet, TrackSet
from irtrack.types import Track

TABLES = (".csv", ".txt", ".parquet")
ENDINGS = (*TABLES, ".mcap")
COLUMNS = ("frame", "id", "cx", "cy", "w", "h", "score", "status", "confirmed", "class")

Values = Mapping[str, Any]
"""Row of a table: plain values by column."""


def write_track_set(tracks: TrackSet | Track, path: str | Path, rate_hz: float | None = None) -> Path:
    """Write the rows of a `TrackSet` and return the path; its ending gives the format.

    .csv, .parquet   `COLUMNS`: centre and size in px, the score blank where there is none
    .txt             MOTChallenge: frame and top-left pixel from 1 on, width, height, score, three times -1; confirmed
                     tracks only
    .mcap            recording (`irsim.write_tracks`), which viewers open beside that of the source;
                     `rate_hz`: frame rate of the source, by default that of the times of the frames

    A `Track` of one target is written as the set with one track. InputError where the file cannot be written.
    """
    path = path_of(path)
    check_output(path, endings=ENDINGS)
    tracks = TrackSet.of(tracks) if isinstance(tracks, Track) else tracks
    if path.suffix.lower() == ".mcap":
        _write_recording(tracks, path, rate_hz)
        return path
    _write_table(path, COLUMNS, rows(tracks), [row for row in rows(tracks) if row["confirmed"]])
    return path


def write_detections(found: DetectionSet, path: str | Path) -> Path:
    """Write the rows of a `DetectionSet` and return the path: .csv or .parquet with `DETECTION_COLUMNS`, or .txt, the
    det.txt of MOTChallenge with the id -1. InputError where the file cannot be written."""
    path = path_of(path)
    check_output(path, endings=TABLES)
    table = detection_rows(found)
    _write_table(path, DETECTION_COLUMNS, table, table)
    return path


def detection_rows(found: DetectionSet) -> list[dict[str, Any]]:
    """Return a row (`DETECTION_COLUMNS`) for each detection, as plain values."""
    columns = [getattr(found, name).tolist() for name in DETECTION_COLUMNS[:-1]]
    classes = found.classes or (None,) * len(found)
    return [dict(zip(DETECTION_COLUMNS, row, strict=True)) for row in zip(*columns, classes, strict=True)]


def rows(tracks: TrackSet) -> list[dict[str, Any]]:
    """Return a row (`COLUMNS`) for each track and frame, as plain values."""
    classes = tracks.classes or (None,) * len(tracks)
    numbers = [getattr(tracks, name).tolist() for name in ("frame", "id", "cx", "cy", "w", "h")]
    scores = [None if np.isnan(score) else score for score in tracks.score.tolist()]
    statuses = [STATUSES[place] for place in tracks.status.tolist()]
    columns = [*numbers, scores, statuses, tracks.confirmed.tolist(), classes]
    return [dict(zip(COLUMNS, row, strict=True)) for row in zip(*columns, strict=True)]


def _write_table(path: Path, head: Sequence[str], table: Sequence[Values], confirmed: Sequence[Values]) -> None:
    """Write rows as CSV or Parquet, or the confirmed ones as MOTChallenge text."""
    if path.suffix.lower() == ".parquet":
        parquet, pyarrow = _pyarrow(path)
        columns: dict[str, Any] = {name: [row[name] for row in table] for name in head}
        kinds = {"score": pyarrow.float64(), "status": pyarrow.string(), "class": pyarrow.string()}
        columns |= {name: pyarrow.array(columns[name], kinds[name]) for name in kinds if name in columns}
        with atomic_file(path) as file:
            parquet.write_table(pyarrow.table(columns), file)
        return
    with atomic_text(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        if path.suffix.lower() == ".csv":
            writer.writerow(head)
            writer.writerows(["" if value is None else value for value in row.values()] for row in table)
        else:
            writer.writerows(_mot_row(row) for row in confirmed)


def _mot_row(row: Values) -> list[int | float]:
    w, h = row["w"], row["h"]
    left, top = row["cx"] - (w - 1) / 2 + 1, row["cy"] - (h - 1) / 2 + 1
    score = -1.0 if row["score"] is None else row["score"]
    return [row["frame"] + 1, row.get("id", -1), left, top, w, h, score, -1, -1, -1]


def _pyarrow(path: Path) -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet needs pyarrow: pip install 'irtrack[parquet]'; or name a .csv") from None
    return parquet, pyarrow


def _write_recording(tracks: TrackSet, path: Path, rate_hz: float | None) -> None:
    times = dict(zip(tracks.frames.tolist(), tracks.times.tolist(), strict=True))
    if rate_hz is None:
        lasted = tracks.times[-1] - tracks.times[0] if len(times) > 1 else 0.0
        rate_hz = float((tracks.frames[-1] - tracks.frames[0]) / lasted) if lasted > 0 else 1.0
    header = TrackHeader(tracker=tracks.tracker, source=tracks.source, source_hash=tracks.source_hash, rate_hz=rate_hz)
    states = (
        TrackState(
            index=row["frame"],
            time=times[row["frame"]],
            box=Box(row["cx"], row["cy"], row["w"], row["h"]),
            status=row["status"],
            score=row["score"],
            id=row["id"],
            cls=row["class"],
            confirmed=row["confirmed"],
        )
        for row in rows(tracks)
    )  # fmt: skip
    write_tracks(path, header, states, times.items())


def read_track_set(path: str | Path) -> TrackSet:
    """Return the tracks of a file that `write_track_set` wrote, or of other MOTChallenge text.

    Only a recording has frames without tracks, times, and the names of tracker and source. MOTChallenge text has no
    status and no class: tracks are confirmed and "tracking", and a score of -1 means none. A recording of one target
    gives one track of id 0. InputError for a file that cannot be read, with its line.
    """
    path = path_of(path)
    ending = path.suffix.lower()
    header: dict[str, Any] = {"source": "", "source_hash": "", "tracker": path.stem}
    frames: list[tuple[int, float]] | None = None
    if ending == ".mcap":
        recording = read_tracks(path)
        header = {name: getattr(recording.header, name) for name in header}
        frames = list(recording.frames)
        table = [_of_state(state) for state in recording.states]
    elif ending == ".parquet":
        table = _read_parquet(path)
    else:
        table = _read_text(path)
    table = sorted(table, key=lambda row: row["frame"])
    if frames is None:
        frames = [(index, np.nan) for index in dict.fromkeys(row["frame"] for row in table)]
    unknown = np.full(len(frames), np.nan)
    columns = {name: np.array([row[name] for row in table]) for name in COLUMNS[:6]}
    classes = tuple(row["class"] for row in table)
    return TrackSet(
        **header,
        config={},
        input="display",
        scene_seed=None,
        tracker_seed=0,
        frames=np.array([index for index, _ in frames], np.int64),
        times=np.array([time for _, time in frames], np.float64),
        step_ms=unknown,
        cpu_ms=unknown,
        frame=columns["frame"].astype(np.int64),
        id=columns["id"].astype(np.int64),
        cx=columns["cx"].astype(np.float64),
        cy=columns["cy"].astype(np.float64),
        w=columns["w"].astype(np.float64),
        h=columns["h"].astype(np.float64),
        score=np.array([np.nan if row["score"] is None else row["score"] for row in table], np.float64),
        status=np.array([STATUSES.index(row["status"]) for row in table], np.int8),
        confirmed=np.array([row["confirmed"] for row in table], bool),
        classes=classes if any(each is not None for each in classes) else None,
    )


def _of_state(state: TrackState) -> dict[str, Any]:
    box = state.box
    confirmed = state.confirmed is not False
    values = (state.index, state.id or 0, box.cx, box.cy, box.w, box.h, state.score, state.status, confirmed, state.cls)
    return dict(zip(COLUMNS, values, strict=True))


def _read_parquet(path: Path) -> list[dict[str, Any]]:
    parquet, pyarrow = _pyarrow(path)
    try:
        table = parquet.read_table(path)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except (OSError, pyarrow.ArrowException) as error:
        raise InputError(f"{path}: is no Parquet file: {' '.join(str(error).split())[:80]}") from None
    lacking = [name for name in COLUMNS if name not in table.column_names]
    if lacking:
        raise InputError(f"{path}: no column '{lacking[0]}'; allowed: {', '.join(COLUMNS)}")
    found: list[dict[str, Any]] = table.select(COLUMNS).to_pylist()
    return found


def _read_text(path: Path) -> list[dict[str, Any]]:
    found = []
    is_csv = path.suffix.lower() == ".csv"
    seen: set[tuple[int, int]] = set()
    for row in box_rows(path, COLUMNS):
        cells = row.cells
        id = int(row.number("id", "a whole number", lambda value: value == int(value)))
        if (row.frame, id) in seen:
            raise InputError(f"{row.place}: track {id} is in frame {cells['frame']} twice; allowed: once")
        seen.add((row.frame, id))
        score = None if is_csv and not cells["score"] else row.number("score")
        if is_csv:
            row.one_of("status", STATUSES)
            row.one_of("confirmed", ("True", "False"))
        elif score == -1:
            score = None
        rest = (
            (cells["status"], cells["confirmed"] == "True", cells["class"] or None)
            if is_csv
            else (STATUSES[0], True, None)
        )
        found.append(dict(zip(COLUMNS, (row.frame, id, *_numbers(row.box), score, *rest), strict=True)))
    return found


def _numbers(box: Box) -> tuple[float, float, float, float]:
    return box.cx, box.cy, box.w, box.h
