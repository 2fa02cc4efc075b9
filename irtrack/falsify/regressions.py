"""Failures that are kept: a small scene, its recording, and whether the tracker that broke on it still does."""

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
from irsim.config.files import make_folder, path_of, replacing, replacing_text
from irsim.types import Input
from irtrack.errors import InputError, IrtrackError, whole
from irtrack.falsify.outputs import MINIMAL, file_stem
from irtrack.falsify.rules import NOTED, in_words, rules_of
from irtrack.falsify.trial import HERE, NO_LIMIT_S, Subject, Verdict, examine, frame_limit
from irtrack.registry.identity import changed_parameters, tracker_config
from irtrack.runner.pool import Pool, Runner, start_runner
from irtrack.runner.watchdog import Heartbeat, Limit

KEPT = Path("scenarios") / "regressions"
"""Where failures are kept unless another folder is named."""

ROUNDING = 1
"""Counts by which a frame may be rendered otherwise than it was recorded: machines round differently."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A kept failure.

    path                 its scene; the recording lies beside it
    label                who broke there;  tracker, parameters  made of these
    input                what the tracker looks at
    broken               was what the scene expects broken when this was last noted?
    how                  it was broken then: `RULE`, `RAISES` or `ENDS`; None: not, or an older note does not say
    limit_s              what it might take for a frame then, s: it runs in a process of its own, and hangs where it
                         takes longer; None: there was no limit, and it runs in this one
    fault                what is wrong with its note, or that its scene or frames are missing: it cannot be tried, and
                         all but `path` says nothing; None: nothing
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

    def __str__(self) -> str:
        return self.path.stem

    @property
    def recording(self) -> Path:
        return self.path.with_suffix(".mcap")

    @property
    def note(self) -> Path:
        return self.path.with_suffix(".json")

    def verdict(self, scene: irsim.Scenario, runner: Runner = HERE, limit: Limit | None = None) -> Verdict:
        """Of the tracker as it is now, on the recorded frames, by the rules of the scene."""
        from irtrack.registry.table import make

        subject = Subject(self.label, make(self.tracker, self.parameters), self.input, rules_of(scene))
        return examine(subject, irsim.open_recording(self.recording), scene.seed, runner, limit)[0]

    def changes(self, runner: Runner | None = None, limit_s: float | None = None) -> list[str]:
        """What is otherwise than it was noted, a line each; none where all is as it was.

        runner, limit_s   where it is tried, and its limit for a frame, s; by `limit_s` of the note by default

        InputError, with its file, where it cannot be judged.
        """
        with self._errors_with_file():
            if runner is not None:
                return self._changes(runner, limit_s)
            with start_runner(1, apart=self.limit_s is not None) as own:
                return self._changes(own, self.limit_s)

    def _changes(self, runner: Runner, limit_s: float | None) -> list[str]:
        found = []
        scene = irsim.load(self.path)
        if (frame := runner.call(_rendered_otherwise, scene, self.recording)) is not None:
            found.append(f"{self.path}: renders frame {frame} otherwise than {self.recording.name} has it")
        verdict = self.verdict(scene, runner, frame_limit(limit_s))
        rules = ", ".join(map(in_words, rules_of(scene)))
        if verdict.broken is None and self.broken:
            found.append(f"{self.path}: {self.label} breaks {rules} no more, margin {verdict.margin:.3g}")
        why = verdict.raised or f"margin {verdict.margin:.3g}"
        if verdict.broken is not None and not self.broken:
            found.append(f"{self.path}: {self.label} breaks {rules} again, {why}")
        elif verdict.how is not None and self.how not in (verdict.how, None):
            was, now = NOTED[self.how][0].format(rules=rules), NOTED[verdict.how][1].format(rules=rules)
            found.append(f"{self.path}: {self.label} {was}, now it {now}: {why}")
        return found

    def bless(self, runner: Runner | None = None, limit_s: float | None = None) -> Kept:
        """Note what is so now: record the frames that the scene renders, and whether and how they break the tracker.
        InputError as of `changes`.

        runner, limit_s   where it is tried, and its limit for a frame, s; by `limit_s` of the note unless said
        """
        with self._errors_with_file():
            if runner is not None:
                return self._bless(runner, limit_s)
            with start_runner(1, apart=self.limit_s is not None) as own:
                return self._bless(own, self.limit_s)

    def _bless(self, runner: Runner, limit_s: float | None) -> Kept:
        scene = irsim.load(self.path)
        if runner.call(_rendered_otherwise, scene, self.recording) is not None:
            irsim.record(irsim.Rendering(scene, self.path.stem), self.recording, compression="zstd")
        verdict = self.verdict(scene, runner, frame_limit(limit_s))
        now = replace(self, broken=verdict.broken is not None, how=verdict.how, limit_s=limit_s)
        _note(now)
        return now

    @contextmanager
    def _errors_with_file(self) -> Iterator[None]:
        if self.fault is not None:
            raise InputError(self.fault)
        try:
            yield
        except IrtrackError as error:
            known = str(self.path.with_suffix("")) in str(error)
            raise InputError(str(error) if known else f"{self.note}: {error}") from None


def kept_failures(folder: str | Path = KEPT) -> list[Kept]:
    """The failures kept in a folder, by name; those that cannot be tried too, so that each is told (`Kept.fault`)."""
    return [_read(path) for path in sorted(path_of(folder).glob("*.json"))]


def _rendered_otherwise(_: Heartbeat, scene: irsim.Scenario, recording: Path) -> int | None:
    """The first frame that the scene renders otherwise than it was recorded."""
    drawn, kept = irsim.Rendering(scene), irsim.open_recording(recording)
    for one, other in zip(drawn.frames(), kept.frames(), strict=False):
        if np.abs(one.image.astype(np.int32) - other.image).max() > ROUNDING:
            return int(one.index)
    return None if len(drawn) == len(kept) else min(len(drawn), len(kept))


@dataclass(frozen=True, slots=True)
class Revisited:
    """What came of kept failures: `changes`, what is otherwise than it was noted, a line each; `faults`, why some could
    not be judged, each with its file."""

    changes: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def revisit(kept: Sequence[Kept], jobs: int = 1, bless: bool = False, frame_limit_s: float = NO_LIMIT_S) -> Revisited:
    """Try all of them, by `jobs` worker processes; with `bless`, what is so now is noted then.

    frame_limit_s   a tracker that takes longer for a frame hangs, where its failure has no limit of its own
    """
    whole("jobs", jobs, 1)
    with Pool(jobs) as pool:

        def tried(each: Kept) -> Revisited:
            limit_s = frame_limit_s if each.limit_s is None else each.limit_s
            try:
                changes = each.changes(pool, limit_s)
                if bless:
                    each.bless(pool, limit_s)
                return Revisited(changes)
            except InputError as error:
                return Revisited(faults=[str(error)])

        found = list(pool.ordered(tried, kept))
    return Revisited(
        [line for each in found for line in each.changes], [line for each in found for line in each.faults]
    )


def keep(
    found: Path, subject: Subject, name: str, how: str | None, folder: Path = KEPT, limit_s: float | None = None
) -> Kept:
    """Keep the failure whose minimal.yaml and minimal.mcap are in `found`; once, however often it is found. `how` and
    `limit_s` as of `Kept`."""
    make_folder(folder)
    scene = irsim.load(found / f"{MINIMAL}.yaml")
    config = tracker_config(subject.tracker)
    stem = file_stem(name, subject.label)
    path = folder / f"{stem}.yaml"
    number = 2
    while path.exists() and not _holds(path, scene):
        path, number = folder / f"{stem}-{number}.yaml", number + 1
    # Not the defaults: what is tried later is the tracker as it will be.
    kept = Kept(path, subject.label, config["tracker"], changed_parameters(config), subject.input, True, how, limit_s)
    new = [each for each in (kept.path, kept.recording, kept.note) if not each.exists()]
    try:
        with replacing(kept.recording) as file:
            file.write((found / f"{MINIMAL}.mcap").read_bytes())
        with replacing_text(kept.path) as text:
            text.write(_head(found / f"{MINIMAL}.yaml") + irsim.dumps(scene, short=True, folder=folder))
        _note(kept)
    except BaseException:
        for each in new:
            each.unlink(missing_ok=True)
        raise
    return kept


def _holds(path: Path, scene: irsim.Scenario) -> bool:
    """Does the file say the same scene, with the same rules? Not one that cannot be read: what it names has changed."""
    try:
        kept = irsim.load(path)
    except InputError:
        return False
    return (kept.hash, kept.expect) == (scene.hash, scene.expect)


def _head(path: Path) -> str:
    """The comments that a scene's file begins with."""
    with path.open(encoding="utf-8") as lines:
        return "".join(takewhile(lambda line: line.startswith("#"), lines))


def _note(kept: Kept) -> None:
    values = {key: value for key, value in asdict(kept).items() if key not in ("path", "fault")}
    with replacing_text(kept.note) as file:
        file.write(json.dumps(values, indent=1) + "\n")


def _read(note: Path) -> Kept:
    path = note.with_suffix(".yaml")
    try:
        kept = Kept(path, **json.loads(note.read_text(encoding="utf-8")))
        if kept.how not in (None, *NOTED):
            raise ValueError(f"how '{kept.how}': allowed: {', '.join(NOTED)}")
    except (OSError, ValueError, TypeError) as error:
        return _unreadable(path, f"{note}: is no note of a kept failure: {error}")
    for needed in (kept.path, kept.recording):
        if not needed.is_file():
            return _unreadable(path, f"{needed}: is missing; {note.name} speaks of it")
    return kept


def _unreadable(path: Path, fault: str) -> Kept:
    return Kept(path, path.stem, "", {}, "display", broken=True, fault=fault)
