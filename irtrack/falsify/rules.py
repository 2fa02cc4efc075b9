"""Rules that a scenario expects a track, tracks of many targets or detections to keep: margins and explanations.

Margins are the robustness of signal temporal logic (Donzé and Maler, FORMATS 2010, LNCS 6246, 92): "always" is the
least value over time, "at some time" the greatest. A margin below 0 means that the rule is broken. Margins are in units
of the rule's bound and at most 1, so that rules are comparable and a search has a slope to follow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import irsim
from irsim.errors import counted
from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.falsify import scene_rules
from irtrack.falsify.scene_rules import SceneTrace
from irtrack.metrics import Trace
from irtrack.metrics.lost import OFF_IN_A_ROW, off_beyond
from irtrack.metrics.tasks import Task

UNTESTED = 1.0
"""Margin of a rule that no frame of the track tests."""

RULE = "rule"
"""The track breaks a rule of the scenario."""
RAISES = "raises"
"""The tracker raises an exception, a failure in every scenario."""
ENDS = "ends"
"""The tracker ends its process or hangs, a failure in every scenario."""

IMPLICIT = {
    RAISES: ("the tracker raises an exception", "no exception"),
    ENDS: ("its process dies, or it hangs", "an answer within the time limit"),
}
"""Failure and requirement, in words, of the rules that hold in every scenario."""

FAILURES = {
    RULE: ("broke {rules}", "breaks {rules}"),
    RAISES: ("raised an exception", "raises an exception"),
    ENDS: ("ended its process or hung", "ends its process or hangs"),
}
"""Each kind of failure in the past and in the present tense."""


Evidence = Trace | SceneTrace
"""Result of a run, of one target or of all targets, that a rule judges."""


def rules_of(scenario: irsim.Scenario, task: Task = "single") -> tuple[irsim.Expectation, ...]:
    """Return the scenario's rules for a task, by default `DEFAULTS`; InputError for a rule without a margin."""
    for index, rule in enumerate(scenario.expect):
        if type(rule) not in KINDS and not hasattr(rule, "margin"):
            allowed = ", ".join(kind.kind for kind in KINDS)
            raise InputError(
                f"expect.{index}: the kind {rule.kind} has no margin; allowed: {allowed}, or a class with "
                "a method margin(trace)"
            )
        if isinstance(rule, irsim.FalseTracksAtMost | irsim.FalseAlarmsAtMost) and rule.target is not None:
            raise InputError(f"expect.{index}.target: {rule.kind} applies to no single target; allowed: no target")
    return stated_rules(scenario, task) or DEFAULTS[task]


def stated_rules(scenario: irsim.Scenario, task: Task) -> tuple[irsim.Expectation, ...]:
    """Return the rules that a scenario states for a task; a user's class names its tasks in an attribute `tasks`."""
    return tuple(rule for rule in scenario.expect if task in _tasks(rule))


def _tasks(rule: irsim.Expectation) -> tuple[Task, ...]:
    kind = KINDS.get(type(rule))
    tasks: tuple[Task, ...] = getattr(rule, "tasks", ("single",)) if kind is None else kind.tasks
    return tasks


def margin(rule: irsim.Expectation, trace: Evidence) -> float:
    """Return the signed margin of a rule for a track: below 0 where the rule is broken, at most 1."""
    kind = KINDS.get(type(rule))
    return min(float(kind.margin(rule, trace) if kind is not None else rule.margin(trace)), UNTESTED)


def frames_to_break(rule: irsim.Expectation, trace: Evidence) -> int:
    """Return the least number of frames, counted from the start, within which the track breaks the rule."""
    return next(n for n in range(1, len(trace.indices) + 1) if margin(rule, trace.first(n)) < 0)


def rule_text(rule: irsim.Expectation) -> str:
    """Return the rule with its parameters: 'error_below (px 5, share 1)'."""
    values = [f"{key} {value}" for key, value in rule.model_dump().items() if value is not None]
    return f"{rule.kind} ({', '.join(values)})" if values else rule.kind


@dataclass(frozen=True, slots=True)
class Explanation:
    """Explanation of a margin: requirement of the rule and result of the track, in words."""

    asked: str
    reached: str
    margin: float


def explain(rule: irsim.Expectation, trace: Evidence) -> Explanation:
    """Return the explanation of a rule's margin; frames are given by their indices."""
    value, kind = margin(rule, trace), KINDS.get(type(rule))
    if kind is None:
        return Explanation("a margin of 0 or more", f"a margin of {value:.3g}", value)
    return Explanation(kind.requirement(rule), kind.result(rule, trace), value)


def explain_all(scenario: irsim.Scenario, trace: Evidence, target: str | None, task: Task) -> list[Explanation]:
    """Return the explanations of the rules that a scenario states for a task; for one target, only of rules about
    it."""
    rules = stated_rules(scenario, task)
    return [explain(rule, trace) for rule in rules if task != "single" or rule.target in (None, target)]


@dataclass(frozen=True, slots=True)
class RuleKind:
    """Functions of one kind of rule: margin, requirement in words, and result of a track in words; and its tasks."""

    margin: Callable[[Any, Any], float]
    requirement: Callable[[Any], str]
    result: Callable[[Any, Any], str]
    tasks: tuple[Task, ...] = ("single",)


def _distance_to_off(trace: Trace) -> Floats:
    """Return 1 - error / (largest error on target), (n,): below 0 where a frame is off target; nan without a target."""
    return np.asarray(1 - trace.errors / off_beyond(trace.truth.diagonals, trace.accuracy))


def _never_lost_margin(_: irsim.NeverLost, trace: Trace) -> float:
    """Return the min over runs of ten counted frames of the max over the run of `_distance_to_off` (see
    `LOSS_RULE`)."""
    on = _distance_to_off(trace)[trace.counted]
    if len(on) < OFF_IN_A_ROW:
        return UNTESTED
    return float(np.lib.stride_tricks.sliding_window_view(on, OFF_IN_A_ROW).max(axis=1).min())


def _never_lost_result(_: irsim.NeverLost, trace: Trace) -> str:
    """Describe the longest run of successive counted frames off target."""
    judged = np.flatnonzero(trace.counted)
    edges = np.diff(np.concatenate([[False], trace.off[judged], [False]]).astype(np.int8))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    if not len(begins):
        return "never off the target"
    worst = int(np.argmax(ends - begins))
    row = counted(int(ends[worst] - begins[worst]), "frame")
    return f"{row} in a row off it, from frame {trace.indices[judged[begins[worst]]]} on"


def _error_margin(rule: irsim.ErrorBelow, trace: Trace) -> float:
    """Return 1 - e / px, where e is the `share` quantile of the error, and px is at least the accuracy of the truth."""
    ratios = np.sort((trace.errors / np.fmax(rule.px, trace.accuracy))[trace.counted])
    return 1 - float(ratios[math.ceil(rule.share * len(ratios)) - 1]) if len(ratios) else UNTESTED


def _error_requirement(rule: irsim.ErrorBelow) -> str:
    share = "every frame" if rule.share == 1 else f"{100 * rule.share:g} % of the frames"
    return f"a centre error of at most {rule.px:g} px in {share}"


def _error_result(rule: irsim.ErrorBelow, trace: Trace) -> str:
    errors, indices = trace.errors[trace.counted], trace.indices[trace.counted]
    if not len(errors):
        return "no counted frame"
    at = int(np.argsort(errors, kind="stable")[math.ceil(rule.share * len(errors)) - 1])
    return f"{errors[at]:.3g} px, at frame {indices[at]}"


def _return_margin(rule: irsim.ReacquiredWithin, trace: Trace) -> float:
    """Return the min over reappearances of the target of the max over the allowed frames of `_distance_to_off`.

    A reappearance shorter than the allowed frames counts only where the tracker was on the target.
    """
    on, margins = _distance_to_off(trace), [UNTESTED]
    for each in trace.returns:
        in_time = on[each.at : each.at + min(each.watched, rule.frames + 1)]
        if each.watched > rule.frames or in_time.max() >= 0:
            margins.append(float(in_time.max()))
    return min(margins)


def _return_result(rule: irsim.ReacquiredWithin, trace: Trace) -> str:
    """Describe the slowest reacquisition, of the reappearances that decide the rule."""
    deciding = [each for each in trace.returns if each.after is not None or each.watched > rule.frames]
    if not deciding:
        return "no return that decides"
    worst = max(deciding, key=lambda each: each.watched if each.after is None else each.after)
    back = f"after its return at frame {trace.indices[worst.at]}"
    if worst.after is None:
        last = trace.indices[worst.at + worst.watched - 1]
        return f"still not at frame {last}, {counted(worst.watched - 1, 'frame')} {back}"
    return f"{counted(worst.after, 'frame')} {back}"


def _false_claims(trace: Trace) -> list[tuple[int, int]]:
    """Return, for each interval without a visible target, (position of its first frame, frames to its last "tracking").

    The second number is 0 where the status is never "tracking" in the interval.
    """
    gone = ~trace.truth.present | (trace.visible == 0)
    gone[:1] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[False], gone, [False]]).astype(np.int8)))
    found = []
    for begin, end in edges.reshape(-1, 2).tolist():
        claims = np.flatnonzero(trace.statuses[begin:end] == "tracking")
        found.append((begin, int(claims[-1]) + 1 if len(claims) else 0))
    return found


def _claim_margin(rule: irsim.HonestWhileHidden, trace: Trace) -> float:
    """Return the least share of `within` left after the last "tracking", over intervals without target."""
    margins: list[float] = [(rule.within - frames) / max(rule.within, 1) for _, frames in _false_claims(trace)]
    return min([UNTESTED, *margins])


def _claim_result(_: irsim.HonestWhileHidden, trace: Trace) -> str:
    claims = _false_claims(trace)
    if not claims:
        return "no frame without the target"
    begin, frames = max(claims, key=lambda each: each[1])
    return f"{counted(frames, 'frame')} after its disappearance at frame {trace.indices[begin]}"


KINDS: dict[type[irsim.Expectation], RuleKind] = {
    irsim.NeverLost: RuleKind(
        _never_lost_margin,
        lambda _: f"never {OFF_IN_A_ROW} visible frames in a row off the target",
        _never_lost_result,
    ),
    irsim.ErrorBelow: RuleKind(_error_margin, _error_requirement, _error_result),
    irsim.ReacquiredWithin: RuleKind(
        _return_margin,
        lambda rule: f"on the target again within {counted(rule.frames, 'frame')} of its return",
        _return_result,
    ),
    irsim.HonestWhileHidden: RuleKind(
        _claim_margin,
        lambda rule: (
            f'status "tracking" no longer than {counted(rule.within, "frame")} after the target\'s disappearance'
        ),
        _claim_result,
    ),
    irsim.PdAtLeast: RuleKind(
        scene_rules.pd_margin, scene_rules.pd_requirement, scene_rules.pd_result, ("many", "detect")
    ),
    irsim.SwitchesAtMost: RuleKind(
        scene_rules.switches_margin, scene_rules.switches_requirement, scene_rules.switches_result, ("many",)
    ),
    irsim.FalseTracksAtMost: RuleKind(
        scene_rules.false_tracks_margin,
        scene_rules.false_tracks_requirement,
        scene_rules.false_tracks_result,
        ("many",),
    ),
    irsim.FalseAlarmsAtMost: RuleKind(
        scene_rules.false_alarms_margin,
        scene_rules.false_alarms_requirement,
        scene_rules.false_alarms_result,
        ("detect",),
    ),
}
"""Functions by kind of rule. The margin of a rule of a user's class is that of its own method; it has no
explanation."""

DEFAULTS: dict[Task, tuple[irsim.Expectation, ...]] = {
    "single": (irsim.NeverLost(),),
    "many": (irsim.PdAtLeast(), irsim.SwitchesAtMost()),
    "detect": (irsim.PdAtLeast(),),
}
"""Rules of each task where the scenario states none."""
