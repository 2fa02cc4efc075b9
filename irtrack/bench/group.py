"""What a worker does: one source with its seeds, all trackers over it at once."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import irsim
from irsim.types import Box, Frame, Input, Source, Truth
from irtrack.bench.cell import Cell, Key, Trace
from irtrack.errors import InputError
from irtrack.metrics import Reference, score
from irtrack.replay import Player, replay
from irtrack.start import find_start
from irtrack.types import Track, Tracker


@dataclass(frozen=True, eq=False)
class Group:
    """The cells of one source that share its frames.

    source is a Source, or a Scenario whose textures the worker paints; target, init, input as in
    `run_bench`; members: what is still to be run.
    """

    source: Source | irsim.Scenario
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
    scenario = group.source if isinstance(group.source, irsim.Scenario) else None
    source = group.source if scenario is None else irsim.Rendering(scenario, group.name)
    try:
        start = find_start(source, source.truths(), group.target, group.init)
    except InputError as error:
        return [(_failed(group, member, str(error)), None) for member in group.members]
    attempts = [_Attempt(Player(member.tracker, start, member.key.tracker_seed)) for member in group.members]
    truths: list[Truth] = []
    replay([attempt.see for attempt in attempts], _frames(source, start.frame, group.input, truths))
    reference = Reference.of(truths, start.target)
    outcomes: list[tuple[Cell, Trace | None]] = []
    for member, attempt in zip(group.members, attempts, strict=True):
        if attempt.failure is not None:
            outcomes.append((_failed(group, member, attempt.failure), None))
            continue
        track = attempt.player.track(source, group.input)
        figures = score(track, reference)
        cell = Cell(member.key, member.label, group.name, group.scene_hash, "ok", score=figures)
        outcomes.append((cell, trace(track, reference)))
    return outcomes


def _frames(source: Source, start: int, input: Input, truths: list[Truth]) -> Iterator[Frame]:
    """The frames from `start` on; their truths are appended to `truths` on the way.

    A scenario gives both in one go: asked for them apart it would draw every scene twice.
    """
    if isinstance(source, irsim.Rendering):
        for frame, truth in source.pairs(start, input=input):
            truths.append(truth)
            yield frame
    else:
        truths.extend(source.truths(start))
        yield from source.frames(input, start)


class _Attempt:
    """A player whose tracker may fail: then it sees no more."""

    def __init__(self, player: Player) -> None:
        self.player = player
        self.failure: str | None = None

    def see(self, frame: Frame) -> None:
        if self.failure is not None:
            return
        try:
            self.player.see(frame)
        except Exception:  # whatever a tracker raises is its own failure and nobody else's
            self.failure = f"frame {frame.index}:\n{traceback.format_exc()}"


def _failed(group: Group, member: Member, failure: str) -> Cell:
    return Cell(member.key, member.label, group.name, group.scene_hash, "failed", failure)


def trace(track: Track, reference: Reference) -> Trace:
    """A track and its truth, frame by frame."""
    truth = reference.at(track.indices)
    return Trace(
        indices=track.indices,
        centers=track.centers,
        sizes=track.sizes,
        statuses=np.array(track.statuses, dtype=np.str_),
        truth_centers=truth.centers,
        truth_sizes=truth.sizes,
        visible=truth.visible,
        accuracy=truth.accuracy,
        step_ms=track.step_ms,
    )
