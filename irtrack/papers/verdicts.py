"""What becomes of a claim: the share of seeds that bear it out, its interval, and the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, NamedTuple

from irtrack.metrics import FIGURES, Difference, Score, paired_difference, wilson
from irtrack.papers.runs import Outcome
from irtrack.papers.values import Claim, Switch

Word = Literal["held", "not held", "not decidable"]

LEVEL = 0.95
RULE = (
    "A claim is held where the Wilson 95 % interval of the share of seeds that bear it out lies above one half, not "
    "held where it lies below, and not decidable where it reaches over one half or no seed tells. A failed run "
    "tells nothing, and neither does a seed in which two trackers that are compared come to the very same (as in a "
    "sign test). A goal has a share of its own in place of one half, or a limit that the 95 % interval of a mean lies "
    "below (Student's t)."
)


class Judgement(NamedTuple):
    """`yes` of `told` seeds say yes; low .. high the interval of that share; why where it is not decidable."""

    yes: int
    told: int
    low: float
    high: float
    word: Word
    why: str = ""

    @property
    def share(self) -> float:
        return self.yes / self.told if self.told else math.nan


@dataclass(frozen=True)
class Verdict:
    """A claim, where it stands, the scene it was tried on, what bears it out in a seed, and what came of it."""

    text: str
    place: str
    scene: str
    words: str
    judgement: Judgement


def judged(answers: Sequence[bool | None], wanted: float = 0.5) -> Judgement:
    """Whether more than the share `wanted` of all seeds say yes; None: the seed tells nothing."""
    told = [answer for answer in answers if answer is not None]
    yes, count = sum(told), len(told)
    low, high = wilson(yes, count, LEVEL)
    if not told:
        return Judgement(0, 0, low, high, "not decidable", "no seed tells")
    if low > wanted:
        return Judgement(yes, count, low, high, "held")
    if high < wanted:
        return Judgement(yes, count, low, high, "not held")
    return Judgement(yes, count, low, high, "not decidable", needed(seeds_to_decide(yes / count, wanted)))


def seeds_to_decide(share: float, wanted: float) -> int | None:
    """From how many seeds on the Wilson interval of a share leaves `wanted` out; None where they are the same.

    The interval holds all p with |share - p| <= z sqrt(p (1 - p) / n) (Wilson 1927).
    """
    if share == wanted:
        return None
    z = NormalDist().inv_cdf((1 + LEVEL) / 2)
    return math.floor(z * z * wanted * (1 - wanted) / (share - wanted) ** 2) + 1


def needed(seeds: int | None) -> str:
    """What would decide, were things to go on as they did."""
    return "more of the like would not decide" if seeds is None else f"some {seeds:,} seeds of the like would decide"


def verdict(claim: Claim, outcomes: Mapping[str, Outcome]) -> Verdict:
    """The verdict on a claim; not decidable where one of its trackers is not here."""
    found = outcomes[claim.scene]
    labels = claim.rule.labels
    missing = [label for label in labels if label not in found.runs]
    if missing:
        why = "; ".join(found.absent.get(label, f"{label} was not run") for label in missing)
        told = Judgement(0, 0, 0.0, 1.0, "not decidable", why)
    else:
        together = set.intersection(*(set(found.of(label)) for label in labels))
        answers = [claim.rule.of({label: found.of(label)[seed] for label in labels}) for seed in sorted(together)]
        told = judged(answers)
    return Verdict(claim.text, claim.place, claim.scene, claim.rule.words, told)


@dataclass(frozen=True)
class Effect:
    """What a switch does, with it less without it: share of frames off, and error before the loss, px."""

    switch: Switch
    off: Difference | None
    error: Difference | None
    lost_with: int
    lost_without: int
    seeds: int
    why: str = ""


def effect(switch: Switch, found: Outcome) -> Effect:
    """The paired differences over the seeds that both have."""
    missing = [spec for spec in (switch.with_it, switch.without) if spec not in found.runs]
    if missing:
        return Effect(switch, None, None, 0, 0, 0, found.absent.get(missing[0], "was not run"))
    own, other = found.of(switch.with_it), found.of(switch.without)
    seeds = sorted(own.keys() & other.keys())
    scenes = [str(seed) for seed in seeds]

    def difference(figure: str) -> Difference | None:
        pairs = [(_figure(own[seed].score, figure), _figure(other[seed].score, figure)) for seed in seeds]
        return paired_difference([a for a, _ in pairs], [b for _, b in pairs], scenes, most=FIGURES[figure].most)

    return Effect(
        switch,
        difference("off_share"),
        difference("error_held"),
        sum(own[seed].score.lost is True for seed in seeds),
        sum(other[seed].score.lost is True for seed in seeds),
        len(seeds),
    )


def _figure(score: Score, name: str) -> float:
    value = score.figure(name)
    return float("nan") if value is None else float(value)
