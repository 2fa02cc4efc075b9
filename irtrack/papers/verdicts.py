"""Verdicts on claims and goals with intervals; effects of ablations; the best tracker of irtrack against each peer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, NamedTuple

import numpy as np

from irtrack.metrics import FIGURES, Difference, Score, mean_interval, paired_difference, wilson
from irtrack.metrics.statistics import LEAST_SCENES
from irtrack.papers.experiment import HARD, MARGIN, OURS, THEIRS, Claim, Goal, PairedRule, Rule, Run, Switch
from irtrack.papers.runs import SceneRuns, fewest_off

Word = Literal["held", "not held", "no difference", "not decidable"]

LEVEL = 0.95
RULE = (
    "A claim of single runs is held where the Wilson 95 % interval of the share of seeds that support it lies above "
    "one half. It is not held where the interval lies below one half, and not decidable otherwise or without seeds. "
    "A failed run does not count, and neither does a seed in which two compared trackers have equal figures (as in "
    "a sign test; of losses: McNemar's test). A claim that compares two trackers is judged by the mean over the "
    "seeds of the paired difference of their bounded errors, min(centre error, threshold beyond which a frame is "
    "off) over all frames, so that lost runs count and none ties: held where the 95 % interval lies below 0, not "
    f"held where it lies above; no difference where the 90 % interval lies within {MARGIN:.0%} of the control's "
    "bounded error. A claim of equality is held by this last test (two one-sided tests of 5 %), and a claim that "
    "something does no harm where the upper end of the 90 % interval lies below the margin (one-sided, 5 %). A goal "
    "has a share of its own in place of one half, or a limit for the 95 % interval of a mean (Student's t)."
)


class Judgement(NamedTuple):
    """Judgement: `yes` of `decided` seeds support a claim; interval of their ratio; the reason where not decidable."""

    yes: int
    decided: int
    low: float
    high: float
    word: Word
    why: str = ""
    difference: Difference | None = None
    """Of paired rules: mean and interval of the difference, tracker less control, px."""

    @property
    def share(self) -> float:
        return self.yes / self.decided if self.decided else math.nan


def judge(answers: Sequence[bool | None], wanted: float = 0.5) -> Judgement:
    """Judge if a claim holds in more than the share `wanted` of all seeds; seeds with the answer None are not
    counted."""
    decided = [answer for answer in answers if answer is not None]
    yes, count = sum(decided), len(decided)
    low, high = wilson(yes, count, LEVEL)
    if not low <= wanted <= high:
        return Judgement(yes, count, low, high, "held" if low > wanted else "not held")
    why = _needed(seeds_to_decide(yes / count, wanted)) if decided else "no seed decides"
    return Judgement(yes, count, low, high, "not decidable", why)


def judge_paired(rule: PairedRule, runs: Sequence[Mapping[str, Run]]) -> Judgement:
    """Judge a claim on the mean difference in a metric; `runs`: by label, one mapping a seed.

    `yes` of `decided` are the seeds with a difference below 0; equal ones are not counted.
    """
    pairs = [(rule.figure.of(run[rule.label]), rule.figure.of(run[rule.control])) for run in runs]
    values = np.array([pair for pair in pairs if None not in pair], dtype=np.float64).reshape(-1, 2)
    signs = np.sign(values[:, 0] - values[:, 1])
    yes, decided = int((signs < 0).sum()), int((signs != 0).sum())
    seeds = list(map(str, range(len(values))))
    wide, narrow = (paired_difference(values[:, 0], values[:, 1], seeds, level) for level in (LEVEL, 2 * LEVEL - 1))
    share = wilson(yes, decided, LEVEL)
    if wide is None or narrow is None or wide.is_open:
        return Judgement(yes, decided, *share, "not decidable", f"fewer than {LEAST_SCENES} seeds decide")
    margin = MARGIN * float(values[:, 1].mean())
    alike = -margin < narrow.low and narrow.high < margin
    apart = narrow.low > margin or (rule.kind == "equal" and narrow.high < -margin)
    if rule.kind == "less":
        word: Word = "held" if wide.high < 0 else "not held" if wide.low > 0 else "not decidable"
        word = "no difference" if word == "not decidable" and alike else word
    else:
        held = alike if rule.kind == "equal" else narrow.high < margin
        word = "held" if held else "not held" if apart else "not decidable"
    found = wide if rule.kind == "less" else narrow
    why = ""
    if word == "not decidable":
        limits = {"less": (0.0,), "no_worse": (margin,), "equal": (margin, -margin)}[rule.kind]
        near = min(abs(found.mean - limit) for limit in limits)
        why = _needed(math.ceil(found.pairs * ((found.high - found.low) / 2 / near) ** 2) if near else None)
    return Judgement(yes, decided, *share, word, why, found)


def seeds_to_decide(share: float, wanted: float) -> int | None:
    """Return the least number of seeds with which the Wilson interval of `share` excludes `wanted`; None where equal.

    The interval holds all p with |share - p| <= z sqrt(p (1 - p) / n) (Wilson 1927).
    """
    if share == wanted:
        return None
    z = NormalDist().inv_cdf((1 + LEVEL) / 2)
    return math.floor(z * z * wanted * (1 - wanted) / (share - wanted) ** 2) + 1


def _needed(seeds: int | None) -> str:
    return "more seeds would not decide" if seeds is None else f"about {seeds:,} seeds would decide"


@dataclass(frozen=True)
class Verdict:
    """Verdict: a claim, its place in the paper, the name of the scene, the rule in words, and the judgement."""

    text: str
    place: str
    scene: str
    words: str
    judgement: Judgement


def verdict(claim: Claim, every: Mapping[str, SceneRuns]) -> Verdict:
    """Return the verdict on a claim; not decidable where one of its trackers has no runs."""
    found, rule = every[claim.scene.name], claim.rule
    missing = [label for label in rule.labels if label not in found.runs]
    if missing:
        judgement = Judgement(0, 0, 0.0, 1.0, "not decidable", "; ".join(map(found.reason, missing)))
    else:
        together = set.intersection(*(set(found.of(label)) for label in rule.labels))
        runs = [{label: found.of(label)[seed] for label in rule.labels} for seed in sorted(together)]
        judgement = judge_paired(rule, runs) if isinstance(rule, PairedRule) else judge(list(map(rule.of, runs)))
    return Verdict(claim.text, claim.place, claim.scene.name, rule.words, judgement)


@dataclass(frozen=True)
class GoalResult:
    """Result of a goal: the value with its 95 % interval, the number of seeds, and the verdict; nan without runs."""

    goal: Goal
    value: float
    low: float
    high: float
    seeds: int
    word: Word
    why: str = ""

    @property
    def is_share(self) -> bool:
        return isinstance(self.goal.reach, Rule)


def judge_goal(goal: Goal, every: Mapping[str, SceneRuns]) -> GoalResult:
    """Return the result of a goal over all runs of its tracker that did not fail."""
    found = every[goal.scene.name]
    if goal.label not in found.runs:
        return GoalResult(goal, math.nan, -math.inf, math.inf, 0, "not decidable", found.reason(goal.label))
    runs = found.of(goal.label).values()
    if isinstance(goal.reach, Rule):
        share = judge([goal.reach.of({goal.label: run}) for run in runs], goal.wanted)
        return GoalResult(goal, share.share, share.low, share.high, share.decided, share.word, share.why)
    values = np.array([value for run in runs if (value := goal.reach.of(run)) is not None])
    count = len(values)
    if count < 2:
        mean = float(values[0]) if count else math.nan
        return GoalResult(goal, mean, -math.inf, math.inf, count, "not decidable", "fewer than two seeds decide")
    mean, low, high = map(float, mean_interval(values, LEVEL))
    if not low <= goal.wanted < high:
        return GoalResult(goal, mean, low, high, count, "held" if high <= goal.wanted else "not held")
    apart = abs(mean - goal.wanted)
    seeds = math.ceil(count * ((high - mean) / apart) ** 2) if apart else None
    return GoalResult(goal, mean, low, high, count, "not decidable", _needed(seeds))


@dataclass(frozen=True)
class Effect:
    """Effect of an ablation, with minus without the mechanism: share of frames off target; error before loss, px."""

    switch: Switch
    off: Difference | None = None
    error: Difference | None = None
    lost_with: int = 0
    lost_without: int = 0
    seeds: int = 0
    why: str = ""


def effect(switch: Switch, found: SceneRuns) -> Effect:
    """Return the differences, paired by seed, between the two sides of an ablation."""
    sides = (switch.with_it, str(switch.without))
    missing = [spec for spec in sides if spec not in found.runs]
    if missing:
        return Effect(switch, why=found.reason(missing[0]))
    both = [found.of(spec) for spec in sides]
    seeds = sorted(both[0].keys() & both[1].keys())

    def difference(name: str) -> Difference | None:
        a, b = ([_figure(runs[seed].score, name) for seed in seeds] for runs in both)
        return paired_difference(a, b, list(map(str, seeds)), most=FIGURES[name].most)

    lost_with, lost_without = (sum(runs[seed].score.lost is True for seed in seeds) for runs in both)
    return Effect(switch, difference("off_share"), difference("error_held"), lost_with, lost_without, len(seeds))


def _figure(score: Score, name: str) -> float:
    value = score.figure(name)
    return math.nan if value is None else float(value)


@dataclass(frozen=True)
class PeerComparison:
    """Shares of frames off target of irtrack's best tracker and of a peer, and their difference on the same seeds."""

    scene: str
    best: str
    peer: str
    own: float
    other: float
    difference: Difference

    @property
    def word(self) -> Word:
        """Verdict on the goal that the best tracker of irtrack is off target in fewer frames."""
        if self.difference.high < 0:
            return "held"
        return "not held" if self.difference.low > 0 else "not decidable"


def compare_peers(every: Mapping[str, SceneRuns], development: Mapping[str, SceneRuns]) -> list[PeerComparison]:
    """Compare the best tracker of irtrack with each peer on each hard scene; a failed run is off target throughout.

    The best tracker is the one with the fewest frames off target over all hard scenes with the development seeds.
    """
    names = [experiment.scene.name for experiment in HARD]
    best = fewest_off(OURS, [development[name] for name in names])
    found: list[PeerComparison] = []
    for name in names if best is not None else ():
        for peer in THEIRS:
            ours, theirs = (every[name].off_shares(label) for label in (best or "", peer))
            common = sorted(ours.keys() & theirs.keys())
            own, other = ([shares[seed] for seed in common] for shares in (ours, theirs))
            difference = paired_difference(own, other, list(map(str, common)), most=FIGURES["off_share"].most)
            if difference is not None:
                mine, its = sum(own) / len(own), sum(other) / len(other)
                found.append(PeerComparison(name, best or "", peer, mine, its, difference))
    return found
