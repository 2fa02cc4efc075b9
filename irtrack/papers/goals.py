"""What we set ourselves on the papers' scenes, and whether it is reached."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irtrack.metrics import mean_interval
from irtrack.papers.runs import Outcome
from irtrack.papers.values import Goal, Rule
from irtrack.papers.verdicts import LEVEL, Judgement, Word, judged, needed


@dataclass(frozen=True)
class Reached:
    """A goal, what was reached with its 95 % interval, over how many seeds, and the verdict; nan where nothing was."""

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


def reached(goal: Goal, outcomes: Mapping[str, Outcome]) -> Reached:
    """Of all runs of the goal's tracker that did not fail; not decidable where it is not here."""
    found = outcomes[goal.scene.name]
    if goal.label not in found.runs:
        why = found.absent.get(goal.label, f"{goal.label} was not run")
        return Reached(goal, math.nan, -math.inf, math.inf, 0, "not decidable", why)
    runs = found.of(goal.label).values()
    if isinstance(goal.reach, Rule):
        rule = goal.reach
        told: Judgement = judged([rule.of({goal.label: run}) for run in runs], goal.wanted)
        return Reached(goal, told.share, told.low, told.high, told.told, told.word, told.why)
    figure = goal.reach
    return _mean_at_most(goal, [value for run in runs if (value := figure(run)) is not None])


def _mean_at_most(goal: Goal, values: Sequence[float]) -> Reached:
    count = len(values)
    if count < 2:
        mean = values[0] if values else math.nan
        return Reached(goal, mean, -math.inf, math.inf, count, "not decidable", "fewer than two seeds tell")
    mean, low, high = map(float, mean_interval(np.array(values), LEVEL))
    if high <= goal.wanted:
        return Reached(goal, mean, low, high, count, "held")
    if low > goal.wanted:
        return Reached(goal, mean, low, high, count, "not held")
    apart = abs(mean - goal.wanted)
    seeds = math.ceil(count * ((high - mean) / apart) ** 2) if apart else None
    return Reached(goal, mean, low, high, count, "not decidable", needed(seeds))
