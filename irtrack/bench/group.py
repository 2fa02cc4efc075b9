"""What a worker does: one source with its seeds, all trackers over it at once."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from time import monotonic

from irsim.types import Box, Frame, Input, Source
from irtrack.bench.cell import Cell, Key
from irtrack.bench.reel import Reels
from irtrack.errors import IrtrackError, TrackerError
from irtrack.metrics import Reference, Trace, score_trace
from irtrack.replay.replay import Player, replay, show
from irtrack.replay.start import find_start
from irtrack.runner import NO_LIMIT, Limit, Unwatched, Watch
from irtrack.types import Tracker

Outcome = tuple[Cell, Trace | None]
"""A finished cell, and its track beside the truth; None where it failed."""


@dataclass(frozen=True, eq=False)
class Member:
    """A cell to be run: its tracker under its label, and its key."""

    label: str
    tracker: Tracker
    key: Key


@dataclass(frozen=True, eq=False)
class Group:
    """The cells of one source and scene that share its frames.

    target, init, input as in `run_bench`; scene_hash, severity as in `irtrack.bench.SourceRow`;
    members: what is still to be run.
    """

    source: Source
    name: str
    scene_hash: str
    severity: int | None
    target: str | None
    init: tuple[Box, int] | None
    input: Input
    members: tuple[Member, ...]

    def of(self, members: Sequence[Member]) -> Group:
        """The same with these members."""
        return replace(self, members=tuple(members))

    def failed(self, member: Member, failure: str, frame: int | None = None) -> Outcome:
        """The outcome of a member that failed; at a frame, where the failure does not say itself where it was."""
        where = f"{self.name}, seed {member.key.tracker_seed}"
        gap = "\n" if "\n" in failure else " "
        outcome, told = failure, f"{where}:{gap}{failure}"
        if frame is not None:
            outcome = f"frame {frame}:{gap}{failure}"
            told = f"{where}, {outcome}"
        return replace(self._cell(member), status="failed", failure=told, outcome=outcome), None

    def finished(self, member: Member, trace: Trace) -> Outcome:
        """The outcome of a member that went all the way."""
        return replace(self._cell(member), score=score_trace(trace), outcome=trace.digest), trace

    def _cell(self, member: Member) -> Cell:
        return Cell(member.key, member.label, self.name, self.scene_hash, "ok", severity=self.severity)


def run_group(
    group: Group, limit: Limit = NO_LIMIT, watch: Watch | None = None, reels: Reels | None = None
) -> list[Outcome]:
    """Run all members of a group. A tracker that raises fails its own cell and no other.

    limit   that a tracker has taken longer is seen when it is done with a frame: whoever must stop one that hangs
            gives a `watch`
    reels   those of the groups before, where one process runs several

    What the source raises (a damaged recording) is passed on.
    """
    source = copy(group.source)  # what it paints on the way goes with it
    reel = (reels or Reels()).of(source, group.input)
    try:
        start = find_start(source, source.truths() if reel is None else reel.truths, group.target, group.init)
    except IrtrackError as error:
        return [group.failed(member, str(error)) for member in group.members]
    attempts = [
        _Attempt(Player(member.tracker, start, member.key.tracker_seed), number, limit, watch or Unwatched())
        for number, member in enumerate(group.members)
    ]
    viewers = [attempt.see for attempt in attempts]
    if reel is None:
        reference = Reference.of(replay(source, viewers, group.input, start.frame), start.target)
    else:
        show(reel.pairs[start.frame :], viewers)
        reference = reel.reference(start.target, start.frame)
    return [
        group.failed(member, attempt.failure, attempt.at)
        if attempt.failure is not None
        else group.finished(member, Trace.of(attempt.player.track(source, group.input), reference))
        for member, attempt in zip(group.members, attempts, strict=True)
    ]


class _Attempt:
    """A player whose tracker may fail: then it sees no more."""

    def __init__(self, player: Player, number: int, limit: Limit, watch: Watch) -> None:
        self.player = player
        self.failure: str | None = None
        self.at: int | None = None
        self._number = number
        self._limit = limit
        self._spent_s = 0.0
        self._watch = watch

    def see(self, frame: Frame) -> None:
        if self.failure is not None:
            return
        begin, left = monotonic(), self._limit.left(self._spent_s)
        self._watch.begin(self._number, frame.index, begin + left)
        try:
            self.player.see(frame)
        except TrackerError as error:  # its own failure and nobody else's
            self.failure, self.at = (error.trace(), frame.index) if error.__cause__ else (str(error), None)
        except IrtrackError as error:
            self.failure = str(error)
        self._watch.end()  # not where it raised what ends the process: that was it
        took = monotonic() - begin
        self._spent_s += took
        if self.failure is None and took > left:
            self.failure, self.at = self._limit.exceeded(), frame.index
