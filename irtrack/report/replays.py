"""Replays: frames, truth and tracks of a run as data for the page's script."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from irsim.types import Box, Floats, Frame, Image, Source
from irtrack.bench import RunRecord
from irtrack.errors import IrtrackError
from irtrack.metrics import Trace
from irtrack.registry.identity import code_hash, tracker_of_config
from irtrack.replay.replay import Player, replay
from irtrack.replay.start import Start
from irtrack.report.frames import Follower
from irtrack.types import resumable

PICTURE_BYTES = 1_200_000
"""Largest size of the pictures of one replay, bytes, before base64, which adds a third."""

SCALES = (1.0, 0.75, 0.5)
"""Scales of the pictures, tried in turn until all frames fit; at the last scale frames are left out."""

QUALITY = 70
"""Quality of the JPEG pictures."""

PARTICLES = 60
"""Number of points drawn of a particle set, resampled by weight."""

PARTICLE_GRID = 65535
"""Number of steps of a point's coordinates from edge to edge of the frame: 16 bits each."""


@dataclass(frozen=True)
class Replay:
    """Data of a replay: strict JSON without '<', safe inside a script element.

    stride   every stride-th frame is kept
    labels   labels of the trackers, in the order of the data
    """

    data: str
    stride: int
    labels: tuple[str, ...]
    has_particles: bool


def replayed(
    source: Source, cells: Sequence[RunRecord], followers: Sequence[Follower], clouds: int
) -> tuple[Replay, int]:
    """Return the replay of runs, and the number of runs that were repeated to obtain their particles.

    source      source with the scene seed of the runs;  followers  tracks of the runs
    clouds      largest number of runs to repeat, since the results file keeps no particles
    """
    indices = np.unique(np.concatenate([follower.trace.indices for follower in followers]))
    scale, stride = fitted(source, indices)
    kept = indices[::stride]
    repeats = _repeats(cells, followers, source, clouds)
    pictures: dict[int, str] = {}
    times: dict[int, float] = {}
    wanted = set(kept.tolist())

    def keep(frame: Frame) -> None:
        if frame.index in wanted:
            pictures[frame.index] = base64.b64encode(jpeg(frame.image, scale)).decode()
            times[frame.index] = frame.time

    shown = [repeat.see for repeat in repeats if repeat.input == "display"]
    start, stop = int(indices[0]), int(indices[-1]) + 1
    replay(source, [keep, *shown], "display", start, stop)
    counted = [repeat.see for repeat in repeats if repeat.input == "counts"]
    if counted:
        replay(source, counted, "counts", start, stop)
    particles = {repeat.label: repeat.points(wanted, source.size) for repeat in repeats}
    data = {
        "size": list(source.size),
        "rate": source.rate_hz,
        "indices": kept.tolist(),
        "times": [round(times[index], 4) for index in kept.tolist()],
        "pictures": [pictures[index] for index in kept.tolist()],
        "truth": _truth(followers, kept),
        "trackers": [_tracker(follower, kept, particles.get(follower.label, {})) for follower in followers],
    }
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    labels = tuple(follower.label for follower in followers)
    return Replay(text, stride, labels, any(particles.values())), len(repeats)


def fitted(source: Source, indices: np.ndarray, most_bytes: int = PICTURE_BYTES) -> tuple[float, int]:
    """Return the picture scale and frame stride that keep a replay within a size, estimated from a few frames."""
    probes = indices[np.linspace(0, len(indices) - 1, min(4, len(indices))).round().astype(int)]
    images = [source.frame(int(index), "display").image for index in probes]
    for scale in SCALES:
        total = len(indices) * float(np.mean([len(jpeg(image, scale)) for image in images]))
        if total <= most_bytes:
            return scale, 1
    return SCALES[-1], int(np.ceil(total / most_bytes))


def jpeg(image: Image, scale: float) -> bytes:
    """Return an image as JPEG, scaled."""
    small = image if scale == 1 else cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return cv2.imencode(".jpg", np.ascontiguousarray(small), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()


def _truth(followers: Sequence[Follower], kept: np.ndarray) -> dict[str, Any]:
    """Return boxes and visible fractions of the target at the kept frames; null where unknown."""
    boxes, visible = [], []
    for index in kept.tolist():
        knowing = next((one for one in followers if one.row(index) is not None), None)
        row = None if knowing is None else knowing.row(index)
        boxes.append(None if knowing is None else _numbers(knowing.truth(index)))
        visible.append(None if knowing is None or row is None else _number(knowing.trace.visible[row], 2))
    return {"boxes": boxes, "visible": visible}


def _tracker(follower: Follower, kept: np.ndarray, particles: Mapping[int, str]) -> dict[str, Any]:
    trace = follower.trace
    rows = [follower.row(index) for index in kept.tolist()]
    neffs = [None if row is None else _number(trace.neffs[row], 1) for row in rows]
    scores = [None if row is None else _number(trace.scores[row], 3) for row in rows]
    return {
        "label": follower.label,
        "color": follower.style.color,
        "dash": list(follower.style.dash),
        "boxes": [_numbers(follower.box(index)) for index in kept.tolist()],
        "status": ["" if row is None else str(trace.statuses[row]) for row in rows],
        "off": [row is not None and bool(trace.off[row]) for row in rows],
        "errors": [None if row is None else _number(trace.errors[row], 1) for row in rows],
        "neffs": neffs if any(each is not None for each in neffs) else None,
        "scores": scores if any(each is not None for each in scores) else None,
        "lost": follower.lost_at,
        "particles": [particles.get(index) for index in kept.tolist()] if particles else None,
    }


def _numbers(box: Box | None) -> list[float] | None:
    return None if box is None else [round(value, 2) for value in (box.cx, box.cy, box.w, box.h)]


def _number(value: float, digits: int) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None


class _Repeat:
    """Run repeated to obtain its particles. It stops where the tracker has no particles, or an estimate differs from
    the measured run."""

    def __init__(self, cell: RunRecord, trace: Trace, player: Player) -> None:
        self.label = cell.label
        self.input = cell.key.input
        self._trace = trace
        self._player = player
        self._clouds: dict[int, tuple[Floats, Floats | None]] = {}
        self._ended = False

    def see(self, frame: Frame) -> None:
        step = len(self._clouds)
        if self._ended or frame.index < self._player.start.frame:
            return
        try:
            self._player.see(frame)
        except IrtrackError:
            self._ended = True
            return
        estimate = self._player.estimate
        same = frame.index == self._trace.indices[step] and np.allclose(estimate.center, self._trace.centers[step])
        if not same or (estimate.particles is None and step > 0):
            self._ended = True
            return
        points = np.empty((0, 2)) if estimate.particles is None else np.asarray(estimate.particles)[:, :2]
        self._clouds[frame.index] = points, estimate.weights

    def points(self, wanted: set[int], size: tuple[int, int]) -> dict[int, str]:
        """Return PARTICLES points of each wanted frame, as base64 of little-endian x, y of 16 bits."""
        if len(self._clouds) < len(self._trace.indices):
            return {}
        return {
            index: _packed(_drawn(points, weights), size)
            for index, (points, weights) in self._clouds.items()
            if index in wanted and len(points)
        }


def _drawn(points: Floats, weights: Floats | None) -> Floats:
    """Resample PARTICLES points by weight (systematic, from the middle of each step)."""
    shares = np.full(len(points), 1 / len(points)) if weights is None else np.asarray(weights)
    places = (np.arange(PARTICLES) + 0.5) / PARTICLES
    return np.asarray(points[np.searchsorted(np.cumsum(shares), places).clip(max=len(points) - 1)])


def _packed(points: Floats, size: tuple[int, int]) -> str:
    shares = np.clip((points + 0.5) / np.array(size), 0, 1)
    return base64.b64encode(np.round(shares * PARTICLE_GRID).astype("<u2").tobytes()).decode()


def _repeats(cells: Sequence[RunRecord], followers: Sequence[Follower], source: Source, most: int) -> list[_Repeat]:
    """Return at most `most` runs that can be repeated, as their tracker is available and its code unchanged."""
    tracks = {follower.label: follower.trace for follower in followers}
    found: list[_Repeat] = []
    for cell in cells:
        if len(found) == most:
            break
        trace = tracks.get(cell.label)
        if trace is None or np.isnan(trace.neffs).all():  # a tracker without Neff has no particles
            continue
        tracker = tracker_of_config(cell.config)
        if tracker is None or not resumable(tracker) or code_hash(tracker) != cell.key.code_hash:
            continue
        box = Box(*map(float, (*trace.centers[0], *trace.sizes[0])))
        start = Start(cell.key.target, int(trace.indices[0]), box)
        found.append(_Repeat(cell, trace, Player(tracker, start, cell.key.tracker_seed)))
    return found
