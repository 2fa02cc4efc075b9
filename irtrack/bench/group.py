"""What a worker does: one source with its seeds, all trackers over it at once."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

from irsim.types import Box, Frame, Input, Source
from irtrack.bench.cell import Cell, Key
from irtrack.errors import IrtrackError, TrackerError
from irtrack.metrics import Reference, Trace, score_trace
from irtrack.replay import Player, replay
from irtrack.start import find_start
from irtrack.types import Tracker


@dataclass(frozen=True, eq=False)
class Group:
    """The cells of one source that share its frames.

    target, init, input as in `run_bench`; members: what is still to be run.
    """

    source: Source
    name: str
    scene_hash: str
    target: str | None
    init: tuple[Box, int] | None
    input: Input
    members: tuple[Member, ...]


@dataclass(frozen=True, eq=False)
class Member:
    """A cell to be run: its tracker under its label, and its key."""

    label: str
    tracker: Tracker
    key: Key


def run_group(group: Group) -> list[tuple[Cell, Trace | None]]:
    """Run all members of a group. A tracker that raises fails its own cell and no other.

    What the source raises (a damaged recording) is passed on.
    """
    source = copy(group.source)  # what it paints on the way goes with it
    try:
        start = find_start(source, source.truths(), group.target, group.init)
    except IrtrackError as error:
        return [(_failed(group, member, str(error)), None) for member in group.members]
    attempts = [
        _Attempt(Player(member.tracker, start, seed), f"{group.name}, seed {seed}")
        for member in group.members
        for seed in [member.key.tracker_seed]
    ]
    truths = replay(source, [attempt.see for attempt in attempts], group.input, start.frame)
    reference = Reference.of(truths, start.target)
    outcomes: list[tuple[Cell, Trace | None]] = []
    for member, attempt in zip(group.members, attempts, strict=True):
        if attempt.failure is not None:
            outcomes.append((_failed(group, member, attempt.failure), None))
            continue
        track = attempt.player.track(source, group.input)
        trace = Trace.of(track, reference)
        cell = Cell(member.key, member.label, group.name, group.scene_hash, "ok", score=score_trace(trace))
        outcomes.append((cell, trace))
    return outcomes


class _Attempt:
    """A player whose tracker may fail: then it sees no more."""

    def __init__(self, player: Player, place: str) -> None:
        self.player = player
        self.place = place
        self.failure: str | None = None

    def see(self, frame: Frame) -> None:
        if self.failure is not None:
            return
        try:
            self.player.see(frame)
        except TrackerError as error:  # its own failure and nobody else's
            self.failure = f"{self.place}, frame {frame.index}:\n{error.trace()}" if error.__cause__ else str(error)
        except IrtrackError as error:
            self.failure = str(error)


def _failed(group: Group, member: Member, failure: str) -> Cell:
    return Cell(member.key, member.label, group.name, group.scene_hash, "failed", failure)
