"""The hunt for a failure: search, confirm, tell whether it is the scene or its luck, make it small."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import irsim
from irsim.config.base import suggestion
from irsim.config.files import make_folder, path_of
from irsim.rng import stream
from irsim.types import Floats, Input
from irsim.wording import counted
from irtrack.bench import Entry
from irtrack.bench.spec import entry
from irtrack.errors import InputError, whole
from irtrack.falsify.counterexample import Case, droppable, moves, shrink
from irtrack.falsify.outputs import JOURNAL, check_outputs, clear, write_failure
from irtrack.falsify.regressions import keep
from irtrack.falsify.rules import OF_ITSELF, UNTRIED, in_words, rules_of, shortest
from irtrack.falsify.search import SEARCHES, Tried, search
from irtrack.falsify.trial import Subject, Trials, Verdict
from irtrack.metrics import wilson
from irtrack.runner.pool import start_runner
from irtrack.types import Tracker

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
        whole(count, number, least)


def find_failure(
    scenario: str | Path | irsim.Scenario,
    tracker: str | Tracker | Entry,
    folder: str | Path,
    *,
    search: str = "cma",
    budget: int = 500,
    jobs: int = 1,
    seed: int | None = None,
    fresh: int = FRESH,
    frame_limit_s: float | None = None,
    input: Input = "display",
    name: str | None = None,
    file: Path | None = None,
    command: str | None = None,
    keep_in: Path | None = None,
    say: Say = lambda line: None,
    progress: Progress | None = None,
) -> Failure | Nearest:
    """Search the ranges under `vary` for a scene in which the tracker breaks what the scenario expects.

    tracker   a spec (`irtrack.bench.spec`), a tracker or an entry
    folder    is made where it is not there. It gets a journal of all trials, by which the same call goes on where it
              was stopped, and of a failure minimal.yaml, minimal.mcap, replay.html and report.md
    search    'cma', 'sobol' or 'random', of at most `budget` runs after the benign point
    jobs      worker processes; what is found is the same for any number. With more than one, or with a limit, the
              calling script needs the guard ``if __name__ == "__main__"``
    seed      of the search; the scenes and the tracker have the scenario's own seed
    fresh     seeds that tell whether a failure is of the scene's structure or its luck; fewer are sooner, and tell less
    frame_limit_s   where given, the tracker runs in worker processes with one job too: one that takes longer for a
              frame, or whose process dies, is broken there as one that raises is
    name, command   of the scenario and the command line, for the report
    file      that the scenario was read from, where a loaded one is given: it must not be replaced
    keep_in   folder in which a failure is kept (`irtrack.falsify.regressions`); None: nowhere
    say, progress   called with lines on what was found, and with (runs done, budget)

    Returns the failure made small, or what came nearest to one. InputError, before anything is run, where nothing
    varies, a word is wrong or the folder's files would replace the scenario's. KeyboardInterrupt is passed on when
    what was found by then is written.
    """
    folder = path_of(folder)
    if isinstance(scenario, irsim.Scenario):
        loaded, name = scenario, name or "scenario"
    else:
        loaded, name, file = irsim.load(scenario), name or Path(scenario).stem, irsim.find(scenario)
    check(loaded, name if file is None else str(file), search, budget, jobs, fresh)
    if frame_limit_s is not None and not frame_limit_s > 0:
        raise InputError(f"time limit {frame_limit_s:g} s: allowed: above 0")
    tried = entry(tracker)
    subject = Subject(tried.label, tried.tracker, input, rules_of(loaded))
    make_folder(folder)
    check_outputs(folder, file)
    clear(folder)
    with start_runner(jobs, apart=frame_limit_s is not None) as runner:
        trials = Trials(subject, folder / JOURNAL, runner, frame_limit_s)
        hunt = Hunt(loaded, subject, trials, say, fresh)
        try:
            found = hunt.run(search, budget, loaded.seed if seed is None else seed, progress)
        finally:
            if hunt.failure is not None:
                write_failure(folder, hunt, hunt.failure, name, command)
        if keep_in is not None and isinstance(found, Failure):
            (verdict,) = trials.verdicts([hunt.scene(found.least)])
            limit_s = verdict.limit_s if frame_limit_s is None else frame_limit_s
            say(f"kept: {keep(folder, subject, name, verdict.how, keep_in, limit_s).path}")
        return found
