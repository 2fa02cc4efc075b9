"""Trials, each a run of a tracker or detector on one concrete scene, judged by its rules; a journal of verdicts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import irsim
from irsim.recording.output import atomic_text
from irsim.types import Frame, Input, Source
from irtrack.bench.plan import task_of
from irtrack.errors import InputError, IrtrackError
from irtrack.falsify.rules import ENDS, RAISES, RULE, UNTESTED, Evidence, margin
from irtrack.falsify.scene_rules import SceneTrace
from irtrack.metrics import Reference, Trace
from irtrack.metrics.tasks import Task
from irtrack.registry.identity import code_hash, module_code_hash, tracker_config, tracker_name, weights_digest
from irtrack.replay.many import DetectorPlayer, ManyPlayer
from irtrack.replay.replay import Player, replay
from irtrack.replay.start import find_start
from irtrack.runner.pool import InProcess, Runner
from irtrack.runner.watchdog import Heartbeat, Limit, TrackerLostError

NO_LIMIT_S = 1e9
"""Time for a frame, s, that stands for no limit, as a number that JSON can hold: thirty years."""

HERE = InProcess()


@dataclass(frozen=True, slots=True)
class Subject:
    """Subject: the tracker, tracker of many or detector under test, its label and input, and the rules that it must
    keep."""

    label: str
    tracker: Any
    input: Input
    rules: tuple[irsim.Expectation, ...]

    @property
    def task(self) -> Task:
        return task_of(self.tracker)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Result of a trial.

    margins    margin of each rule, below 0 where the rule is broken
    raised     exception of the tracker, or how its process ended, in one line; None without either
    limit_s    time limit for a frame, s, where the process died or hung; else None
    """

    margins: tuple[float, ...]
    raised: str | None = None
    limit_s: float | None = None

    @property
    def margin(self) -> float:
        """Least margin of all rules; -1 where the tracker raised an exception or its process ended."""
        return -1.0 if self.raised is not None else min(self.margins)

    @property
    def broken(self) -> int | str | None:
        """Number of the rule with the least margin, `RAISES` or `ENDS`; None where no rule is broken."""
        if self.raised is not None:
            return RAISES if self.limit_s is None else ENDS
        return self.margins.index(self.margin) if self.margin < 0 else None

    @property
    def how(self) -> str | None:
        """Kind of failure: `RULE`, `RAISES` or `ENDS`; None without a failure."""
        return RULE if isinstance(self.broken, int) else self.broken

    def breaks(self, rule: int | str) -> bool:
        """Return whether this rule (its number, `RAISES` or `ENDS`) is broken."""
        return self.broken == rule if isinstance(rule, str) else self.raised is None and self.margins[rule] < 0


def frame_limit(limit_s: float | None) -> Limit:
    """Return the limit of `limit_s` for each frame; no limit for None."""
    return Limit(NO_LIMIT_S if limit_s is None else limit_s, "frame")


def judge(subject: Subject, runner: Runner, limit: Limit, scenario: irsim.Scenario | None) -> Verdict:
    """Return the verdict on a scene; no rule counts as broken without a valid scene or without a target to start on."""
    if scenario is None:
        return _untried(subject)
    return examine(subject, irsim.Rendering(scenario), scenario.seed, runner, limit)[0]


def examine(
    subject: Subject, source: Source, seed: int, runner: Runner = HERE, limit: Limit | None = None
) -> tuple[Verdict, tuple[Evidence, ...]]:
    """Run the tracker on a source; return the verdict and the trace of each rule. `seed`: seed of the tracker.

    There are no traces where the tracker raised, its process died or hung, or it could not start.
    """
    limit = limit or frame_limit(None)
    try:
        return runner.call(_examined, subject, source, seed, limit=limit)
    except TrackerLostError as lost:
        if not lost.blame.at_work:
            runner.call(_drawn, source, subject.input)  # raises where the source, not the tracker, ends the process
        return Verdict(_untried(subject).margins, f"{tracker_name(subject.tracker)}: {lost}", limit.seconds), ()


def _examined(
    heartbeat: Heartbeat, subject: Subject, source: Source, seed: int
) -> tuple[Verdict, tuple[Evidence, ...]]:
    untried = _untried(subject)
    traced: Callable[..., tuple[Evidence, ...]] = _target_traces if subject.task == "single" else _scene_traces
    try:
        found = traced(heartbeat, subject, source, seed)
    except _NoStartError:
        return untried, ()
    except IrtrackError as error:
        return Verdict(untried.margins, str(error)), ()
    margins = (margin(rule, trace) for rule, trace in zip(subject.rules, found, strict=True))
    return Verdict(tuple(margins)), found


class _NoStartError(Exception):
    """A scene has no target to start on."""


def _target_traces(heartbeat: Heartbeat, subject: Subject, source: Source, seed: int) -> tuple[Trace, ...]:
    """Return the trace of each rule for a tracker of one target."""
    try:
        targets = {rule.target for rule in subject.rules}
        starts = {target: find_start(source, source.truths(), target) for target in targets}
    except InputError:
        raise _NoStartError from None
    found: dict[str | None, Trace] = {}
    for target, start in starts.items():
        player = Player(subject.tracker, start, seed, subject.label)
        truths = replay(source, [_watched(player, heartbeat)], subject.input, start.frame)
        found[target] = Trace.of(player.track(source, subject.input), Reference.of(truths, start.target))
    return tuple(found[rule.target] for rule in subject.rules)


def _scene_traces(heartbeat: Heartbeat, subject: Subject, source: Source, seed: int) -> tuple[SceneTrace, ...]:
    """Return a trace for each rule: that of the whole scene, by a multi-target tracker or a detector, for all rules."""
    kind = DetectorPlayer if subject.task == "detect" else ManyPlayer
    player = kind(subject.tracker, seed, subject.label)
    truths = replay(source, [_watched(player, heartbeat)], subject.input, 0)
    return (SceneTrace(player.result(source, subject.input), tuple(truths), source.rate_hz),) * len(subject.rules)


def _drawn(_: Heartbeat, source: Source, input: Input) -> None:
    """Read all frames of a source without a tracker, to see whether the source itself ends the process."""
    replay(source, [], input, 0)


def _untried(subject: Subject) -> Verdict:
    return Verdict((UNTESTED,) * len(subject.rules))


def _watched(player: Player | ManyPlayer | DetectorPlayer, heartbeat: Heartbeat) -> Callable[[Frame], None]:
    """Return a function that passes a frame to the player and records the frame in the heartbeat."""

    def see(frame: Frame) -> None:
        with heartbeat.frame(frame.index):
            player.see(frame)

    return see


class Trials:
    """Trials of a subject, with a journal of one JSON line a trial, from which an interrupted search resumes.

    Entries of the journal count only where the same code made them; an entry of a process that died or hung counts only
    with the same limit for a frame.

    run   number of trials run so far, without those taken from the journal
    """

    def __init__(self, subject: Subject, journal: Path, runner: Runner = HERE, limit_s: float | None = None) -> None:
        self.runner, self.limit = runner, frame_limit(limit_s)
        self._subject = subject
        self._judge = partial(judge, subject, runner, self.limit)
        self._journal = journal
        self._digest = json.dumps(
            [
                tracker_config(subject.tracker),
                code_hash(subject.tracker),
                weights_digest(subject.tracker),
                subject.input,
                [[rule.kind, rule.model_dump()] for rule in subject.rules],
                module_code_hash(judge.__module__),
            ],
            sort_keys=True,
        )
        self._known = {
            key: verdict for key, verdict in _read(journal).items() if verdict.limit_s in (None, self.limit.seconds)
        }
        self.run = 0

    def verdicts(self, scenarios: Sequence[irsim.Scenario | None]) -> Iterator[Verdict]:
        """Yield the verdict on each scene, in order; scenes run when needed, or ahead of need in other workers."""
        keys = [self._key(each) for each in scenarios]
        new = {key: each for key, each in zip(keys, scenarios, strict=True) if key not in self._known}
        outcomes = self.runner.ordered(self._judge, list(new.values()))
        waiting = iter(new)
        for key in keys:
            while key not in self._known:
                self._add(next(waiting), next(outcomes))
            yield self._known[key]

    def examine(self, scenario: irsim.Scenario) -> tuple[Verdict, tuple[Evidence, ...]]:
        """Run a scene anew, without the journal; return the verdict and the trace of each rule."""
        return examine(self._subject, irsim.Rendering(scenario), scenario.seed, self.runner, self.limit)

    def _key(self, scenario: irsim.Scenario | None) -> str:
        text = json.dumps([self._digest, None if scenario is None else scenario.hash])
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def _add(self, key: str, verdict: Verdict) -> None:
        self._known[key] = verdict
        self.run += 1
        row: dict[str, Any] = {"trial": key, "margins": verdict.margins, "raised": verdict.raised}
        if verdict.limit_s is not None:
            row["limit_s"] = verdict.limit_s
        line = json.dumps(row)
        try:
            with self._journal.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise InputError(f"{self._journal}: cannot be written: {error.strerror or error}") from None


def _read(journal: Path) -> dict[str, Verdict]:
    """Return the entries of a journal; an incomplete last line is removed."""
    try:
        text = journal.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            with atomic_text(journal) as file:
                file.write(whole)
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{journal}: cannot be used as a journal of trials: {error}") from None
    known: dict[str, Verdict] = {}
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            row = json.loads(line)
            known[row["trial"]] = Verdict(tuple(map(float, row["margins"])), row["raised"], row.get("limit_s"))
        except (ValueError, TypeError, KeyError):
            raise InputError(f"{journal}:{number}: is no trial; allowed: a journal of irtrack falsify") from None
    return known
