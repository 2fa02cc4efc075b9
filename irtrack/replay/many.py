"""Replay of a source into detectors and trackers of many targets, which start by themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

import irsim
from irsim.rng import stream
from irsim.types import Box, Frame, Input, Source, Truth
from irtrack.detectors import make_detector, parse_detector
from irtrack.errors import InputError, TrackerError, whole_number
from irtrack.registry.identity import tracker_config, tracker_name
from irtrack.replay.replay import Clock, Posed, named, replay
from irtrack.replay.start import Start
from irtrack.tracks import DetectionSet, MultiTracker, TrackFrame, TrackSet, stacked
from irtrack.types import LEAST_PX, Detections, Detector
from irtrack.validity import fault_of_detections, fault_of_tracks


class ManyPlayer:
    """Replay of a source into one tracker of many targets. Frame 0 starts the tracker and gives no tracks."""

    def __init__(self, tracker: MultiTracker, seed: int = 0, label: str | None = None) -> None:
        self.tracker, self.seed = tracker, seed
        self.name, self.config = tracker_name(tracker), tracker_config(tracker)
        self.label = label or self.name
        self.clock, self._posed = Clock(), Posed(tracker)
        self._state: Any = None
        self._tracks: list[tuple[int, TrackFrame]] = []

    def see(self, frame: Frame) -> None:
        """Show the tracker the next frame. TrackerError for its exceptions and for an invalid answer."""
        frame = self._posed.frame(frame)
        rng = stream(self.seed, self.name, "many", frame.index)
        place = f"{self.name}: frame {frame.index}"
        if not self.clock.indices:
            self._state = self.clock.call(place, frame, lambda: self.tracker.init(frame, rng))
            return
        answer = self.clock.call(place, frame, lambda: self.tracker.step(self._state, frame, rng))
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise TrackerError(f"{place}: step gave {type(answer).__name__}; allowed: (state, TrackFrame)")
        self._state, tracks = answer
        if (wrong := fault_of_tracks(tracks)) is not None:
            raise TrackerError(f"{place}: {wrong}")
        self._tracks.append((frame.index, tracks))

    @property
    def last(self) -> TrackFrame | None:
        """Tracks of the last frame."""
        return self._tracks[-1][1] if self._tracks else None

    def result(self, source: Source, input: Input) -> TrackSet:
        """Return the tracks so far."""
        return TrackSet(
            source=source.name,
            source_hash=source.hash,
            tracker=self.label,
            config=self.config,
            input=input,
            scene_seed=source.seed,
            tracker_seed=self.seed,
            **self.clock.columns(),
            **stacked(self._tracks),
        )


class DetectorPlayer:
    """Replay of a source into one detector, from frame 0 on."""

    def __init__(self, detector: Detector, seed: int = 0, label: str | None = None) -> None:
        self.detector, self.seed = detector, seed
        self.name, self.config = tracker_name(detector), tracker_config(detector)
        self.label = label or self.name
        self.clock, self._posed = Clock(), Posed(detector)
        self._memory: Any = None
        self._found: list[tuple[int, Detections]] = []

    def see(self, frame: Frame) -> None:
        """Show the detector the next frame. TrackerError for its exceptions and for an invalid answer."""
        frame, place = self._posed.frame(frame), f"{self.name}: frame {frame.index}"
        answer = self.clock.call(place, frame, lambda: self.detector.step(self._memory, frame))
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise TrackerError(f"{place}: step gave {type(answer).__name__}; allowed: (memory, Detections)")
        self._memory, found = answer
        if (wrong := fault_of_detections(found)) is not None:
            raise TrackerError(f"{place}: {wrong}")
        self._found.append((frame.index, found))

    def result(self, source: Source, input: Input) -> DetectionSet:
        """Return the detections so far."""
        rows = [each for _, each in self._found]
        boxes = [np.concatenate([each.centers, each.sizes], axis=1) for each in rows]
        table = np.concatenate(boxes) if boxes else np.zeros((0, 4))
        classified = any(each.classes is not None for each in rows)
        return DetectionSet(
            source=source.name,
            source_hash=source.hash,
            detector=self.label,
            config=self.config,
            input=input,
            scene_seed=source.seed,
            **self.clock.columns(),
            frame=np.repeat([index for index, _ in self._found], [len(each) for each in rows]).astype(np.int64),
            cx=table[:, 0],
            cy=table[:, 1],
            w=table[:, 2],
            h=table[:, 3],
            score=np.concatenate([each.scores for each in rows]) if rows else np.zeros(0),
            classes=tuple(c for each in rows for c in (each.classes or (None,) * len(each))) if classified else None,
        )


def run_many(
    tracker: str | MultiTracker | Any,
    source: str | Path | irsim.Scenario | Source,
    *,
    parameters: Mapping[str, object] | None = None,
    input: Input = "display",
    seed: int = 0,
    label: str | None = None,
    frames: int | None = None,
) -> TrackSet:
    """Run one tracker of many targets over one source, from frame 0 on and without a start box.

    tracker, source, parameters, input, seed   as in `irtrack.run`;  frames  largest number of frames

    TrackerError for an error of the tracker, InputError for wrong input or a tracker of one target.
    """
    chosen: Any = named(cast(Any, tracker), parameters or {})
    if getattr(chosen, "task", "single") != "many":
        raise InputError(
            f"{tracker_name(chosen)}: follows one target from a box; allowed: irtrack.run, or gnn, jpda, mht"
        )
    opened = irsim.open_source(source)
    player = ManyPlayer(chosen, whole_number("seed", seed), label)
    replay(opened, [player.see], input, 0, None if frames is None else whole_number("frames", frames, 1))
    return player.result(opened, input)


def run_detector(
    detector: str | Detector | Any,
    source: str | Path | irsim.Scenario | Source,
    *,
    input: Input = "display",
    label: str | None = None,
    frames: int | None = None,
) -> DetectionSet:
    """Run one detector over one source, from frame 0 on.

    detector   a spec such as 'tophat:threshold=6', 'module:function', a function, a class or a `Detector`
    """
    if isinstance(detector, str):
        chosen: Any = parse_detector(detector)
    else:
        is_detector = hasattr(detector, "step") and not isinstance(detector, type)
        chosen = detector if is_detector else make_detector(cast(Any, detector))
    opened = irsim.open_source(source)
    player = DetectorPlayer(chosen, label=label)
    replay(opened, [player.see], input, 0, None if frames is None else whole_number("frames", frames, 1))
    return player.result(opened, input)


AUTO_FRAMES = 100
"""Frames within which an automatic start must find a target."""


def auto_start(source: Source, input: Input, detector: str = "lcm") -> Start:
    """Return the first confirmed track of `gnn` on a detector, as the start of a tracker of one target.

    Its `target` is the id in the ground truth that the track matches in this frame (`irtrack.metrics.comparison`), or
    None for a false start, which matches no target. InputError where no track is confirmed in the first `AUTO_FRAMES`
    frames.
    """
    player = ManyPlayer(cast(Any, named("gnn", {"detector": detector})))
    for frame, truth in source.pairs(0, min(AUTO_FRAMES, len(source)), input=input):
        player.see(frame)
        tracks = player.last
        if tracks is not None and tracks.confirmed.any():
            row = int(np.flatnonzero(tracks.confirmed)[np.argmax(tracks.scores[tracks.confirmed])])
            box = Box(*tracks.centers[row].tolist(), *tracks.sizes[row].tolist()).at_least(LEAST_PX)
            return Start(None if truth is None else _target_at(truth, box), frame.index, box)
    frames = min(AUTO_FRAMES, len(source))
    raise InputError(
        f"{source.name}: {detector} gives no confirmed track in {frames} frames; allowed: another detector, or a box"
    )


def _target_at(truth: Truth, box: Box) -> str | None:
    """Return the id of the target nearest to a box, if the centre error does not count as "off"; else None."""
    near = {
        each.id: apart
        for each in truth.targets
        if (apart := math.hypot(each.center[0] - box.cx, each.center[1] - box.cy))
        <= max(LEAST_PX, math.hypot(each.box.w, each.box.h))
    }
    return min(near, key=lambda id: near[id]) if near else None
