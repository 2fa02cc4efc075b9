"""Kept failures: a small scene, its recording, and a note of the tracker that fails on it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

import irsim
from irsim.config.paths import path_of
from irsim.recording.output import atomic_file, atomic_text, make_folder
from irsim.types import Input
from irtrack.detectors import make_detector
from irtrack.errors import InputError, IrtrackError, whole_number
from irtrack.falsify.outputs import MINIMAL, file_stem
from irtrack.falsify.rules import FAILURES, rule_text, rules_of
from irtrack.falsify.trial import HERE, NO_LIMIT_S, Subject, Verdict, examine, frame_limit
from irtrack.metrics.tasks import FIGURES_OF, Task
from irtrack.registry.identity import changed_parameters, tracker_config
from irtrack.runner.pool import Pool, Runner, start_runner
from irtrack.runner.watchdog import Heartbeat, Limit

KEPT = Path("scenarios") / "regressions"
"""Default folder of kept failures."""

ROUNDING = 1
"""Counts by which a rendered frame may differ from the recorded one, since machines round differently."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Kept failure.

    path                 scene file; the recording lies beside it
    label                label of the tracker;  tracker, parameters  its name, and its parameters that differ from the
                         defaults
    input                input of the tracker
    broken               True: the tracker broke a rule of the scene at the last update
    how                  kind of failure at the last update: `RULE`, `RAISES` or `ENDS`; None: no failure, or a note of
                         an older version
    limit_s              limit for a frame, s: the tracker runs in a worker process; None: no limit, in this process
    task                 task of the tracker, which decides which rules of the scene count
    fault                error in the note, or a missing file: only `path` is valid; None: no error
    """

    path: Path
    label: str
    tracker: str
    parameters: Mapping[str, Any]
    input: Input
    broken: bool
    how: str | None = None
    limit_s: float | None = None
    fault: str | None = None
    task: Task = "single"

    def __str__(self) -> str:
        return self.path.stem

    @property
    def recording(self) -> Path:
        return self.path.with_suffix(".mcap")

    @property
    def note(self) -> Path:
        return self.path.with_suffix(".json")

    def verdict(self, scene: irsim.Scenario, runner: Runner = HERE, limit: Limit | None = None) -> Verdict:
        """Judge the present tracker on the recorded frames by the rules of the scene."""
        from irtrack.registry.table import make

        made = (make_detector if self.task == "detect" else make)(self.tracker, self.parameters)
        subject = Subject(self.label, made, self.input, rules_of(scene, self.task))
        return examine(subject, irsim.open_recording(self.recording), scene.seed, runner, limit)[0]

    def changes(self, runner: Runner | None = None, limit_s: float | None = None) -> list[str]:
        """Judge the tracker anew and return the differences from the note, a line each.

        runner, limit_s   runner, and limit for a frame, s; by default those in the note

        InputError, with the file, where the failure cannot be judged.
        """
        found = []
        with self._judging(runner, limit_s) as (used, limit):
            scene = irsim.load(self.path)
            if (frame := used.call(_first_changed_frame, scene, self.recording)) is not None:
                found.append(f"{self.path}: frame {frame} differs from {self.recording.name}")
            verdict = self.verdict(scene, used, frame_limit(limit))
        rules = ", ".join(map(rule_text, rules_of(scene, self.task)))
        if verdict.broken is None and self.broken:
            found.append(f"{self.path}: {self.label} no longer breaks {rules}, margin {verdict.margin:.3g}")
        why = verdict.raised or f"margin {verdict.margin:.3g}"
        if verdict.broken is not None and not self.broken:
            found.append(f"{self.path}: {self.label} breaks {rules} again, {why}")
        elif verdict.how is not None and self.how not in (verdict.how, None):
            was, now = FAILURES[self.how][0].format(rules=rules), FAILURES[verdict.how][1].format(rules=rules)
            found.append(f"{self.path}: {self.label} {was}, now it {now}: {why}")
        return found

    def update(self, runner: Runner | None = None, limit_s: float | None = None) -> Kept:
        """Record the frames anew where they differ, and note the verdict. Arguments and errors as for `changes`."""
        with self._judging(runner, limit_s) as (used, limit):
            scene = irsim.load(self.path)
            if used.call(_first_changed_frame, scene, self.recording) is not None:
                irsim.record(irsim.Rendering(scene, self.path.stem), self.recording, compression="zstd")
            verdict = self.verdict(scene, used, frame_limit(limit))
            now = replace(self, broken=verdict.broken is not None, how=verdict.how, limit_s=limit)
            _note(now)
        return now

    @contextmanager
    def _judging(self, runner: Runner | None, limit_s: float | None) -> Iterator[tuple[Runner, float | None]]:
        """Yield the runner and the time limit, by default those in the note; errors raised in the block name the
        file."""
        if self.fault is not None:
            raise InputError(self.fault)
        try:
            if runner is not None:
                yield runner, limit_s
                return
            with start_runner(1, apart=self.limit_s is not None) as own:
                yield own, self.limit_s
        except IrtrackError as error:
            known = str(self.path.with_suffix("")) in str(error)
            raise InputError(str(error) if known else f"{self.note}: {error}") from None


def kept_failures(folder: str | Path = KEPT, trust: bool = False) -> list[Kept]:
    """Return the failures kept in a folder, sorted by name, including those with a `fault`.

    trust   True: trackers of the notes may run commands (`program`, `trax`); else these have a `fault`

    InputError where there is no such folder.
    """
    if not path_of(folder).is_dir():
        raise InputError(f"{folder}: there is no such folder in {Path.cwd()}; allowed: a folder of kept failures")
    return [_read(path, trust) for path in sorted(path_of(folder).glob("*.json"))]


def _first_changed_frame(_: Heartbeat, scene: irsim.Scenario, recording: Path) -> int | None:
    """Return the first frame at which the rendered scene differs from the recording; None where they agree."""
    drawn, kept = irsim.Rendering(scene), irsim.open_recording(recording)
    for one, other in zip(drawn.frames(), kept.frames(), strict=False):
        if np.abs(one.image.astype(np.int32) - other.image).max() > ROUNDING:
            return int(one.index)
    return None if len(drawn) == len(kept) else min(len(drawn), len(kept))


@dataclass(frozen=True, slots=True)
class Regressions:
    """Result of judging kept failures: `changes`, the differences from the notes, and `faults`, the reasons why some
    could not be judged; a line each."""

    changes: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def check_kept(
    kept: Sequence[Kept], jobs: int = 1, update: bool = False, frame_limit_s: float = NO_LIMIT_S
) -> Regressions:
    """Judge kept failures in `jobs` worker processes; with `update`, note the present verdicts.

    frame_limit_s   limit for a frame, s, of failures without a limit of their own
    """
    whole_number("jobs", jobs, 1)
    with Pool(jobs) as pool:

        def check(each: Kept) -> Regressions:
            limit_s = frame_limit_s if each.limit_s is None else each.limit_s
            try:
                changes = each.changes(pool, limit_s)
                if update:
                    each.update(pool, limit_s)
                return Regressions(changes)
            except InputError as error:
                return Regressions(faults=[str(error)])

        found = list(pool.ordered(check, kept))
    return Regressions(
        [line for each in found for line in each.changes], [line for each in found for line in each.faults]
    )


def keep(
    found: Path, subject: Subject, name: str, how: str | None, folder: Path = KEPT, limit_s: float | None = None
) -> Kept:
    """Keep the failure whose minimal.yaml and minimal.mcap are in `found`; the same scene is kept once.

    how, limit_s   as in `Kept`
    """
    make_folder(folder)
    scene = irsim.load(found / f"{MINIMAL}.yaml")
    config = tracker_config(subject.tracker)
    stem = file_stem(name, subject.label)
    path = folder / f"{stem}.yaml"
    number = 2
    while path.exists() and not _holds(path, scene):
        path, number = folder / f"{stem}-{number}.yaml", number + 1
    # Only changed parameters are noted: a later version of the tracker runs with its own defaults.
    kept = Kept(
        path,
        subject.label,
        config["tracker"],
        changed_parameters(config),
        subject.input,
        broken=True,
        how=how,
        limit_s=limit_s,
        task=subject.task,
    )
    new = [each for each in (kept.path, kept.recording, kept.note) if not each.exists()]
    try:
        with atomic_file(kept.recording) as file:
            file.write((found / f"{MINIMAL}.mcap").read_bytes())
        with atomic_text(kept.path) as text:
            text.write(_head(found / f"{MINIMAL}.yaml") + irsim.dumps(scene, short=True, folder=folder))
        _note(kept)
    except BaseException:
        for each in new:
            each.unlink(missing_ok=True)
        raise
    return kept


def _holds(path: Path, scene: irsim.Scenario) -> bool:
    """Return whether a file holds this scene with its rules; False where the file cannot be read."""
    try:
        kept = irsim.load(path)
    except InputError:
        return False
    return (kept.hash, kept.expect) == (scene.hash, scene.expect)


def _head(path: Path) -> str:
    """Return the comment lines at the head of a scene's file."""
    with path.open(encoding="utf-8") as lines:
        return "".join(takewhile(lambda line: line.startswith("#"), lines))


def _note(kept: Kept) -> None:
    values = {key: value for key, value in asdict(kept).items() if key not in ("path", "fault")}
    with atomic_text(kept.note) as file:
        file.write(json.dumps(values, indent=1) + "\n")


def _read(note: Path, trust: bool) -> Kept:
    from irtrack.registry.table import check_trusted

    path = note.with_suffix(".yaml")
    try:
        kept = Kept(path, **json.loads(note.read_text(encoding="utf-8")))
        if kept.how not in (None, *FAILURES):
            raise ValueError(f"how '{kept.how}': allowed: {', '.join(FAILURES)}")
        if kept.task not in FIGURES_OF:
            raise ValueError(f"task '{kept.task}': allowed: {', '.join(FIGURES_OF)}")
    except (OSError, ValueError, TypeError) as error:
        return _unreadable(path, f"{note}: is no note of a kept failure: {error}")
    try:
        check_trusted(kept.tracker, kept.parameters, trust)
    except (InputError, TypeError, AttributeError) as error:
        return _unreadable(path, f"{note}: {error}")
    for needed in (kept.path, kept.recording):
        if not needed.is_file():
            return _unreadable(path, f"{needed}: is missing; {note.name} names it")
    return kept


def _unreadable(path: Path, fault: str) -> Kept:
    return Kept(path, path.stem, "", {}, "display", broken=True, fault=fault)
