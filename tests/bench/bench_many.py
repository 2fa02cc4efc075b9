"""Speeds of trackers of many targets on given detections, and of their metrics: part of `make bench`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import numpy as np

from irsim.types import Box, TargetTruth, Truth
from irtrack.metrics.tasks import task_scores
from irtrack.trackers.gnn import GNN
from irtrack.trackers.jpda import JPDA
from irtrack.trackers.multi_target import MultiTargetTracker
from irtrack.tracks import STATUSES, TrackFrame, TrackSet, stacked
from irtrack.types import Detections

TARGETS, DETECTIONS, SIZE = 40, 60, (640, 512)


def many() -> Iterator[tuple[str, float]]:
    """Yield (name, ms): a step on 60 detections with 40 tracks, and the metrics of 1,000 frames of 40 targets."""
    for name, tracker in (("gnn", GNN(merge_px=0)), ("jpda", JPDA(merge_px=0))):
        yield f"{name}_40_tracks_60_detections", least_ms(tracker)
    truths, tracks = sequence(1000)
    yield "metrics_of_1000_frames_40_targets", least(lambda: task_scores(tracks, truths, 30.0)) * 1e3


def least_ms(tracker: MultiTargetTracker) -> float:
    """Return the least time of a step, ms, once the tracks are confirmed."""
    rng = np.random.default_rng(0)
    places, velocity = rng.uniform(60, 450, (TARGETS, 2)), rng.normal(0, 1, (TARGETS, 2))
    state: Any = None
    times = []
    for k in range(60):
        false = rng.uniform((0, 0), SIZE, (DETECTIONS - TARGETS, 2))
        centers = np.concatenate([places + k * velocity + rng.normal(0, 0.7, places.shape), false])
        scores = np.concatenate([np.full(TARGETS, 20.0), 5 + rng.exponential(2, len(false))])
        found = tracker.strongest(Detections(centers, np.full(centers.shape, 5.0), scores))
        begin = perf_counter()
        state = tracker.begin(found, SIZE) if state is None else tracker.advance(state, found)
        times.append(perf_counter() - begin)
    return min(times[20:]) * 1e3


def sequence(frames: int) -> tuple[list[Truth], TrackSet]:
    """Return targets that drift apart, and a track for each, 1 px off."""
    rng = np.random.default_rng(0)
    places, velocity = rng.uniform(0, 600, (TARGETS, 2)), rng.normal(0, 0.3, (TARGETS, 2))
    truths, tracks, sizes = [], [], np.full((TARGETS, 2), 6.0)
    for k in range(frames):
        now = places + k * velocity
        targets = (TargetTruth(f"t{i}", (x, y), Box(x, y, 6, 6)) for i, (x, y) in enumerate(now.tolist()))
        truths.append(Truth(k, k / 30, tuple(targets)))
        near = now + rng.normal(0, 1, now.shape)
        ids, ones = np.arange(TARGETS), np.ones(TARGETS)
        tracks.append((k, TrackFrame(ids, near, sizes, ones, STATUSES[:1] * TARGETS, ones.astype(bool))))
    index, none = np.arange(frames), np.zeros(frames)
    return truths, TrackSet("s", "h", "t", {}, "display", 0, 0, index, index / 30, none, none, **stacked(tracks))


def least(work: Callable[[], object]) -> float:
    """Return the least time of three, s."""
    times = []
    for _ in range(3):
        begin = perf_counter()
        work()
        times.append(perf_counter() - begin)
    return min(times)
