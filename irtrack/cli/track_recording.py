"""A track as a recording of its own, which viewers open beside the source's."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from irsim import TrackHeader, TrackState, write_tracks
from irtrack.types import Estimate, Track


def record_track(track: Track, rate_hz: float, path: str | Path) -> Path:
    """Write the track and return its path; rate_hz of the source. irsim's InputError where it cannot be written."""
    header = TrackHeader(
        tracker=track.tracker,
        source=track.source,
        source_hash=track.source_hash,
        rate_hz=rate_hz,
        target=track.target,
    )
    frames = zip(track.indices.tolist(), track.times.tolist(), track.estimates, strict=True)
    write_tracks(path, header, (_state(index, time, estimate) for index, time, estimate in frames))
    return Path(path)


def _state(index: int, time: float, estimate: Estimate) -> TrackState:
    covariance = None
    if estimate.covariance is not None:
        (xx, xy), (yx, yy) = np.asarray(estimate.covariance, dtype=np.float64).tolist()
        covariance = ((xx, xy), (yx, yy))
    return TrackState(
        index=index,
        time=time,
        box=estimate.box,
        status=estimate.status,
        score=estimate.score,
        velocity=estimate.velocity,
        covariance=covariance,
        neff=estimate.neff,
    )
