"""Plan of a bench: the runs of every tracker on every source with every seed."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from irsim.types import Box, Input, Source
from irtrack.bench.records import Key, RunRecord, SourceRow
from irtrack.bench.spec import AnySource, Entry, SourceEntry, SourceSpec, entry, source_specs
from irtrack.errors import InputError, whole_number
from irtrack.metrics import Trace, score_trace
from irtrack.metrics.ceiling import CEILING, IdealMatchedFilter, has_ceiling
from irtrack.metrics.tasks import Task
from irtrack.registry.identity import code_hash, tracker_config, tracker_name, tracker_needs, weights_digest
from irtrack.replay.replay import no_pose
from irtrack.replay.start import find_start
from irtrack.types import GivenTracker

Outcome = tuple[RunRecord, Mapping[str, np.ndarray] | None]
"""Record of a finished run, and its arrays by name (for the task single, those of its trace); the arrays are None where
it failed."""


@dataclass(frozen=True, eq=False)
class Member:
    """Run to be done: its tracker, tracker of many or detector under its label, and its key."""

    label: str
    tracker: Any
    key: Key


@dataclass(frozen=True, eq=False)
class Group:
    """Runs of one source, scene and task, which share its frames.

    target, init, input as in `run_bench`; scene_hash, severity as in `irtrack.bench.SourceRow`;
    members: the runs to be done.
    """

    source: Source
    name: str
    scene_hash: str
    severity: int | None
    target: str | None
    init: tuple[Box, int] | str | None
    input: Input
    task: Task
    members: tuple[Member, ...]

    def of(self, members: Sequence[Member]) -> Group:
        """Return this group with other members."""
        return replace(self, members=tuple(members))

    def failed(self, member: Member, failure: str, frame: int | None = None) -> Outcome:
        """Return the outcome of a failed run; `frame`: index of its frame, to be added to the text of the failure."""
        where = f"{self.name}, seed {member.key.tracker_seed}"
        gap = "\n" if "\n" in failure else " "
        outcome, text = failure, f"{where}:{gap}{failure}"
        if frame is not None:
            outcome = f"frame {frame}:{gap}{failure}"
            text = f"{where}, {outcome}"
        return replace(self._record(member), status="failed", failure=text, outcome=outcome), None

    def finished(self, member: Member, trace: Trace) -> Outcome:
        """Return the outcome of a finished run of the task single."""
        arrays = {field.name: getattr(trace, field.name) for field in fields(trace)}
        return replace(self._record(member), score=score_trace(trace), outcome=trace.digest), arrays

    def scored(self, member: Member, figures: dict[str, float | None], arrays: dict[str, np.ndarray]) -> Outcome:
        """Return the outcome of a finished run of another task."""
        digest = hashlib.blake2b(digest_size=16)
        for name, array in arrays.items():
            if name not in ("step_ms", "cpu_ms"):
                digest.update(f"{name} {array.dtype} {array.shape}\0".encode() + array.tobytes())
        return replace(self._record(member), figures=figures, outcome=digest.hexdigest()), arrays

    def _record(self, member: Member) -> RunRecord:
        return RunRecord(member.key, member.label, self.name, self.scene_hash, "ok", severity=self.severity)


@dataclass(frozen=True, eq=False)
class Plan:
    """One source with one scene seed: its row, and the group of its runs."""

    row: SourceRow
    group: Group


@dataclass(frozen=True, eq=False)
class TrackerSpec:
    """Tracker spec: an entry with the fields of the run key that describe its tracker."""

    entry: Entry
    config: str
    code_hash: str
    task: Task
    weights: str


def task_of(tracker: object) -> Task:
    """Return the task of a tracker, a tracker of many, or a detector."""
    task: Task = getattr(tracker, "task", "single")
    return task


def tracker_specs(trackers: Sequence[str | GivenTracker | Entry]) -> list[TrackerSpec]:
    """Return the tracker specs of a bench; InputError where there are none or two have one label."""
    entries = [entry(tracker) for tracker in trackers]
    if not entries:
        raise InputError("no trackers; allowed: at least one, see irtrack list")
    labels = [one.label for one in entries]
    twice = [label for label in labels if labels.count(label) > 1]
    if twice:
        second = [one for one in entries if one.label == twice[0]][1]
        name = tracker_name(second.tracker)
        spec = second.label if second.label.startswith(name) else name  # an entry without a label has its spec as label
        raise InputError(f"two trackers are labelled '{twice[0]}'; allowed: labels that differ, as in NEW={spec}")
    return [
        TrackerSpec(
            one,
            json.dumps(tracker_config(one.tracker), sort_keys=True),
            code_hash(one.tracker),
            task_of(one.tracker),
            weights_digest(one.tracker),
        )
        for one in entries
    ]


def _ceiling() -> list[TrackerSpec]:
    return tracker_specs([Entry(CEILING, IdealMatchedFilter())])


@dataclass(frozen=True)
class Seeds:
    """Scene seeds, by default 0, 1, ..., and the number of runs of each scene, each with another tracker seed.

    Run r of scene i has the tracker seed i + r * `APART`; a recording has tracker seeds only.
    """

    scenes: Sequence[int]
    repeats: int = 1

    @classmethod
    def of(cls, seeds: int | Iterable[int], repeats: int = 1) -> Seeds:
        """Return the seeds of a number or list; InputError for none, negative or repeated ones."""
        if isinstance(seeds, Iterable):
            found = [whole_number("seeds", seed) for seed in seeds]
        else:
            found = list(range(whole_number("seeds", seeds, 1)))
        if not found or len(set(found)) < len(found):
            raise InputError(f"seeds {seeds}: allowed: at least one, from 0 up, none twice")
        return cls(found, whole_number("tracker seeds", repeats, 1))

    def of_tracker(self, scene: int) -> Iterator[int]:
        """Return the tracker seeds of a scene seed."""
        return (scene + APART * repeat for repeat in range(self.repeats))


APART = 1000
"""Step between the tracker seeds of one scene, so that few scenes have a tracker seed in common."""


def plans(
    sources: Sequence[AnySource | SourceEntry | SourceSpec],
    trackers: Sequence[TrackerSpec],
    seeds: Seeds,
    input: Input,
    target: str | None,
    init: tuple[Box, int] | str | None,
) -> list[Plan]:
    """Return one plan per source and scene; InputError where two sources share a name or one has no truth.

    Detectors on a rendered source are joined by the ideal matched filter (`irtrack.metrics.ceiling`).

    target, init as in `run_bench`.
    """
    found: list[Plan] = []
    names: set[str] = set()
    for each in itertools.chain.from_iterable(map(source_specs, sources)):
        if each.name in names:
            other = f"NEW={each.word or each.name}"
            raise InputError(f"two sources are named '{each.name}'; allowed: names that differ, as in {other}")
        names.add(each.name)
        if init is None and not each.source.has_truth:
            raise InputError(f"{each.name} has no truth to measure by; irtrack run follows a box given by init=BOX")
        if any("pose" in tracker_needs(tracker.entry.tracker) for tracker in trackers):
            truth = each.source.truth(0)
            if truth is None or truth.pose is None:
                raise no_pose(each.name)
        tasks = list(dict.fromkeys(tracker.task for tracker in trackers))
        compared = [*trackers, *_ceiling()] if "detect" in tasks and has_ceiling(each.source) else trackers
        single = "single" in tasks
        followed = _followed(each.source, seeds.scenes, each.target or target, init) if single else None
        for (seeded, row, tracker_seeds), task in itertools.product(_seeded(each, seeds), tasks):
            members = tuple(
                Member(
                    tracker.entry.label,
                    tracker.entry.tracker,
                    Key(
                        source_hash=row.hash,
                        target=followed if task == "single" else None,
                        start=_start(init) if task == "single" else "none",
                        input=input,
                        scene_seed=seeded.seed,
                        tracker_seed=seed,
                        config=tracker.config,
                        code_hash=tracker.code_hash,
                        task=task,
                        weights=tracker.weights,
                    ),
                )
                for tracker in compared
                if tracker.task == task
                for seed in tracker_seeds
            )
            group = Group(seeded, row.name, row.scene_hash, row.severity, followed, init, input, task, members)
            found.append(Plan(row, group))
    return found


def _seeded(each: SourceSpec, seeds: Seeds) -> Iterator[tuple[Source, SourceRow, list[int]]]:
    """Yield (source, row, tracker seeds) for each scene; only the scene of a scenario changes with its seed."""
    source = each.source
    scene_hash = source.with_seed(0).hash
    for seed in seeds.scenes:
        seeded = source.with_seed(seed)
        kind: Literal["scenario", "recording"] = "recording" if seeded.seed is None else "scenario"
        if kind == "scenario":
            text, name = seeded.scenario_text or "", f"{each.name}.yaml"
        else:
            text = "" if source.file is None else str(source.file.resolve())
            name = text or each.name
        # A Python object is named by the path of its recording, or by the file name under which the report saves its
        # scenario with all changes.
        changes = () if each.word is None else each.changes
        row = SourceRow(
            hash=seeded.hash,
            scene_hash=scene_hash,
            name=each.name,
            kind=kind,
            text=text,
            word=each.word or name,
            size=source.size,
            rate_hz=source.rate_hz,
            length=len(source),
            changes=changes,
            severity=each.severity,
        )
        yield seeded, row, list(seeds.of_tracker(seed))


def _followed(
    source: Source, seeds: Sequence[int], target: str | None, init: tuple[Box, int] | str | None
) -> str | None:
    """Return the id of the tracked target; InputError where a track can start with none of the seeds.

    Runs with seeds with which the target is never visible fail later.
    """
    if isinstance(init, str):
        return None  # each run finds its own target
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


def _start(init: tuple[Box, int] | str | None) -> str:
    if init is None or isinstance(init, str):
        return init or "visible"
    box, frame = init
    return f"{box.cx!r},{box.cy!r},{box.w!r},{box.h!r}@{frame}"
