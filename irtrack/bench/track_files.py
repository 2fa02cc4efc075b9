"""Tracks of many targets as files: CSV, MOTChallenge text, and Parquet."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from irsim.config.paths import path_of
from irsim.recording.output import atomic_file, atomic_text, check_output
from irtrack.errors import InputError
from irtrack.tracks import STATUSES, TrackSet

ENDINGS = (".csv", ".txt", ".parquet")
COLUMNS = ("frame", "id", "cx", "cy", "w", "h", "score", "status", "confirmed", "class")


def write_track_set(tracks: TrackSet, path: str | Path) -> Path:
    """Write the rows of a `TrackSet` and return the path; its ending gives the format.

    .csv, .parquet   `COLUMNS`: centre and size in px, the score blank where there is none
    .txt             MOTChallenge: frame and top-left pixel from 1 on, width, height, score, three times -1; confirmed
                     tracks only

    InputError where the file cannot be written.
    """
    path = path_of(path)
    check_output(path, endings=ENDINGS)
    ending = path.suffix.lower()
    if ending == ".parquet":
        _write_parquet(tracks, path)
        return path
    with atomic_text(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        if ending == ".csv":
            writer.writerow(COLUMNS)
            writer.writerows(["" if value is None else value for value in row.values()] for row in rows(tracks))
        else:
            writer.writerows(_mot_rows(tracks))
    return path


def rows(tracks: TrackSet) -> list[dict[str, int | float | str | bool | None]]:
    """Return a row (`COLUMNS`) for each track and frame, as plain values."""
    classes = tracks.classes or (None,) * len(tracks)
    numbers = [getattr(tracks, name).tolist() for name in ("frame", "id", "cx", "cy", "w", "h")]
    scores = [None if np.isnan(score) else score for score in tracks.score.tolist()]
    statuses = [STATUSES[place] for place in tracks.status.tolist()]
    columns = [*numbers, scores, statuses, tracks.confirmed.tolist(), classes]
    return [dict(zip(COLUMNS, row, strict=True)) for row in zip(*columns, strict=True)]


def _mot_rows(tracks: TrackSet) -> list[list[int | float]]:
    found: list[list[int | float]] = []
    for k in np.flatnonzero(tracks.confirmed).tolist():
        w, h = float(tracks.w[k]), float(tracks.h[k])
        left, top = float(tracks.cx[k]) - (w - 1) / 2 + 1, float(tracks.cy[k]) - (h - 1) / 2 + 1
        score = -1.0 if np.isnan(tracks.score[k]) else float(tracks.score[k])
        found.append([int(tracks.frame[k]) + 1, int(tracks.id[k]), left, top, w, h, score, -1, -1, -1])
    return found


def _write_parquet(tracks: TrackSet, path: Path) -> None:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise InputError(f"{path}: Parquet takes pyarrow: pip install 'irtrack[parquet]'; or name a .csv") from None
    with atomic_file(path) as file:
        parquet.write_table(pyarrow.Table.from_pylist(rows(tracks)), file)
