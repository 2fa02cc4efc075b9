"""One trial: a tracker over one concrete scene, judged by the scene's rules."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import irsim
from irsim.types import Frame, Input, Source
from irtrack.errors import InputError, IrtrackError
from irtrack.falsify.apart import LostError, Run, here
from irtrack.falsify.rules import UNTRIED, margin
from irtrack.metrics import Reference, Trace
from irtrack.registry.identity import tracker_name
from irtrack.replay.replay import Player, replay
from irtrack.replay.start import find_start
from irtrack.runner import Watch
from irtrack.types import Tracker

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


def judge(subject: Subject, run: Run, scenario: irsim.Scenario | None) -> Verdict:
    """The verdict on a scene; nothing is broken where there is none, or where it shows no target to start on."""
    if scenario is None:
        return _untried(subject)
    return examine(subject, irsim.Rendering(scenario), scenario.seed, run)[0]


def examine(subject: Subject, source: Source, seed: int, run: Run = here) -> tuple[Verdict, tuple[Trace, ...]]:
    """The verdict on a source, `seed` being the tracker's, and each rule's trace; no traces where the tracker
    raised, was lost with its process or could not start."""
    try:
        return run(_examined, subject, source, seed)
    except LostError as lost:
        if not lost.blame.at_work:
            run(_drawn, source, subject.input)  # raises where the source ends processes by itself
        return Verdict(_untried(subject).margins, f"{tracker_name(subject.tracker)}: {lost}", lost.limit_s), ()


def _examined(watch: Watch, subject: Subject, source: Source, seed: int) -> tuple[Verdict, tuple[Trace, ...]]:
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
            truths = replay(source, [_watched(player, watch)], subject.input, start.frame)
        except IrtrackError as error:
            return Verdict(untried.margins, str(error)), ()
        found[target] = Trace.of(player.track(source, subject.input), Reference.of(truths, start.target))
    of_rules = tuple(found[rule.target] for rule in subject.rules)
    return Verdict(tuple(margin(rule, trace) for rule, trace in zip(subject.rules, of_rules, strict=True))), of_rules


def _drawn(_: Watch, source: Source, input: Input) -> None:
    """The source's frames, shown to nobody."""
    replay(source, [], input, 0)


def _untried(subject: Subject) -> Verdict:
    return Verdict((UNTRIED,) * len(subject.rules))


def _watched(player: Player, watch: Watch) -> Callable[[Frame], None]:
    """What shows the player a frame, and tells the watch."""

    def see(frame: Frame) -> None:
        watch.begin(0, frame.index, math.inf)
        try:
            player.see(frame)
        except IrtrackError:
            watch.end()
            raise
        watch.end()  # not where it raised what ends the process: that was it

    return see
