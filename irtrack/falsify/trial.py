"""One trial: a tracker over one concrete scene, judged by the scene's rules."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import irsim
from irsim.config.files import replacing_text
from irsim.types import Frame, Input, Source
from irtrack.errors import InputError, IrtrackError
from irtrack.falsify.rules import UNTRIED, margin
from irtrack.metrics import Reference, Trace
from irtrack.registry.identity import code_hash, module_code_hash, tracker_config, tracker_name
from irtrack.replay.replay import Player, replay
from irtrack.replay.start import find_start
from irtrack.runner.pool import InProcess, Runner
from irtrack.runner.watchdog import Heartbeat, Limit, TrackerLostError
from irtrack.types import Tracker

NO_LIMIT_S = 1e9
"""Thirty years: a number that JSON can hold."""

HERE = InProcess()

RULE = "rule"
"""How a rule of the scenario is broken: by the track."""

RAISES = "raises"
"""The rule that a tracker raises nothing; it need not be asked for."""

ENDS = "ends"
"""The rule that a tracker neither ends its process nor hangs; it need not be asked for."""


@dataclass(frozen=True, slots=True)
class Subject:
    """Who is tried: a tracker under its label, what it looks at, and the rules that it is held to."""

    label: str
    tracker: Tracker
    input: Input
    rules: tuple[irsim.Expectation, ...]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of a trial.

    margins    of each rule, below 0 where it is broken
    raised     what the tracker raised, or how its process ended, one line; None where nothing of that happened
    limit_s    what it might take for a frame where its process died, or was ended for it took longer, s; else None
    """

    margins: tuple[float, ...]
    raised: str | None = None
    limit_s: float | None = None

    @property
    def margin(self) -> float:
        """Of the rule nearest to being broken, or broken worst."""
        return -1.0 if self.raised is not None else min(self.margins)

    @property
    def broken(self) -> int | str | None:
        """Number of the rule that is broken worst, `RAISES` or `ENDS`; None where none is."""
        if self.raised is not None:
            return RAISES if self.limit_s is None else ENDS
        return self.margins.index(self.margin) if self.margin < 0 else None

    @property
    def how(self) -> str | None:
        """How something is broken: `RULE`, `RAISES` or `ENDS`; None where nothing is."""
        return RULE if isinstance(self.broken, int) else self.broken

    def breaks(self, rule: int | str) -> bool:
        """Is that rule broken, whatever the others are?"""
        return self.broken == rule if isinstance(rule, str) else self.raised is None and self.margins[rule] < 0


def frame_limit(limit_s: float | None) -> Limit:
    """Return the limit of a tracker that may take `limit_s` for each frame."""
    return Limit(NO_LIMIT_S if limit_s is None else limit_s, "frame")


def judge(subject: Subject, runner: Runner, limit: Limit, scenario: irsim.Scenario | None) -> Verdict:
    """The verdict on a scene; nothing is broken where there is none, or where it shows no target to start on."""
    if scenario is None:
        return _untried(subject)
    return examine(subject, irsim.Rendering(scenario), scenario.seed, runner, limit)[0]


def examine(
    subject: Subject, source: Source, seed: int, runner: Runner = HERE, limit: Limit | None = None
) -> tuple[Verdict, tuple[Trace, ...]]:
    """The verdict on a source, `seed` being the tracker's, and each rule's trace; no traces where the tracker
    raised, was lost with its process or could not start."""
    limit = limit or frame_limit(None)
    try:
        return runner.call(_examined, subject, source, seed, limit=limit)
    except TrackerLostError as lost:
        if not lost.blame.at_work:
            runner.call(_drawn, source, subject.input)  # raises where the source ends processes by itself
        return Verdict(_untried(subject).margins, f"{tracker_name(subject.tracker)}: {lost}", limit.seconds), ()


def _examined(heartbeat: Heartbeat, subject: Subject, source: Source, seed: int) -> tuple[Verdict, tuple[Trace, ...]]:
    untried = _untried(subject)
    try:
        targets = {rule.target for rule in subject.rules}
        starts = {target: find_start(source, source.truths(), target) for target in targets}
    except InputError:
        return untried, ()
    found: dict[str | None, Trace] = {}
    for target, start in starts.items():
        player = Player(subject.tracker, start, seed, subject.label)
        try:
            truths = replay(source, [_watched(player, heartbeat)], subject.input, start.frame)
        except IrtrackError as error:
            return Verdict(untried.margins, str(error)), ()
        found[target] = Trace.of(player.track(source, subject.input), Reference.of(truths, start.target))
    of_rules = tuple(found[rule.target] for rule in subject.rules)
    return Verdict(tuple(margin(rule, trace) for rule, trace in zip(subject.rules, of_rules, strict=True))), of_rules


def _drawn(_: Heartbeat, source: Source, input: Input) -> None:
    """The source's frames, shown to nobody."""
    replay(source, [], input, 0)


def _untried(subject: Subject) -> Verdict:
    return Verdict((UNTRIED,) * len(subject.rules))


def _watched(player: Player, heartbeat: Heartbeat) -> Callable[[Frame], None]:
    """Return the function that shows the player a frame and notes it on the heartbeat."""

    def see(frame: Frame) -> None:
        with heartbeat.frame(frame.index):
            player.see(frame)

    return see


class Trials:
    """A subject's trials. A journal, one JSON line a trial, holds those of earlier calls, so that a search that was
    stopped goes on where it was: it asks for the same scenes again. What other code judged is not among them, nor what
    died or hung within another time limit for a frame than `limit_s`."""

    def __init__(self, subject: Subject, journal: Path, runner: Runner = HERE, limit_s: float | None = None) -> None:
        self.runner, self.limit = runner, frame_limit(limit_s)
        self._subject = subject
        self._judge = partial(judge, subject, runner, self.limit)
        self._journal = journal
        self._digest = json.dumps(
            [
                tracker_config(subject.tracker),
                code_hash(subject.tracker),
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
        """Trials that were not known before."""

    def verdicts(self, scenarios: Sequence[irsim.Scenario | None]) -> Iterator[Verdict]:
        """Of each scene, in order; no more is run than is asked for, but for what has begun beside it."""
        keys = [self._key(each) for each in scenarios]
        new = {key: each for key, each in zip(keys, scenarios, strict=True) if key not in self._known}
        outcomes = self.runner.ordered(self._judge, list(new.values()))
        waiting = iter(new)
        for key in keys:
            while key not in self._known:
                self._note(next(waiting), next(outcomes))
            yield self._known[key]

    def examine(self, scenario: irsim.Scenario) -> tuple[Verdict, tuple[Trace, ...]]:
        """The verdict on a scene, and each rule's trace: run anew, and not noted."""
        return examine(self._subject, irsim.Rendering(scenario), scenario.seed, self.runner, self.limit)

    def _key(self, scenario: irsim.Scenario | None) -> str:
        text = json.dumps([self._digest, None if scenario is None else scenario.hash])
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def _note(self, key: str, verdict: Verdict) -> None:
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
    """What a journal holds; a last line that was cut off is taken away, so that others can follow."""
    try:
        text = journal.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            with replacing_text(journal) as file:
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
