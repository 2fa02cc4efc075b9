"""The hunt for a failure: search, confirm, tell whether it is the scene or its luck, make it small."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import irsim
from irsim.config.base import suggestion
from irsim.errors import counted
from irsim.rng import stream
from irsim.types import Floats
from irtrack.errors import InputError, whole_number
from irtrack.falsify.case import Case, droppable, moves, shrink
from irtrack.falsify.rules import UNTRIED, in_words, shortest
from irtrack.falsify.search import SEARCHES, Tried, search
from irtrack.falsify.told import OF_ITSELF
from irtrack.falsify.trial import Subject, Verdict
from irtrack.falsify.trials import Trials
from irtrack.metrics import wilson

FRESH = 20
"""Fresh seeds that a failure is tried on, unless said otherwise."""

FRESH_OF_EACH = 5
"""Those of them that each simpler case of a structural failure is tried on: it must not become one of luck. Fewer
fresh seeds than these tell nothing."""

UNSURE = "warning: the benign point comes out otherwise when it is run again: the tracker does not repeat itself"
"""Said before the search; of what breaks, `Failure.repeats` tells."""

STRUCTURAL = 0.8
"""A failure that at least this share of fresh seeds has is of the scene's structure, not of its luck. With 20 seeds
16 are then needed, which a failure of half of the seeds has once in 170 times (binomial)."""

Say = Callable[[str], None]
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Luck:
    """Of `seeds` fresh seeds, scene and tracker alike, how many broke the same rule."""

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
    """A broken rule, as it was found and as small as it got.

    rule       number of the rule, `RAISES` or `ENDS`
    run        of the search, from 1; 0 for the benign point, which is tried first
    found      the case that the search met;  luck  on fresh seeds
    repeats    does it come out the same, bit for bit, when it is run again?
    least      the smallest case that breaks the same rule
    least_luck its luck on fresh seeds; None where the hunt was stopped before that was tried
    """

    rule: int | str
    run: int
    found: Case
    luck: Luck
    repeats: bool
    least: Case
    least_luck: Luck | None = None


@dataclass(frozen=True, slots=True)
class Nearest:
    """What came nearest to being broken, where nothing was: its margin, and where it was found in how many runs.

    untried   rules, in words, that no run has put to the test: nothing that they speak of happened
    """

    margin: float
    point: dict[str, Any]
    runs: int
    untried: tuple[str, ...] = ()


class Hunt:
    """The search of one scenario's space for a failure of one subject."""

    def __init__(
        self, scenario: irsim.Scenario, subject: Subject, trials: Trials, say: Say, fresh: int = FRESH
    ) -> None:
        self.space = irsim.variations(scenario)
        self.subject = subject
        self.trials = trials
        self.say = say
        self.fresh = fresh
        self.failure: Failure | None = None
        """The smallest known by now: what an interrupted hunt has."""

    def run(self, kind: str, budget: int, seed: int, progress: Progress | None = None) -> Failure | Nearest:
        """Search with at most `budget` runs; the failure, made small, or what came nearest to one."""
        found = self._first_broken(kind, budget, seed, progress)
        if isinstance(found, Nearest):
            return found
        run, case, verdict = found
        rule = verdict.broken
        assert rule is not None
        self.say(f"run {run}: {verdict.raised or f'{self.broken(rule)}, margin {verdict.margin:.3g}'}")
        repeats = self._repeats(case, verdict)
        self.say("the same again, bit for bit" if repeats else "not the same again: the tracker does not repeat itself")
        luck = self._luck(case, rule)
        self.say(luck.in_words())
        self.failure = Failure(rule, run, case, luck, repeats, case)
        if repeats:  # else no smaller case would tell anything
            self._shrink(rule)
            self._shorten(rule)
        self.failure = replace(self.failure, least_luck=self._luck(self.failure.least, rule))
        self.say(counted(self.trials.run, "new trial"))
        return self.failure

    def broken(self, rule: int | str) -> str:
        """That the rule is broken, in words."""
        return OF_ITSELF[rule][0] if isinstance(rule, str) else f"{in_words(self.subject.rules[rule])} is broken"

    def _first_broken(
        self, kind: str, budget: int, seed: int, progress: Progress | None
    ) -> tuple[int, Case, Verdict] | Nearest:
        benign = Case(self.space.benign())
        verdict = next(self.trials.verdicts([benign.scenario(self.space)]))
        if verdict.broken is not None:
            return 0, benign, verdict
        scene = benign.scenario(self.space)
        if scene is not None and self.trials.examine(scene)[0] != verdict:
            self.say(UNSURE)
        nearest = Nearest(verdict.margin, dict(benign.point), budget)
        met = [verdict]

        def margins(batch: Floats) -> Iterator[float]:
            cases = [Case(self.space.at(shares.tolist())) for shares in batch]
            for each in self.trials.verdicts([case.scenario(self.space) for case in cases]):
                met.append(each)
                yield each.margin

        tried: Tried
        for tried in search(kind, len(self.space.knobs), seed, budget, margins):
            if progress is not None:
                progress(tried.run, budget)
            point = dict(self.space.at(tried.shares.tolist()))
            if met[-1].broken is not None:
                return tried.run, Case(point), met[-1]
            if tried.margin < nearest.margin:
                nearest = Nearest(tried.margin, point, budget)
        least = np.min([each.margins for each in met], axis=0)
        untried = [in_words(rule) for rule, found in zip(self.subject.rules, least, strict=True) if found == UNTRIED]
        return replace(nearest, untried=tuple(untried))

    def _repeats(self, case: Case, verdict: Verdict) -> bool:
        """Do two more runs of the case give this verdict, and the same numbers in every frame?"""
        (first, traces), (second, others) = (self.trials.examine(self.scene(case)) for _ in range(2))
        same = all(one.same_as(other) for one, other in zip(traces, others, strict=False))
        return first == second == verdict and same

    def _luck(self, case: Case, rule: int | str, count: int | None = None) -> Luck:
        """On so many fresh seeds; on all of them unless said."""
        count = self.fresh if count is None else count
        own = self.space.scenario.seed
        seeds = [int(stream(own, "falsify/fresh", k).integers(2**31)) for k in range(count)]
        verdicts = self.trials.verdicts([case.scenario(self.space, seed) for seed in seeds])
        return Luck(sum(verdict.breaks(rule) for verdict in verdicts), count)

    def _breaks(self, rule: int | str) -> Callable[[Sequence[Case]], Iterator[bool]]:
        """Whether each case breaks the rule as the failure that was found does: by structure, where that does."""
        assert self.failure is not None
        lucky = not self.failure.luck.is_structural

        def breaks(cases: Sequence[Case]) -> Iterator[bool]:
            verdicts = self.trials.verdicts([case.scenario(self.space) for case in cases])
            for case, verdict in zip(cases, verdicts, strict=True):
                yield verdict.breaks(rule) and (lucky or self._luck(case, rule, FRESH_OF_EACH).is_structural)

        return breaks

    def scene(self, case: Case) -> irsim.Scenario:
        """The scene of a case that has one."""
        scene = case.scenario(self.space)
        assert scene is not None
        return scene

    def _shrink(self, rule: int | str) -> None:
        """Switch off what is not needed, then lower severities."""
        assert self.failure is not None
        case = self.failure.least
        scene = self.scene(case)
        rules = self.subject.rules if isinstance(rule, str) else [self.subject.rules[rule]]
        followed = irsim.Rendering(scene).follow
        needed = {each.target or followed for each in rules}
        for simpler in shrink(case, moves(self.space, droppable(scene, needed)), self._breaks(rule)):
            self.failure = replace(self.failure, least=simpler)

    def _shorten(self, rule: int | str) -> None:
        """Cut off the frames after the rule is broken, where it is broken without them too."""
        assert self.failure is not None
        case = self.failure.least
        scene = self.scene(case)
        breaks, least = self._breaks(rule), 1
        if isinstance(rule, int):
            trace = self.trials.examine(scene)[1][rule]
            last = int(trace.indices[shortest(self.subject.rules[rule], trace) - 1])
            least = irsim.Rendering(scene).arrivals[last] + 1
        lengths = range(least, scene.frames)
        enough = bisect_left(lengths, True, key=lambda frames: next(breaks([replace(case, frames=frames)])))
        if enough < len(lengths):
            self.failure = replace(self.failure, least=replace(case, frames=lengths[enough]))


def check(scenario: irsim.Scenario, name: str, search: str, budget: int, jobs: int, fresh: int) -> None:
    """InputError where there is nothing to search, or no such search."""
    if not irsim.variations(scenario).knobs:
        raise InputError(
            f"{name}: vary: nothing varies that could be searched; allowed: override keys, each with a kind of "
            "variation that is no nuisance"
        )
    if search not in SEARCHES:
        raise InputError(f"search '{search}': allowed: {', '.join(SEARCHES)}{suggestion(search, SEARCHES)}")
    for count, number, least in (("budget", budget, 1), ("jobs", jobs, 1), ("fresh", fresh, FRESH_OF_EACH)):
        whole_number(count, number, least)
