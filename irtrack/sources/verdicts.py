"""What becomes of a claim: the share of seeds that bear it out, its interval, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from irtrack.metrics import Difference, Score, paired_difference, wilson
from irtrack.sources.runs import Outcome
from irtrack.sources.values import Claim, Switch

Word = Literal["held", "not held", "not decidable"]

RULE = (
    "A claim is held where the Wilson 95 % interval of the share of seeds that bear it out lies above one half, not "
    "held where it lies below, and not decidable where it reaches over one half or no seed tells. A failed run tells "
    "nothing."
)


@dataclass(frozen=True)
class Verdict:
    """yes of told seeds bear the claim out; low .. high the interval of that share; why where it is not decidable."""

    text: str
    place: str
    scene: str
    words: str
    yes: int
    told: int
    low: float
    high: float
    word: Word
    why: str = ""


def judged(answers: Sequence[bool | None]) -> tuple[int, int, float, float, Word, str]:
    """(yes, told, low, high, verdict, why) of the answers of all seeds; None: the seed tells nothing."""
    told = [answer for answer in answers if answer is not None]
    yes = sum(told)
    low, high = wilson(yes, len(told))
    if not told:
        return 0, 0, low, high, "not decidable", "no seed tells"
    if low > 0.5:
        return yes, len(told), low, high, "held", ""
    if high < 0.5:
        return yes, len(told), low, high, "not held", ""
    return yes, len(told), low, high, "not decidable", f"the interval of {len(told)} seeds reaches over one half"


def verdict(claim: Claim, outcomes: Mapping[str, Outcome]) -> Verdict:
    """The verdict on a claim; not decidable where one of its trackers is not here."""
    found = outcomes[claim.scene]
    labels = claim.rule.labels
    missing = [label for label in labels if label not in found.runs]
    if missing:
        why = "; ".join(found.absent.get(label, f"{label} was not run") for label in missing)
        return Verdict(claim.text, claim.place, claim.scene, claim.rule.words, 0, 0, 0.0, 1.0, "not decidable", why)
    together = set.intersection(*(set(found.of(label)) for label in labels))
    answers = [claim.rule.of({label: found.of(label)[seed] for label in labels}) for seed in sorted(together)]
    return Verdict(claim.text, claim.place, claim.scene, claim.rule.words, *judged(answers))


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
        return paired_difference([a for a, _ in pairs], [b for _, b in pairs], scenes)

    return Effect(
        switch,
        difference("off_share"),
        difference("error_held"),
        sum(own[seed].score.lost is True for seed in seeds),
        sum(other[seed].score.lost is True for seed in seeds),
        len(seeds),
    )


def _figure(score: Score, name: str) -> float:
    value = score.as_dict()[name]
    return float("nan") if value is None else float(value)
