"""What a bench is to run: every source with its seeds, every tracker on each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import irsim
from irsim.types import Box, Input, Source
from irtrack.bench.cell import Key, SourceRow
from irtrack.bench.group import Group, Member
from irtrack.bench.specs import Entry, entry
from irtrack.errors import InputError
from irtrack.identity import code_hash, tracker_config
from irtrack.start import find_start
from irtrack.types import GivenTracker


@dataclass(frozen=True, eq=False)
class Plan:
    """One source with one seed: its row, and the group of cells wanted of it."""

    row: SourceRow
    group: Group


@dataclass(frozen=True, eq=False)
class Contestant:
    """An entry with what a key says of its tracker."""

    entry: Entry
    config: str
    code_hash: str


def contestants(trackers: Sequence[str | GivenTracker | Entry]) -> list[Contestant]:
    """The trackers of a bench; InputError where there are none or two have one label."""
    entries = [entry(tracker) for tracker in trackers]
    if not entries:
        raise InputError("no trackers; allowed: at least one, see irtrack list")
    labels = [one.label for one in entries]
    twice = [label for label in labels if labels.count(label) > 1]
    if twice:
        raise InputError(f"two trackers are labelled '{twice[0]}'; allowed: labels that differ, as in NEW={twice[0]}")
    return [
        Contestant(one, json.dumps(tracker_config(one.tracker), sort_keys=True), code_hash(one.tracker))
        for one in entries
    ]


def plans(
    sources: Sequence[str | Path | irsim.Scenario | Source],
    trackers: Sequence[Contestant],
    seeds: Sequence[int],
    input: Input,
    target: str | None,
    init: tuple[Box, int] | None,
) -> list[Plan]:
    """One plan per source and seed; InputError where two sources share a name or nothing can be measured.

    target, init as in `run_bench`.
    """
    found = []
    names: set[str] = set()
    for asked in sources:
        source = irsim.open_source(asked)
        if source.name in names:
            raise InputError(f"two sources are named '{source.name}'; allowed: names that differ")
        names.add(source.name)
        if init is None and not source.has_truth:
            raise InputError(f"{source.name} has no truth to measure by; irtrack run follows a box given by --init")
        followed = _followed(source, seeds, target, init)
        word = str(asked) if isinstance(asked, str | Path) else None
        for seeded, row, seed in _seeded(source, seeds, word):
            members = tuple(
                Member(
                    tracker.entry.label,
                    tracker.entry.tracker,
                    Key(
                        source_hash=row.hash,
                        target=followed,
                        start=_start(init),
                        input=input,
                        scene_seed=seeded.seed,
                        tracker_seed=seed,
                        config=tracker.config,
                        code_hash=tracker.code_hash,
                    ),
                )
                for tracker in trackers
            )
            found.append(Plan(row, Group(seeded, row.name, row.scene_hash, followed, init, input, members)))
    return found


def _seeded(source: Source, seeds: Sequence[int], word: str | None) -> Iterator[tuple[Source, SourceRow, int]]:
    """(source, row, tracker seed) for each seed; only a scenario's scene changes with it.

    word   how the source was named; a value from Python is named by a recording's path, or by the
           file in which the report lets one save the scenario
    """
    scene_hash = source.with_seed(0).hash
    for seed in seeds:
        seeded = source.with_seed(seed)
        kind: Literal["scenario", "recording"] = "recording" if seeded.seed is None else "scenario"
        if kind == "scenario":
            text, name = seeded.scenario_text or "", f"{source.name}.yaml"
        else:
            text = "" if source.file is None else str(source.file.resolve())
            name = text or source.name
        facts = (source.size, source.rate_hz, len(source))
        yield seeded, SourceRow(seeded.hash, scene_hash, source.name, kind, text, word or name, *facts), seed


def _followed(source: Source, seeds: Sequence[int], target: str | None, init: tuple[Box, int] | None) -> str | None:
    """Who is followed; InputError where no track can start with any of the seeds.

    With some seeds the target may never show: those cells will say so.
    """
    fault = InputError(f"{source.name}: nothing to run")
    for seed in seeds:
        seeded = source.with_seed(seed)
        try:
            return find_start(seeded, seeded.truths(), target, init).target
        except InputError as error:
            fault = error
        if seeded.seed is None:  # a recording is the same with every seed
            break
    raise fault


def _start(init: tuple[Box, int] | None) -> str:
    if init is None:
        return "visible"
    box, frame = init
    return f"{box.cx!r},{box.cy!r},{box.w!r},{box.h!r}@{frame}"
