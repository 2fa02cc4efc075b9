"""Runs of a tracker in twins of a scene, side by side; a run is over as soon as the track is lost.

Where the frames of two twins are the same so far, they share one run, which divides when their frames differ. Trackers
that do not promise resumable states (`irtrack.types.resumable`) run in each twin from the start.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import irsim
from irsim.types import Bools, Box, Frame, Input, TargetTruth
from irtrack.errors import IrtrackError
from irtrack.metrics.lost import OFF_IN_A_ROW, off_beyond
from irtrack.replay.replay import Player
from irtrack.replay.start import Start
from irtrack.runner.watchdog import Heartbeat
from irtrack.types import LEAST_PX, Tracker, resumable

Removed = frozenset[str]

WATCHED = 64
"""Number of steps in which a tracker that draws random numbers draws the first."""


@dataclass(frozen=True, eq=False)
class Task:
    """Runs of a tracker in twins of a scenario.

    first    the scenario's frame in which the track starts; the box there is the true box in each twin
    causes   names of the causes; None: those of `irsim.Twins`
    """

    scenario: irsim.Scenario
    target: str
    first: int
    tracker: Tracker
    input: Input
    causes: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Seeds:
    """Seeds of runs: each seed of the camera's noise (None: the scene's own) with each tracker seed."""

    tracker: tuple[int, ...]
    noise: tuple[int | None, ...] = (None,)


@dataclass(frozen=True, eq=False)
class Outcome:
    """Runs in one twin.

    lost_at   number of the frame of the loss for each seed, or None
    tracks    estimated and true box by time, s, for each seed, up to the loss
    views     true centre, px, and whether the target is hidden, by time, in the frames that were rendered
    draws     True where the first run drew random numbers
    """

    lost_at: tuple[int | None, ...]
    tracks: tuple[dict[float, tuple[Box, Box | None]], ...]
    views: dict[float, tuple[float, float, bool]]
    draws: bool

    @property
    def lost(self) -> Bools:
        return np.array([each is not None for each in self.lost_at], dtype=bool)


class _WatchedPlayer(Player):
    """Player that keeps the random generators of its first steps."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._given: dict[int, np.random.Generator] = {}

    def generator(self, index: int) -> np.random.Generator:
        rng = super().generator(index)
        if len(self._given) < WATCHED:
            self._given[index] = rng
        return rng

    @property
    def draws(self) -> bool:
        """True where one of the first steps drew random numbers, whatever it did with them."""
        states = ((rng, super(_WatchedPlayer, self).generator(index)) for index, rng in self._given.items())
        return any(str(rng.bit_generator.state) != str(fresh.bit_generator.state) for rng, fresh in states)


class _Run:
    """Run of the tracker in one twin with one seed, up to its loss."""

    def __init__(self, task: Task, seed: int) -> None:
        self._task, self._seed = task, seed
        self._player: _WatchedPlayer | None = None
        self._off: tuple[int, ...] = ()
        self.lost_at: int | None = None
        self.over = False
        self.track: dict[float, tuple[Box, Box | None]] = {}

    def divided(self) -> _Run:
        """Return a copy that goes on by itself."""
        other = copy(self)
        other._player = self._player and self._player.divided()
        other.track = dict(self.track)
        return other

    @property
    def draws(self) -> bool:
        return self._player is not None and self._player.draws

    def see(self, frame: Frame, target: TargetTruth | None) -> None:
        """Pass the next frame; a tracker that raises counts as lost from there on."""
        if self.over or (self._player is None and target is None):
            return
        try:
            if self._player is None and target is not None:
                start = Start(target.id, frame.index, target.box.at_least(LEAST_PX))
                self._player = _WatchedPlayer(self._task.tracker, start, self._seed)
                self._player.see(frame)
            elif self._player is not None:
                self._player.see(frame)
                self._judge(frame.index, self._player.estimate.center, target)
        except IrtrackError:
            self.lost_at, self.over = frame.index, True
            return
        if self._player is not None:
            self.track[frame.time] = self._player.estimate.box, None if target is None else target.box

    def _judge(self, index: int, center: tuple[float, float], target: TargetTruth | None) -> None:
        """Count a frame towards the loss (`irtrack.metrics.lost.LOSS_RULE`)."""
        if target is None or target.in_view is False or target.hidden:
            return
        error = math.hypot(center[0] - target.center[0], center[1] - target.center[1])
        diagonal = np.array([math.hypot(target.box.w, target.box.h)])
        is_off = error > off_beyond(diagonal, np.array([target.accuracy_px]))[0]
        self._off = (*self._off, index) if is_off else ()
        if len(self._off) == OFF_IN_A_ROW:
            self.lost_at, self.over = self._off[0], True


def play(heartbeat: Heartbeat, task: Task, removals: Sequence[Removed], seeds: Seeds) -> list[Outcome]:
    """Run the tracker in the twins with all seeds; return the outcome in each twin, seeds in the order of `Seeds`."""
    frames = _twins(task).frames(removals, task.input, seeds.noise)
    pairs = list(product(range(len(removals)), range(len(seeds.noise))))
    shared = resumable(task.tracker)
    at: dict[tuple[int, int], object] = {pair: 0 if shared else pair for pair in pairs}
    groups = {place: [_Run(task, seed) for seed in seeds.tracker] for place in at.values()}
    views: list[dict[float, tuple[float, float, bool]]] = [{} for _ in removals]
    for shown in frames:
        for each in shown:
            pair, target = (each.twin, each.noise), each.truth.target(task.target)
            if target is not None and each.noise == 0:
                views[each.twin][each.truth.time] = *target.center, target.hidden
            before, after = at[pair], each.history if shared else (pair, each.history)
            if after not in groups:
                alone = Counter(at.values())[before] == 1
                groups[after] = groups[before] if alone else [run.divided() for run in groups[before]]
                with heartbeat.frame(each.frame.index):
                    for run in groups[after]:
                        run.see(each.frame, target)
            at[pair] = after
            if all(run.over for run in groups[after]):
                frames.finish(*pair)
        groups = {place: groups[place] for place in at.values()}
    found = []
    for number in range(len(removals)):
        runs = [run for noise in range(len(seeds.noise)) for run in groups[at[number, noise]]]
        lost_at, tracks = tuple(run.lost_at for run in runs), tuple(run.track for run in runs)
        found.append(Outcome(lost_at, tracks, views[number], runs[0].draws))
    return found


_known: dict[str, irsim.Twins] = {}
"""Twins of the last task of this process: their textures take seconds to paint."""


def _twins(task: Task) -> irsim.Twins:
    key = f"{task.scenario.hash} {task.target} {task.first} {task.causes}"
    if key not in _known:
        _known.clear()
        _known[key] = irsim.Twins(task.scenario, task.target, task.first, task.causes)
    return _known[key]
