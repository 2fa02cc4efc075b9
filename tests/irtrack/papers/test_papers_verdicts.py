"""Verdicts on claims and goals, rules, and choices on development seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paper_runs import run_at, runs_of

import irtrack
from irtrack.papers import rules
from irtrack.papers.experiment import HARD, Choice, Claim, Goal, PairedRule, Paper, Rule, Run, Scene, Switch
from irtrack.papers.runs import SceneRuns, plan_choices, settle_choices
from irtrack.papers.verdicts import compare_peers, effect, judge, judge_goal, judge_paired, seeds_to_decide, verdict

TINY = Scene.of("tiny")


def test_verdict_needs_an_interval_off_one_half() -> None:
    """Wilson's interval of 10 of 10 is .722 to 1, of 7 of 10 it is .397 to .892 (Wilson 1927; R: prop.test)."""
    assert judge([True] * 10).word == "held"
    assert judge([False] * 10).word == "not held"
    judgement = judge([True] * 7 + [False] * 3)
    assert judgement[:2] == (7, 10)
    assert judgement.word == "not decidable"
    assert (judgement.low, judgement.high) == pytest.approx((0.397, 0.892), abs=5e-4)


def test_share_of_95_percent_needs_73_seeds() -> None:
    """Wilson's lower end of n of n is n / (n + z^2), above .95 from n = 19 z^2 = 72.99 on."""
    assert judge([True] * 73, 0.95).word == "held"
    undecided = judge([True] * 50, 0.95)
    assert (undecided.word, undecided.why) == ("not decidable", "about 73 seeds would decide")
    assert judge([True] * 40 + [False] * 10, 0.95).word == "not held"


@pytest.mark.parametrize(("share", "wanted"), [(0.7, 0.5), (0.9, 0.95)])
def test_seeds_to_decide_is_the_least_number(share: float, wanted: float) -> None:
    """The Wilson interval excludes the wanted share from that number on."""
    n = seeds_to_decide(share, wanted)
    assert n is not None

    def excluded(count: int) -> bool:
        low, high = irtrack.metrics.wilson(share * count, count)  # type: ignore[arg-type]  # a share of runs
        return not low <= wanted <= high

    assert excluded(n)
    assert not excluded(n - 1)


def test_claim_of_absent_tracker_or_failed_runs() -> None:
    (outcome,) = runs_of("tiny", a=[run_at(0)]).values()
    found = {"tiny": replace(outcome, absent={"b": "unknown tracker 'b'"})}
    judgement = verdict(Claim("b holds", "p. 1", TINY, rules.holds("b")), found).judgement
    assert (judgement.word, judgement.why) == ("not decidable", "unknown tracker 'b'")
    found = runs_of("tiny", a=[run_at(0), None, run_at(0)], b=[run_at(3), run_at(3), None])
    claim = Claim("a is nearer", "", TINY, rules.less(rules.error_all, "a", "b"))
    assert verdict(claim, found).judgement.decided == 1


HIDDEN = np.ones(30)
HIDDEN[10:15] = 0
RUNS = {
    "near": run_at(1),
    "two": run_at(2),
    "six": run_at(6),
    "far": run_at(40),
    "back": run_at(1, visible=HIDDEN),
    "never back": run_at(40, visible=HIDDEN),
}


@pytest.mark.parametrize(
    ("rule", "answer"),
    [
        (rules.holds("near"), True),
        (rules.loses("far"), True),
        (rules.less(rules.error_all, "two", "six"), True),
        (rules.less(rules.error_all, "two", "two"), None),
        (rules.times(rules.error_all, "six", 3.1, "two"), False),
        (rules.nearly(rules.error_all, "two", "six", 3.9), False),
        (rules.at_most(rules.abs_x, "two", 2), True),
        (rules.mostly_nearer("two", "six"), True),
        (rules.nearly(rules.cpu, "two", "six", 0, relative=True), True),  # both take 2 ms
        (rules.loses_about("far", 3, 2), True),  # lost at frame 1
        (rules.loses_about("near", 3, 2), False),
        (rules.on_target("near", 5, 9), True),
        (rules.at_most(rules.unless_lost(rules.abs_x), "six", 2), False),
        (rules.at_most(rules.unless_lost(rules.abs_x), "far", 2), None),
        (rules.back_in_time("back"), True),
        (rules.back_in_time("never back"), False),
        (rules.back_in_time("near"), None),
    ],
    ids=lambda value: getattr(value, "words", str(value)),
)
def test_rules(rule: Rule, answer: bool | None) -> None:
    assert rule.of(RUNS) is answer


def test_bounded_error_counts_lost_runs() -> None:
    """A box of 6 x 6 px: a frame is off beyond hypot(6, 6) = 8.49 px."""
    assert rules.bounded_error.of(run_at(4)) == pytest.approx(4)
    assert rules.bounded_error.of(run_at(300)) == pytest.approx(np.hypot(6, 6))
    assert rules.bounded_share.of(run_at(300)) == pytest.approx(1)


CLOSE = [4.0, 4.1, 3.9, 4.05, 3.95, 4.0, 4.1, 3.9]
"""Errors of a control, px."""


@pytest.mark.parametrize(
    ("rule", "shift", "word"),
    [
        (rules.nearer("a", "b"), -1.0, "held"),
        (rules.nearer("a", "b"), 1.0, "not held"),
        (rules.nearer("a", "b"), 0.0, "no difference"),
        (rules.no_worse("a", "b"), -1.0, "held"),
        (rules.no_worse("a", "b"), 0.2, "held"),
        (rules.no_worse("a", "b"), 1.0, "not held"),
        (rules.as_near("a", "b"), 0.0, "held"),
        (rules.as_near("a", "b"), -1.0, "not held"),
        (rules.as_near("a", "b"), 0.4, "not decidable"),
    ],
    ids=lambda value: value.kind if isinstance(value, PairedRule) else str(value),
)
def test_paired_rules_have_a_margin_of_a_tenth(rule: PairedRule, shift: float, word: str) -> None:
    """The control's mean is 4 px, the margin .4 px; the differences have a standard deviation of .15 px."""
    noise = np.array([0.2, -0.2, 0.1, -0.1, 0.15, -0.15, 0.05, -0.05])
    runs = [{"a": run_at(each + shift + extra), "b": run_at(each)} for each, extra in zip(CLOSE, noise, strict=True)]
    judgement = judge_paired(rule, runs)
    assert judgement.word == word
    assert judgement.difference is not None
    assert judgement.difference.mean == pytest.approx(shift)
    assert bool(judgement.why) == (word == "not decidable")
    assert judge_paired(rule, runs[:5]).why == "fewer than 6 seeds decide"


def test_figures_of_frames_and_statuses() -> None:
    assert rules.error_over(0, 5).of(run_at(4)) == pytest.approx(4)
    assert rules.error_over(40, 50).of(run_at(4)) is None
    assert (rules.detected.of(run_at(1)), rules.false_alarms.of(run_at(30))) == (1, 1)
    assert (rules.detected.of(run_at(1, "lost")), rules.false_alarms.of(run_at(30, "lost"))) == (0, 0)


def test_effect_is_a_paired_difference() -> None:
    found = runs_of("tiny", a=[run_at(1), run_at(1), run_at(1)], b=[run_at(3), run_at(4), None])["tiny"]
    result = effect(Switch("a mechanism", TINY, "a", "b"), found)
    assert result.error is not None
    assert result.error.mean == pytest.approx(-2.5)
    assert result.seeds == 2
    assert effect(Switch("a mechanism", TINY, "a", "c"), found).why == "c was not run"


def hard_runs(**runs: list[Run | None]) -> dict[str, SceneRuns]:
    return {name: runs_of(name, **runs)[name] for name in (experiment.scene.name for experiment in HARD)}


def test_best_of_ours_is_chosen_on_development_seeds() -> None:
    """Another tracker is better on the compared seeds; it is not chosen."""
    development = hard_runs(grey_pf=[run_at(1)], template=[run_at(40)])
    fresh = hard_runs(grey_pf=[run_at(40)] * 8, template=[run_at(1)] * 8, dlib=[run_at(1)] * 8)
    for each in compare_peers(fresh, development):
        assert (each.best, each.own, each.other, each.word) == ("grey_pf", 1, 0, "not held")


def test_failed_peer_counts_as_off_throughout() -> None:
    found = hard_runs(grey_pf=[run_at(1)] * 3, cv_kcf=[None, run_at(1), None])
    each = next(each for each in compare_peers(found, found) if each.peer == "cv_kcf")
    assert each.best == "grey_pf"
    assert (each.other, each.difference.mean) == pytest.approx((2 / 3, -2 / 3))


def test_choice_is_made_on_development_seeds() -> None:
    paper = Paper("p", "", switches=(Switch("m", TINY, "own", Choice((TINY,), ("a", "b", "c"))),))
    assert plan_choices([paper]) == {TINY: {"a": "a", "b": "b", "c": "c"}}
    found = runs_of("tiny", a=[run_at(40), run_at(1)], b=[run_at(1), run_at(1)], c=[None, None])
    assert settle_choices(paper, found).switches == (Switch("m", TINY, "own", "b"),)


def test_goal_of_a_share_of_seeds() -> None:
    goal = Goal("kept", TINY, "a", rules.holds("a"), 0.5)
    result = judge_goal(goal, runs_of("tiny", a=[*[run_at(1)] * 9, None]))
    assert (result.value, result.seeds, result.word) == (1, 9, "held")
    absent = judge_goal(replace(goal, label="z"), runs_of("tiny", a=[run_at(1)]))
    assert (absent.word, absent.why) == ("not decidable", "z was not run")


def test_goal_of_a_mean_over_seeds() -> None:
    """1, 2, 3 px: mean 2, t(.975, 2) = 4.303 and sd 1, so 2 +- 4.303 / sqrt 3 (tables of Student's t)."""
    found = runs_of("tiny", a=[run_at(1), run_at(2), run_at(3), run_at(40)])
    goal = Goal("", TINY, "a", rules.unless_lost(rules.abs_x), 2.5)
    result = judge_goal(goal, found)
    assert result.value == pytest.approx(2)
    assert (result.seeds, result.word) == (3, "not decidable")
    assert (result.low, result.high) == pytest.approx((2 - 2.4843, 2 + 2.4843), abs=1e-3)
    assert "about 75 seeds" in result.why  # (4.303 x 1 / .5)^2 = 74.05
    assert judge_goal(replace(goal, wanted=4.5), found).word == "held"
