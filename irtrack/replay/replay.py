"""Replay of a source: its frames, one after the other, into trackers."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from copy import copy, deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

import irsim
from irsim.render.interrupts import forks_ended
from irsim.rng import stream
from irsim.types import Box, Frame, Input, Source, Truth, read_only
from irtrack.errors import InputError, IrtrackError, TrackerError, error_line, whole_number
from irtrack.registry.identity import Runnable, tracker_config, tracker_name, tracker_needs
from irtrack.replay.start import Start, find_start
from irtrack.types import Estimate, GivenTracker, Track, Tracker
from irtrack.validity import fault

Progress = Callable[[int, int], None]
"""Called with (frames done, frames to do)."""

Pair = tuple[Frame, Truth | None]
"""Frame and its ground truth, which is None where the source has no truth."""

BLOCK_FRAMES = 64
BLOCK_BYTES = 16 * 2**20
"""Number of frames passed to one tracker at a time: so many that its first step, with cold caches, counts little."""


class Clock:
    """Frames passed to one viewer (tracker or detector), and the wall and CPU time of each of its steps."""

    def __init__(self) -> None:
        self.indices: list[int] = []
        self.times: list[float] = []
        self.step_ms: list[float] = []
        self.cpu_ms: list[float] = []

    def call(self, place: str, frame: Frame, work: Callable[[], Any]) -> Any:
        """Return the answer of a step on a frame; TrackerError for its exceptions. Its output goes to standard
        error."""
        try:
            with redirect_stdout(sys.stderr), forks_ended():
                begin, begin_cpu = time.perf_counter(), time.process_time()
                answer = work()
                took_cpu, took = time.process_time() - begin_cpu, time.perf_counter() - begin
        except IrtrackError:
            raise
        except (Exception, SystemExit, KeyboardInterrupt) as error:
            if isinstance(error, KeyboardInterrupt) and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
                raise  # Ctrl-C by the user; in workers, which ignore Ctrl-C, only a tracker can raise it
            raise TrackerError(f"{place}: {error_line(error)}") from error
        self.indices.append(frame.index)
        self.times.append(frame.time)
        self.step_ms.append(took * 1e3)
        self.cpu_ms.append(took_cpu * 1e3)
        return answer

    def columns(self) -> dict[str, Any]:
        """Return frames, times, step_ms and cpu_ms as arrays (k,)."""
        return {
            "frames": np.array(self.indices, dtype=np.int64),
            "times": np.array(self.times, dtype=np.float64),
            "step_ms": np.array(self.step_ms, dtype=np.float64),
            "cpu_ms": np.array(self.cpu_ms, dtype=np.float64),
        }


class Posed:
    """Frames as a tracker or detector gets them: with the camera's pose where it needs it, else without."""

    def __init__(self, tracker: Runnable) -> None:
        self._name = tracker_name(tracker)
        self._needed = "pose" in tracker_needs(tracker)

    def frame(self, frame: Frame) -> Frame:
        """Return the frame for the tracker. InputError where it needs the pose and the source has none."""
        if self._needed and frame.pose is None:
            raise no_pose(f"{self._name}: frame {frame.index}")
        return frame if self._needed or frame.pose is None else replace(frame, pose=None)


def no_pose(place: str) -> InputError:
    """Return the error of a source without the camera's pose."""
    return InputError(
        f"{place}: there is no camera pose, which a tracker needs; allowed: a scenario, a recording that irsim "
        "rendered, or a tracker without needs (ego_motion=image or none)"
    )


class Player:
    """Player: runs one tracker on the frames of a source, from its start frame on.

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
        self._posed = Posed(tracker)
        self.clock = Clock()
        self._estimates: list[Estimate] = []

    def see(self, frame: Frame) -> None:
        """Pass the next frame to the tracker; output of the tracker goes to standard error.

        TrackerError for exceptions of the tracker, also those that would end the program (KeyboardInterrupt only in
        workers), and for an invalid estimate. Errors of irsim and irtrack are passed on, such as the InputError of a
        shipped tracker for a frame of another size.
        """
        frame = self._posed.frame(frame)
        rng = self.generator(frame.index)
        place = f"{self.name}: frame {frame.index}"
        box = self.start.box
        if self.clock.indices:
            answer = self.clock.call(place, frame, lambda: self.tracker.step(self._state, frame, rng))
        else:
            state = self.clock.call(place, frame, lambda: self.tracker.init(frame, box, rng))
            answer = state, Estimate((box.cx, box.cy), (box.w, box.h))
        if not (isinstance(answer, tuple) and len(answer) == 2):
            given = f"a tuple of {len(answer)}" if isinstance(answer, tuple) else f"a {type(answer).__name__}"
            given = "None" if answer is None else given
            raise TrackerError(f"{place}: step gave {given}; allowed: (state, Estimate)")
        state, estimate = answer
        wrong = fault(estimate)
        if wrong is not None:
            raise TrackerError(f"{place}: {wrong}")
        self._state = state
        self._estimates.append(estimate)

    def generator(self, index: int) -> np.random.Generator:
        """Return the random generator of frame `index`, at its beginning."""
        return stream(self.seed, self.name, self.start.target or "init", index)

    def divided(self) -> Self:
        """Return a copy that goes on by itself with the same state; for a tracker with resumable states."""
        other = copy(self)
        other.clock, other._estimates = deepcopy(self.clock), list(self._estimates)
        return other

    @property
    def estimate(self) -> Estimate:
        """Last estimate of the tracker."""
        return self._estimates[-1]

    def track(self, source: Source, input: Input) -> Track:
        """Return the track so far."""
        columns = self.clock.columns()
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
            indices=columns["frames"],
            times=columns["times"],
            estimates=tuple(self._estimates),
            step_ms=columns["step_ms"],
            cpu_ms=columns["cpu_ms"],
        )


def run(
    tracker: str | GivenTracker,
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
    rate: float | None = None,
) -> Track:
    """Run one tracker over one source.

    tracker   a name of `irtrack list`, 'module:Class', or a tracker (see `irtrack.trackers.adapters`) or its class
    parameters   of a named tracker
    source    a scenario's or recording's path or name, an `irsim.Scenario`, or a Source; a Scenario does not know
              its file, so tracks call it 'scenario': `irsim.Rendering(scenario, "mine")` gives it a name
    target, init   see `irtrack.replay.start.find_start`
    seed      seed of the tracker's random generators
    frames    largest number of frames, the start frame included, 1 or more
    progress  called with (frames done, frames to do)
    rate      real time, times this factor (`irtrack.replay.real_time`): the track lacks the frames that are dropped

    TrackerError for an error of the tracker, InputError for wrong input.
    """
    chosen = named(tracker, parameters or {})
    opened = irsim.open_source(source)
    wanted = None if frames is None else whole_number("frames", frames, 1)
    start = find_start(opened, opened.truths(), target, init)
    player = Player(chosen, start, whole_number("seed", seed), label)
    stop = None if wanted is None else start.frame + wanted
    if rate is None:
        replay(opened, [player.see], input, player.start.frame, stop, progress)
    else:
        from irtrack.replay.real_time import RealTime

        camera = RealTime(player, rate)
        replay(opened, [camera.see], input, player.start.frame, stop, progress)
        camera.finish()
    return player.track(opened, input)


def replay(
    source: Source,
    viewers: Sequence[Callable[[Frame], None]],
    input: Input,
    start: int,
    stop: int | None = None,
    progress: Progress | None = None,
) -> list[Truth]:
    """Pass frames start .. stop-1 to all viewers; return their ground truth, an empty list without truth.

    The frames carry the camera's pose where the truth has it; players keep it from trackers that do not need it.

    A frame is rendered or read once for all viewers. Each viewer gets a block of frames before the next viewer does, so
    that step times are those of a tracker alone. If each frame went to all viewers in turn, the steps of the first
    viewer, after rendering, would take twice as long.
    """
    total = (len(source) if stop is None else min(stop, len(source))) - start
    shown = None if progress is None else lambda done: progress(done, total)
    return show(source.pairs(start, stop, input=input), viewers, shown)


def show(
    pairs: Iterable[Pair], viewers: Sequence[Callable[[Frame], None]], shown: Callable[[int], None] | None = None
) -> list[Truth]:
    """Pass frames to all viewers, see `replay`; `shown` is called with the mean number of frames passed to each.

    Each viewer gets pixels of its own, so that no tracker can change those of another.
    """
    truths: list[Truth] = []
    views = 0
    for block in _blocks(pairs):
        for view in viewers:
            for frame, _ in block:
                view(_own(frame))
                views += 1
                if shown is not None:
                    shown(views // len(viewers))
        truths += [truth for _, truth in block if truth is not None]
    return truths


def _blocks(pairs: Iterable[Pair]) -> Iterator[list[Pair]]:
    """Yield the pairs in blocks of BLOCK_FRAMES, or fewer where those take more than BLOCK_BYTES.

    The frames have the camera's pose of the truth.
    """
    block: list[Pair] = []
    held = 0
    for frame, truth in pairs:
        pose = None if truth is None else truth.pose
        block.append((Frame(frame.image, frame.index, frame.time, frame.bits, pose), truth))
        held += frame.image.nbytes
        if len(block) == BLOCK_FRAMES or held > BLOCK_BYTES - frame.image.nbytes:
            yield block
            block, held = [], 0
    if block:
        yield block


def _own(frame: Frame) -> Frame:
    """Return a copy of the frame with a read-only image."""
    image = read_only(frame.image.copy())
    return Frame(image, frame.index, frame.time, frame.bits, frame.pose and replace(frame.pose))


def named(tracker: str | GivenTracker, parameters: Mapping[str, object] | None = None) -> Tracker:
    """Return the tracker of a name (see `irtrack.make`), or the given tracker, wrapped where it is a plain tracker."""
    from irtrack.registry.table import make, of

    return make(tracker, parameters) if isinstance(tracker, str) else of(tracker)
