"""Replay: the frames of a source, one after the other, into trackers."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import irsim
from irsim.rng import stream
from irsim.types import Box, Frame, Input, Source, Truth
from irtrack.errors import IrtrackError
from irtrack.identity import tracker_config, tracker_name
from irtrack.start import Start, find_start
from irtrack.types import Estimate, Track, Tracker, fault

Progress = Callable[[int, int], None]
"""Called with (frames done, frames to do)."""


class Player:
    """One tracker on its way through a source, from its start frame on.

    The generator of frame k is ``stream(seed, tracker's name, target or "init", k)``.
    """

    def __init__(self, tracker: Tracker, start: Start, seed: int = 0, label: str | None = None) -> None:
        self.tracker = tracker
        self.start = start
        self.seed = seed
        self.name = tracker_name(tracker)
        self.config = tracker_config(tracker)
        self.label = label or self.name
        self._state: Any = None
        self._frames: list[tuple[int, float]] = []
        self._estimates: list[Estimate] = []
        self._step_ms: list[float] = []

    def see(self, frame: Frame) -> None:
        """Show the tracker the next frame. What it raises is passed on."""
        rng = stream(self.seed, self.name, self.start.target or "init", frame.index)
        begin = time.perf_counter()
        if self._frames:
            self._state, estimate = self.tracker.step(self._state, frame, rng)
        else:
            self._state = self.tracker.init(frame, self.start.box, rng)
            box = self.start.box
            estimate = Estimate((box.cx, box.cy), (box.w, box.h))
        self._step_ms.append((time.perf_counter() - begin) * 1e3)
        wrong = fault(estimate)
        if wrong is not None:
            raise IrtrackError(f"{self.name}: frame {frame.index}: {wrong}")
        self._frames.append((frame.index, frame.time))
        self._estimates.append(estimate)

    def track(self, source: Source, input: Input) -> Track:
        """What the tracker has said so far."""
        return Track(
            source=source.name,
            source_hash=source.hash,
            tracker=self.label,
            config=self.config,
            target=self.start.target,
            start=self.start.frame,
            start_box=self.start.box,
            input=input,
            scene_seed=source.seed,
            tracker_seed=self.seed,
            indices=np.array([index for index, _ in self._frames], dtype=np.int64),
            times=np.array([seconds for _, seconds in self._frames], dtype=np.float64),
            estimates=tuple(self._estimates),
            step_ms=np.array(self._step_ms),
        )


def run(
    tracker: str | Tracker,
    source: str | Path | irsim.Scenario | Source,
    *,
    parameters: Mapping[str, object] | None = None,
    target: str | None = None,
    init: tuple[Box, int] | None = None,
    input: Input = "display",
    seed: int = 0,
    label: str | None = None,
    frames: int | None = None,
    progress: Progress | None = None,
) -> Track:
    """Run one tracker over one source.

    tracker   a name of `irtrack list`, 'module:Class', or a tracker;  parameters  of a named one
    source    a scenario's or recording's path or name, an `irsim.Scenario`, or a Source
    target, init   see `irtrack.start.find_start`
    seed      of the tracker's generators
    frames    at most so many, the start frame included
    progress  called with (frames done, frames to do)

    What a tracker raises is passed on. InputError (of irtrack or irsim) for bad input.
    """
    chosen = _tracker(tracker, parameters or {})
    opened = irsim.open_source(source)
    player = Player(chosen, find_start(opened, opened.truths(), target, init), seed, label)
    stop = None if frames is None else player.start.frame + frames
    replay(opened, [player.see], input, player.start.frame, stop, progress)
    return player.track(opened, input)


def replay(
    source: Source,
    viewers: Sequence[Callable[[Frame], None]],
    input: Input,
    start: int,
    stop: int | None = None,
    progress: Progress | None = None,
) -> list[Truth]:
    """Show frames start .. stop-1 to all viewers, each frame to all before the next; return what is true of them.

    So a frame is rendered or read once, truth and all, however many trackers look at it, and no more
    than one is held in memory. Nothing is true where the source has no truth.
    """
    total = (len(source) if stop is None else min(stop, len(source))) - start
    truths: list[Truth] = []
    for done, (frame, truth) in enumerate(source.pairs(start, stop, input=input), start=1):
        shown = _read_only(frame)
        for view in viewers:
            view(shown)
        if truth is not None:
            truths.append(truth)
        if progress is not None:
            progress(done, total)
    return truths


def _read_only(frame: Frame) -> Frame:
    """The frame with an image that no tracker can change under the next one."""
    image = frame.image.view()
    image.flags.writeable = False
    return Frame(image, frame.index, frame.time, frame.bits)


def _tracker(tracker: str | Tracker, parameters: Mapping[str, object]) -> Tracker:
    if not isinstance(tracker, str):
        return tracker
    from irtrack.trackers import make

    return make(tracker, parameters)
