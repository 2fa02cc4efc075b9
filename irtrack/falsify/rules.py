"""How far a track is from breaking a rule of its scenario: one signed margin a rule, below 0 where it is broken.

Margins are the robustness of signal temporal logic (Donzé and Maler, FORMATS 2010, LNCS 6246, 92): "always" is a
least value over time, "at some time" a greatest. Each is measured in units of the rule's own bound, 1 far from
being broken, so that rules can be compared and a search has a slope to follow before anything breaks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import irsim
from irsim.errors import counted
from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.metrics import Trace
from irtrack.metrics.lost import OFF_IN_A_ROW, off_beyond

RULE = "rule"
"""How a rule of the scenario is broken: by the track."""

RAISES = "raises"
"""The rule that a tracker raises nothing; it need not be asked for."""

ENDS = "ends"
"""The rule that a tracker neither ends its process nor hangs; it need not be asked for."""

UNTRIED = 1.0
"""The margin of a rule about frames that a track does not have."""


def rules_of(scenario: irsim.Scenario) -> tuple[irsim.Expectation, ...]:
    """What the scenario expects; that the track is never lost, where it says nothing. InputError for a foreign rule."""
    for index, rule in enumerate(scenario.expect):
        if type(rule) not in MARGINS and not hasattr(rule, "margin"):
            allowed = ", ".join(kind.kind for kind in MARGINS)
            raise InputError(
                f"expect.{index}: no margin is known of the kind {rule.kind}; allowed: {allowed}, or a class with "
                "a method margin(trace)"
            )
    return scenario.expect or (irsim.NeverLost(),)


def margin(rule: irsim.Expectation, trace: Trace) -> float:
    """The signed margin of a rule about this track: below 0 where the rule is broken, at most 1."""
    known = MARGINS.get(type(rule))
    value = float(known(rule, trace) if known is not None else rule.margin(trace))
    return min(value, UNTRIED)


def never_lost(_: irsim.NeverLost, trace: Trace) -> float:
    """In every ten frames in a row that count there is one that is not off (`irtrack.metrics.lost.LOSS_RULE`)."""
    on = _on_target(trace)[trace.counted]
    if len(on) < OFF_IN_A_ROW:
        return UNTRIED
    return float(np.lib.stride_tricks.sliding_window_view(on, OFF_IN_A_ROW).max(axis=1).min())


def error_below(rule: irsim.ErrorBelow, trace: Trace) -> float:
    """The error that the wanted share of the frames does not exceed is less than the bound, or the truth's accuracy."""
    shares = np.sort((trace.errors / np.fmax(rule.px, trace.accuracy))[trace.counted])
    return 1 - float(shares[math.ceil(rule.share * len(shares)) - 1]) if len(shares) else UNTRIED


def reacquired_within(rule: irsim.ReacquiredWithin, trace: Trace) -> float:
    """After every return into sight some frame in time is not off. A sight that ends before the time is up tells
    nothing, unless the tracker was there."""
    on, margins = _on_target(trace), [UNTRIED]
    for each in trace.returns:
        in_time = on[each.at : each.at + min(each.watched, rule.frames + 1)]
        if each.watched > rule.frames or in_time.max() >= 0:
            margins.append(float(in_time.max()))
    return min(margins)


def honest_while_hidden(rule: irsim.HonestWhileHidden, trace: Trace) -> float:
    """In every stretch without the target the last claim of "tracking" comes in time."""
    margins = [UNTRIED]
    margins += [(rule.within - frames) / max(rule.within, 1) for _, frames in claims_while_gone(trace)]
    return min(margins)


def claims_while_gone(trace: Trace) -> list[tuple[int, int]]:
    """Of every stretch without the target: (position of its first frame, how many frames into it the track still says
    "tracking"; 0 where it does not)."""
    gone = ~trace.truth.present | (trace.visible == 0)
    gone[:1] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], gone, [False]]).astype(np.int8)))
    found = []
    for begin, end in edges.reshape(-1, 2).tolist():
        claims = np.flatnonzero(trace.statuses[begin:end] == "tracking")
        found.append((begin, int(claims[-1]) + 1 if len(claims) else 0))
    return found


MARGINS: dict[type[irsim.Expectation], Callable[[Any, Trace], float]] = {
    irsim.NeverLost: never_lost,
    irsim.ErrorBelow: error_below,
    irsim.ReacquiredWithin: reacquired_within,
    irsim.HonestWhileHidden: honest_while_hidden,
}
"""The margin of every kind of rule."""


def shortest(rule: irsim.Expectation, trace: Trace) -> int:
    """How many frames of a track that breaks the rule are enough to break it."""
    return next(n for n in range(1, len(trace.indices) + 1) if margin(rule, trace.first(n)) < 0)


def in_words(rule: irsim.Expectation) -> str:
    """'error_below (px 5, share 1)'."""
    values: Sequence[str] = [f"{key} {value}" for key, value in rule.model_dump().items() if value is not None]
    return f"{rule.kind} ({', '.join(values)})" if values else rule.kind


def _on_target(trace: Trace) -> Floats:
    """(n,): 1 on the target, 0 where it begins to be off, below where it is; nan where there is no target."""
    return np.asarray(1 - trace.errors / off_beyond(trace.truth.diagonals, trace.accuracy))


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
