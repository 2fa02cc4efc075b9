"""A rule in words beside what a track reached of it, in the same unit: what people ask of a failure first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import irsim
from irsim.errors import counted
from irtrack.falsify.rules import claims_while_gone, margin, rules_of
from irtrack.falsify.trial import ENDS, RAISES, RULE
from irtrack.metrics import Trace
from irtrack.metrics.loss import OFF_IN_A_ROW


@dataclass(frozen=True, slots=True)
class Told:
    """What a rule asks of a track and what the track reached of it, in words; margin: below 0 where it is broken."""

    asked: str
    reached: str
    margin: float


def told(scenario: irsim.Scenario, trace: Trace, target: str) -> list[Told]:
    """What the scenario expects of whoever tracks this target, beside a track of it; nothing where it says nothing."""
    rules = rules_of(scenario) if scenario.expect else ()
    return [
        Told(asked(rule), reached(rule, trace), margin(rule, trace)) for rule in rules if rule.target in (None, target)
    ]


def asked(rule: irsim.Expectation) -> str:
    """What the rule asks of a track."""
    known = ASKED.get(type(rule))
    return known(rule) if known is not None else "a margin of 0 or more"


def reached(rule: irsim.Expectation, trace: Trace) -> str:
    """What the track reached where it does worst, frames by their indices."""
    known = REACHED.get(type(rule))
    return known(rule, trace) if known is not None else f"a margin of {margin(rule, trace):.3g}"


OF_ITSELF = {
    RAISES: ("it raises", "to raise nothing"),
    ENDS: ("its process dies, or it hangs", "to answer, in time"),
}
"""Of rules that need not be asked for: how they are broken, and what they ask."""


NOTED = {
    RULE: ("broke {rules}", "breaks {rules}"),
    RAISES: ("raised", "raises"),
    ENDS: ("ended its process, or hung", "ends its process, or hangs"),
}
"""Of all the ways to break something: what a tracker did, and does."""


def _row_off(_: irsim.NeverLost, trace: Trace) -> str:
    """The longest row of frames off, among those that count."""
    judged = np.flatnonzero(trace.counted)
    edges = np.diff(np.concatenate([[False], trace.off[judged], [False]]).astype(np.int8))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if not len(begins):
        return "never off the target"
    worst = int(np.argmax(ends - begins))
    row = counted(int(ends[worst] - begins[worst]), "frame")
    return f"{row} in a row off it, from frame {trace.indices[judged[begins[worst]]]} on"


def _error(rule: irsim.ErrorBelow, trace: Trace) -> str:
    errors, indices = trace.errors[trace.counted], trace.indices[trace.counted]
    if not len(errors):
        return "no frame that counts"
    at = int(np.argsort(errors, kind="stable")[int(np.ceil(rule.share * len(errors))) - 1])
    return f"{errors[at]:.3g} px, at frame {indices[at]}"


def _return(rule: irsim.ReacquiredWithin, trace: Trace) -> str:
    """The return that took longest; one that was watched no longer than the rule asks for tells nothing."""
    told = [each for each in trace.returns if each.after is not None or each.watched > rule.frames]
    if not told:
        return "no return that tells"
    worst = max(told, key=lambda each: each.watched if each.after is None else each.after)
    back = trace.indices[worst.at]
    if worst.after is None:
        last = trace.indices[worst.at + worst.watched - 1]
        return f"still not at frame {last}, {counted(worst.watched - 1, 'frame')} after it came back at frame {back}"
    return f"{counted(worst.after, 'frame')} after it came back at frame {back}"


def _claim(_: irsim.HonestWhileHidden, trace: Trace) -> str:
    claims = claims_while_gone(trace)
    if not claims:
        return "no frame without the target"
    begin, frames = max(claims, key=lambda each: each[1])
    return f"{counted(frames, 'frame')} after it went, at frame {trace.indices[begin]}"


ASKED: dict[type[irsim.Expectation], Callable[[Any], str]] = {
    irsim.NeverLost: lambda _: f"never {OFF_IN_A_ROW} frames in a row off the target while it can be seen",
    irsim.ErrorBelow: lambda rule: (
        f"a centre error of at most {rule.px:g} px in "
        + ("every frame" if rule.share == 1 else f"{100 * rule.share:g} % of the frames")
    ),
    irsim.ReacquiredWithin: lambda rule: (
        f"on the target again within {counted(rule.frames, 'frame')} of its coming back"
    ),
    irsim.HonestWhileHidden: lambda rule: (
        f'"tracking" said no longer than {counted(rule.within, "frame")} after the target went'
    ),
}

REACHED: dict[type[irsim.Expectation], Callable[[Any, Trace], str]] = {
    irsim.NeverLost: _row_off,
    irsim.ErrorBelow: _error,
    irsim.ReacquiredWithin: _return,
    irsim.HonestWhileHidden: _claim,
}
"""Of every kind of rule; a rule of one's own is told by its margin."""
