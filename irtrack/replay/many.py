"""Replay of a source into detectors and trackers of many targets, which start by themselves."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any

import numpy as np

from irsim.rng import stream
from irsim.types import Frame, Input, Source
from irtrack.errors import IrtrackError, TrackerError, told
from irtrack.registry.identity import tracker_config, tracker_name
from irtrack.tracks import DetectionSet, MultiTracker, TrackFrame, TrackSet, fault_of_tracks, stacked
from irtrack.types import Detections, Detector, fault_of_detections


class Clock:
    """Frames that one viewer saw, and the wall and CPU time of each of its steps."""

    def __init__(self) -> None:
        self.indices: list[int] = []
        self.times: list[float] = []
        self.step_ms: list[float] = []
        self.cpu_ms: list[float] = []

    def call(self, place: str, frame: Frame, work: Callable[[], Any]) -> Any:
        """Return the answer of a step on a frame; TrackerError of its exceptions. Its output goes to standard error."""
        try:
            with redirect_stdout(sys.stderr):
                begin, begin_cpu = time.perf_counter(), time.process_time()
                answer = work()
                took_cpu, took = time.process_time() - begin_cpu, time.perf_counter() - begin
        except IrtrackError:
            raise
        except (Exception, SystemExit, KeyboardInterrupt) as error:
            if isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
                raise  # Ctrl-C; where that is ignored, the tracker raised it
            raise TrackerError(f"{place}: {told(error)}") from error
        self.indices.append(frame.index)
        self.times.append(frame.time)
        self.step_ms.append(took * 1e3)
        self.cpu_ms.append(took_cpu * 1e3)
        return answer

    def columns(self) -> dict[str, np.ndarray]:
        """Return frames, times, step_ms and cpu_ms as arrays (k,)."""
        return {
            "frames": np.array(self.indices, dtype=np.int64),
            "times": np.array(self.times, dtype=np.float64),
            "step_ms": np.array(self.step_ms, dtype=np.float64),
            "cpu_ms": np.array(self.cpu_ms, dtype=np.float64),
        }


class ManyPlayer:
    """One tracker of many on a source, from frame 0 on, in which it reports nothing."""

    def __init__(self, tracker: MultiTracker, seed: int = 0, label: str | None = None) -> None:
        self.tracker, self.seed = tracker, seed
        self.name, self.config = tracker_name(tracker), tracker_config(tracker)
        self.label = label or self.name
        self.clock = Clock()
        self._state: Any = None
        self._tracks: list[tuple[int, TrackFrame]] = []

    def see(self, frame: Frame) -> None:
        """Show the tracker the next frame. TrackerError for its exceptions and for an invalid answer."""
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

    def tracks(self, source: Source, input: Input) -> TrackSet:
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
    """One detector on a source, from frame 0 on."""

    def __init__(self, detector: Detector, label: str | None = None) -> None:
        self.detector = detector
        self.name, self.config = tracker_name(detector), tracker_config(detector)
        self.label = label or self.name
        self.clock = Clock()
        self._memory: Any = None
        self._found: list[tuple[int, Detections]] = []

    def see(self, frame: Frame) -> None:
        """Show the detector the next frame. TrackerError for its exceptions and for an invalid answer."""
        place = f"{self.name}: frame {frame.index}"
        answer = self.clock.call(place, frame, lambda: self.detector.step(self._memory, frame))
        if not (isinstance(answer, tuple) and len(answer) == 2):
            raise TrackerError(f"{place}: step gave {type(answer).__name__}; allowed: (memory, Detections)")
        self._memory, found = answer
        if (wrong := fault_of_detections(found)) is not None:
            raise TrackerError(f"{place}: {wrong}")
        self._found.append((frame.index, found))

    def detections(self, source: Source, input: Input) -> DetectionSet:
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
