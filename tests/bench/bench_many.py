"""Speeds of trackers of many targets, and of peers, on given detections, and of their metrics: part of `make bench`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from time import perf_counter
from typing import Any

import numpy as np

from irsim.types import Box, Frame, TargetTruth, Truth
from irtrack import external as peers
from irtrack.external import DetectionSession
from irtrack.external.many_server import MANY_PEERS
from irtrack.metrics.tasks import task_scores
from irtrack.registry.table import make
from irtrack.trackers.gnn import GNN
from irtrack.trackers.jpda import JPDA
from irtrack.trackers.mht import MHT
from irtrack.trackers.multi_target import MultiTargetTracker
from irtrack.tracks import STATUSES, TrackFrame, TrackSet, stacked
from irtrack.types import Detections

TARGETS, DETECTIONS, SIZE = 40, 60, (640, 512)


def many() -> Iterator[tuple[str, float]]:
    """Yield (name, ms): a step on 60 detections with 40 tracks, and the metrics of 1,000 frames of 40 targets.

    Twenty false detections a frame are elsewhere in each frame; in `mht_60_persistent` all 60 stay, as clutter does.
    """
    for name, tracker in (("gnn", GNN(merge_px=0)), ("jpda", JPDA(merge_px=0)), ("mht", MHT(merge_px=0))):
        yield f"{name}_40_tracks_60_detections", least_ms(steps_of(tracker), detections())
    yield "mht_60_persistent_detections", least_ms(steps_of(MHT(merge_px=0)), detections(still=True))
    names = peers.offered(*MANY_PEERS)
    if not names:
        print(f"peers of many: none here; {peers.HINT}", file=sys.stderr)
    for name in names:
        yield f"{name}_40_tracks_60_detections", least_ms(peer_steps(name), detections())
    truths, tracks = sequence(1000)
    yield "metrics_of_1000_frames_40_targets", least(lambda: task_scores(tracks, truths, 30.0)) * 1e3


def detections(still: bool = False, frames: int = 60) -> Iterator[Detections]:
    """Yield the detections of moving targets and false ones, or of what stands still alone."""
    rng = np.random.default_rng(0)
    places, velocity = rng.uniform(60, 450, (TARGETS, 2)), rng.normal(0, 0 if still else 1, (TARGETS, 2))
    fixed = rng.uniform((0, 0), SIZE, (DETECTIONS - TARGETS, 2))
    for k in range(frames):
        false = fixed + rng.normal(0, 0.7, fixed.shape) if still else rng.uniform((0, 0), SIZE, fixed.shape)
        centers = np.concatenate([places + k * velocity + rng.normal(0, 0.7, places.shape), false])
        scores = np.concatenate([np.full(TARGETS, 20.0), 5 + rng.exponential(2, len(false))])
        yield Detections(centers, np.full(centers.shape, 12.0), scores)


def steps_of(tracker: MultiTargetTracker) -> Callable[[Detections], object]:
    """Return a function that steps a tracker."""
    state: Any = None

    def step(found: Detections) -> object:
        nonlocal state
        state = tracker.begin(found, SIZE) if state is None else tracker.advance(state, found)
        return state

    return step


def peer_steps(name: str) -> Callable[[Detections], object]:
    """Return a function that steps a peer, with the way to its process and back."""
    tracker: Any = make(name, {"merge_px": 0})
    session = DetectionSession(name, tracker.runs(), tracker.timeout_s)
    blank, count = np.zeros(SIZE[::-1], np.uint8), -1

    def step(found: Detections) -> object:
        nonlocal count
        count += 1
        frame = Frame(blank, count, count / 30, 8)
        if count:
            return session.step(frame, found)
        session.init(frame, found, 0)
        return None

    return step


def least_ms(step: Callable[[Detections], object], plots: Iterator[Detections]) -> float:
    """Return the least time of a step, ms, once the tracks are confirmed."""
    times = []
    for found in plots:
        begin = perf_counter()
        step(found)
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
