"""Tracks as files: CSV, values for JSON, and recordings that viewers open beside their source."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

from irsim import TrackHeader, write_tracks
from irsim.config.paths import path_of
from irsim.recording.output import atomic_text
from irtrack.replay.live import track_state
from irtrack.types import Estimate, Track

COLUMNS = ("frame", "time_s", "cx", "cy", "w", "h", "status", "score", "vx", "vy", "neff", "ms")
"""Columns of the CSV file: centre and size in px, velocity in px/frame; blank where the tracker gives no value."""


def track_to_csv(track: Track, path: str | Path) -> Path:
    """Write one row for each frame (`COLUMNS`). InputError where the folder or the file cannot be written."""
    path = path_of(path)
    with atomic_text(path) as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        for row in _rows(track):
            writer.writerow(["" if row[name] is None else row[name] for name in COLUMNS])
    return path


def track_as_dict(track: Track) -> dict[str, Any]:
    """Return the track as plain values for JSON: tracker, source, and a row for each frame."""
    box = track.start_box
    return {
        "source": track.source,
        "source_hash": track.source_hash,
        "tracker": track.tracker,
        "config": track.config,
        "target": track.target,
        "start": {"frame": track.start, "cx": box.cx, "cy": box.cy, "w": box.w, "h": box.h},
        "input": track.input,
        "scene_seed": track.scene_seed,
        "tracker_seed": track.tracker_seed,
        "frames": _rows(track),
    }


def _rows(track: Track) -> list[dict[str, Any]]:
    per_frame = zip(track.indices.tolist(), track.times.tolist(), track.estimates, track.step_ms.tolist(), strict=True)
    return [
        {"frame": index, "time_s": seconds, **_estimate(estimate), "ms": round(ms, 4)}
        for index, seconds, estimate, ms in per_frame
    ]


def _estimate(estimate: Estimate) -> dict[str, Any]:
    vx, vy = estimate.velocity or (None, None)
    return {
        "cx": float(estimate.center[0]),
        "cy": float(estimate.center[1]),
        "w": float(estimate.size[0]),
        "h": float(estimate.size[1]),
        "status": estimate.status,
        "score": _number(estimate.score),
        "vx": _number(vx),
        "vy": _number(vy),
        "neff": _number(estimate.neff),
    }


def _number(value: float | None) -> float | None:
    return float(value) if value is not None and math.isfinite(value) else None


def record_track(track: Track, rate_hz: float, path: str | Path) -> Path:
    """Write the track as a recording and return its path; `rate_hz`: frame rate of the source. Errors as in irsim."""
    header = TrackHeader(
        tracker=track.tracker,
        source=track.source,
        source_hash=track.source_hash,
        rate_hz=rate_hz,
        target=track.target,
    )
    frames = zip(track.indices.tolist(), track.times.tolist(), track.estimates, strict=True)
    write_tracks(path, header, (track_state(index, time, estimate) for index, time, estimate in frames))
    return Path(path)
