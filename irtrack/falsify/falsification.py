"""Falsification of a tracker or detector: find a failure, repeat it, test its seed sensitivity, shrink its scene."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import irsim
from irsim.errors import counted
from irsim.rng import stream
from irsim.types import Floats
from irtrack.falsify.counterexample import Candidate, all_moves, removable_parts, shrink
from irtrack.falsify.rules import IMPLICIT, UNTESTED, frames_to_break, rule_text
from irtrack.falsify.search import SearchPoint, search
from irtrack.falsify.trial import Subject, Trials, Verdict
from irtrack.metrics import wilson

FRESH = 20
"""Default number of fresh seeds (not used in the search) that test the seed sensitivity of a failure."""

FRESH_WHILE_SHRINKING = 5
"""Number of fresh seeds that test if the failure of a simpler candidate is still structural; also the least value of
the option `fresh`."""

STRUCTURAL = 0.8
"""Least share of failing fresh seeds at which a failure counts as structural, not seed-dependent. Of 20 seeds 16 must
fail; a failure in half of all seeds reaches this with probability 1/170 (binomial)."""

UNREPEATABLE = "warning: the benign point has another outcome when it is run again: the tracker is not deterministic"

Say = Callable[[str], None]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class SeedSensitivity:
    """Fresh seeds of scene and tracker: the number that break the same rule, and the number run."""

    broken: int
    seeds: int

    @property
    def is_structural(self) -> bool:
        return self.broken >= STRUCTURAL * self.seeds

    def in_words(self) -> str:
        low, high = wilson(self.broken, self.seeds)
        kind = "structural" if self.is_structural else "seed-dependent"
        return f"{kind}: {self.broken} of {self.seeds} fresh seeds break it too ({low:.0%} to {high:.0%})"


@dataclass(frozen=True, slots=True)
class Failure:
    """Failure: the broken rule, with the counterexample as found and as shrunk.

    rule               number of the rule, `RAISES` or `ENDS`
    run                number of the run that found it, from 1; 0: the benign point, which is tried first
    found              counterexample of the search;  sensitivity  its sensitivity to fresh seeds
    repeats            True: another run of the counterexample has the same outcome, bit for bit
    least              smallest counterexample of the same rule
    least_sensitivity  seed sensitivity of `least`; None where the search was interrupted before its test
    """

    rule: int | str
    run: int
    found: Candidate
    sensitivity: SeedSensitivity
    repeats: bool
    least: Candidate
    least_sensitivity: SeedSensitivity | None = None


@dataclass(frozen=True, slots=True)
class NoFailure:
    """Result of a search without a failure: the least margin, the point with this margin, the number of runs.

    untried   texts of rules that no run tested
    """

    margin: float
    point: dict[str, Any]
    runs: int
    untried: tuple[str, ...] = ()


class Falsification:
    """Search of one scenario's parameter space for a failure of one tracker under test, the subject.

    failure   smallest failure so far, also of an interrupted search; None before the first
    """

    def __init__(
        self,
        scenario: irsim.Scenario,
        subject: Subject,
        trials: Trials,
        say: Say = lambda line: None,
        fresh: int = FRESH,
        name: str = "scenario",
        command: str | None = None,
    ) -> None:
        self.space = irsim.variations(scenario)
        self.subject = subject
        self.trials = trials
        self.name, self.command = name, command
        self.failure: Failure | None = None
        self._say = say
        self._fresh = fresh

    def run(self, kind: str, budget: int, seed: int, progress: Progress | None = None) -> Failure | NoFailure:
        """Search with at most `budget` runs; return the shrunk failure, or the least margin."""
        found = self._search(kind, budget, seed, progress)
        if isinstance(found, NoFailure):
            return found
        run, candidate, verdict = found
        rule = verdict.broken
        assert rule is not None
        self._say(f"run {run}: {verdict.raised or f'{self.broken(rule)}, margin {verdict.margin:.3g}'}")
        repeats = self._repeats(candidate, verdict)
        self._say("repeated bit for bit" if repeats else "not repeated: the tracker is not deterministic")
        sensitivity = self._sensitivity(candidate, rule)
        self._say(sensitivity.in_words())
        self.failure = Failure(rule, run, candidate, sensitivity, repeats, candidate)
        if repeats:  # an unrepeatable failure cannot be shrunk
            self._shrink(rule)
            self._shorten(rule)
        least = self._sensitivity(self.failure.least, rule)
        self.failure = replace(self.failure, least_sensitivity=least)
        self._say(counted(self.trials.run, "new trial"))
        return self.failure

    def broken(self, rule: int | str) -> str:
        """Return the failure of a rule in words."""
        return IMPLICIT[rule][0] if isinstance(rule, str) else f"{rule_text(self.subject.rules[rule])} is broken"

    def scene(self, candidate: Candidate) -> irsim.Scenario:
        """Return the scene of a valid candidate."""
        scene = candidate.scenario(self.space)
        assert scene is not None
        return scene

    def smallest(self, failure: Failure) -> irsim.Scenario:
        """Return the smallest scene of the failure, with only the broken rule expected."""
        rules = self.subject.rules if isinstance(failure.rule, str) else (self.subject.rules[failure.rule],)
        expect = [{"kind": rule.kind, **rule.model_dump(exclude_none=True)} for rule in rules]
        return irsim.change(self.scene(failure.least), {"expect": expect})

    def _search(
        self, kind: str, budget: int, seed: int, progress: Progress | None
    ) -> tuple[int, Candidate, Verdict] | NoFailure:
        """Return the first failure as (run, candidate, verdict)."""
        benign = Candidate(self.space.benign())
        verdict = next(self.trials.verdicts([benign.scenario(self.space)]))
        if verdict.broken is not None:
            return 0, benign, verdict
        scene = benign.scenario(self.space)
        if scene is not None and self.trials.examine(scene)[0] != verdict:
            self._say(UNREPEATABLE)
        nearest = NoFailure(verdict.margin, dict(benign.point), budget)
        verdicts = [verdict]

        def margins(batch: Floats) -> Iterator[float]:
            candidates = [Candidate(self.space.at(shares.tolist())) for shares in batch]
            for each in self.trials.verdicts([candidate.scenario(self.space) for candidate in candidates]):
                verdicts.append(each)
                yield each.margin

        tried: SearchPoint
        for tried in search(kind, len(self.space.knobs), seed, budget, margins):
            if progress is not None:
                progress(tried.run, budget)
            point = dict(self.space.at(tried.shares.tolist()))
            if verdicts[-1].broken is not None:
                return tried.run, Candidate(point), verdicts[-1]
            if tried.margin < nearest.margin:
                nearest = NoFailure(tried.margin, point, budget)
        least = np.min([each.margins for each in verdicts], axis=0)
        untried = [rule_text(rule) for rule, found in zip(self.subject.rules, least, strict=True) if found == UNTESTED]
        return replace(nearest, untried=tuple(untried))

    def _repeats(self, candidate: Candidate, verdict: Verdict) -> bool:
        """Return whether two more runs have the same verdict, and equal estimates in every frame."""
        (first, traces), (second, others) = (self.trials.examine(self.scene(candidate)) for _ in range(2))
        same = all(one.same_as(other) for one, other in zip(traces, others, strict=False))
        return first == second == verdict and same

    def _sensitivity(self, candidate: Candidate, rule: int | str, count: int | None = None) -> SeedSensitivity:
        """Return the seed sensitivity over the first `count` fresh seeds, by default over all."""
        count = self._fresh if count is None else count
        own = self.space.scenario.seed
        seeds = [int(stream(own, "falsify/fresh", k).integers(2**31)) for k in range(count)]
        verdicts = self.trials.verdicts([candidate.scenario(self.space, seed) for seed in seeds])
        return SeedSensitivity(sum(verdict.breaks(rule) for verdict in verdicts), count)

    def _breaks(self, rule: int | str) -> Callable[[Sequence[Candidate]], Iterator[bool]]:
        """Return a function that tests if candidates break the rule, structurally where the failure is structural."""
        assert self.failure is not None
        seed_dependent = not self.failure.sensitivity.is_structural

        def breaks(candidates: Sequence[Candidate]) -> Iterator[bool]:
            verdicts = self.trials.verdicts([candidate.scenario(self.space) for candidate in candidates])
            for candidate, verdict in zip(candidates, verdicts, strict=True):
                yield verdict.breaks(rule) and (
                    seed_dependent or self._sensitivity(candidate, rule, FRESH_WHILE_SHRINKING).is_structural
                )

        return breaks

    def _shrink(self, rule: int | str) -> None:
        """Shrink the scene of the failure: switch off parts that are not needed, then lower severities."""
        assert self.failure is not None
        candidate = self.failure.least
        scene = self.scene(candidate)
        rules = self.subject.rules if isinstance(rule, str) else [self.subject.rules[rule]]
        followed = irsim.Rendering(scene).follow if self.subject.task == "single" else None
        needed = {each.target or followed for each in rules}
        for simpler in shrink(candidate, all_moves(self.space, removable_parts(scene, needed)), self._breaks(rule)):
            self.failure = replace(self.failure, least=simpler)

    def _shorten(self, rule: int | str) -> None:
        """Remove the frames after the failure, by bisection."""
        assert self.failure is not None
        candidate = self.failure.least
        scene = self.scene(candidate)
        breaks, least = self._breaks(rule), 1
        if isinstance(rule, int):
            trace = self.trials.examine(scene)[1][rule]
            last = int(trace.indices[frames_to_break(self.subject.rules[rule], trace) - 1])
            least = irsim.Rendering(scene).arrivals[last] + 1
        lengths = range(least, scene.frames)
        enough = bisect_left(lengths, True, key=lambda frames: next(breaks([replace(candidate, frames=frames)])))
        if enough < len(lengths):
            self.failure = replace(self.failure, least=replace(candidate, frames=lengths[enough]))
