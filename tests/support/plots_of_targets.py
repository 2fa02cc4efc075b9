"""Detections of targets that are known, without pictures: for trackers of many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irsim.types import Floats
from irtrack.trackers.multi_target import MultiTargetTracker
from irtrack.tracks import TrackFrame
from irtrack.types import Detections

SIZE = (320, 240)


def detections(places: Sequence[Sequence[float]] | Floats, scores: float | Floats = 20.0) -> Detections:
    """Return detections at places (n, 2) px, 5 px wide."""
    centers = np.array(places, dtype=np.float64).reshape(-1, 2)
    return Detections(centers, np.full(centers.shape, 5.0), np.broadcast_to(scores, len(centers)).astype(np.float64))


def noisy(paths: Floats, seed: int, seen: float = 0.9, false: float = 3.0, sd: float = 0.7) -> list[Detections]:
    """Return the detections of targets on paths (frames, n, 2) px, each seen with a probability, and false ones."""
    rng = np.random.default_rng(seed)
    found = []
    for places in paths:
        hits = places[rng.random(len(places)) < seen]
        clutter = rng.uniform((0, 0), SIZE, (rng.poisson(false), 2))
        scores = np.concatenate([20 * np.exp(rng.normal(0, 0.3, len(hits))), 5 + rng.exponential(2, len(clutter))])
        found.append(detections(np.concatenate([hits + rng.normal(0, sd, hits.shape), clutter]), scores))
    return found


def tracked(tracker: MultiTargetTracker, plots: Sequence[Detections]) -> list[TrackFrame]:
    """Return the tracks of each frame but the first."""
    state: Any = tracker.begin(plots[0], SIZE)
    frames = []
    for each in plots[1:]:
        state = tracker.advance(state, each)
        frames.append(state.tracks.frame())
    return frames


def track_at(frame: TrackFrame, place: Sequence[float], within: float = 5.0) -> int | None:
    """Return the id of the nearest confirmed track within so many px; None without one."""
    apart = np.hypot(*(frame.centers - np.array(place)).T)
    apart = np.where(frame.confirmed, apart, np.inf)
    return int(frame.ids[apart.argmin()]) if len(apart) and apart.min() < within else None
