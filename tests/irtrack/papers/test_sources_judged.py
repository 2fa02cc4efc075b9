"""Claims, goals and picks of the papers' page are judged as stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from source_runs import found_of, run_of

import irtrack
from irtrack.papers import rules
from irtrack.papers.goals import reached
from irtrack.papers.hard import HARD, duels
from irtrack.papers.picks import settled, wanted_choices
from irtrack.papers.runs import Outcome
from irtrack.papers.values import Choice, Claim, Goal, Paper, Rival, Run, Scene, Switch
from irtrack.papers.verdicts import effect, judged, seeds_to_decide, verdict


class TestJudged:
    def test_shares_whose_interval_clears_one_half(self) -> None:
        """Wilson's interval of 10 of 10 is .722 to 1, of 7 of 10 it is .397 to .892 (Wilson 1927; R: prop.test)."""
        assert judged([True] * 10)[4] == "held"
        assert judged([False] * 10)[4] == "not held"
        yes, told, low, high, word, _ = judged([True] * 7 + [False] * 3)
        assert (yes, told, word) == (7, 10, "not decidable")
        assert (low, high) == pytest.approx((0.397, 0.892), abs=5e-4)

    def test_a_goal_of_19_in_20_takes_73_seeds_without_a_failure(self) -> None:
        """Wilson's lower end of n of n is n / (n + z^2), above .95 from n = 19 z^2 = 72.99 on."""
        assert judged([True] * 73, 0.95).word == "held"
        undecided = judged([True] * 50, 0.95)
        assert undecided.word == "not decidable"
        assert undecided.why == "some 73 seeds of the like would decide"
        assert judged([True] * 40 + [False] * 10, 0.95).word == "not held"

    @pytest.mark.parametrize(("share", "wanted"), [(0.7, 0.5), (0.3, 0.5), (0.99, 0.95), (0.9, 0.95)])
    def test_so_many_seeds_decide_and_fewer_do_not(self, share: float, wanted: float) -> None:
        """The interval itself is the oracle: it leaves the wanted share out from that many on."""
        n = seeds_to_decide(share, wanted)
        assert n is not None

        def leaves_out(count: int) -> bool:
            low, high = irtrack.metrics.wilson(share * count, count)  # type: ignore[arg-type]  # a share of runs, as others give it
            return not low <= wanted <= high

        assert leaves_out(n)
        assert not leaves_out(n - 1)

    def test_a_share_that_is_the_wanted_one_is_never_decided(self) -> None:
        assert seeds_to_decide(0.5, 0.5) is None
        assert judged([True, False]).why == "more of the like would not decide"

    def test_seeds_that_tell_nothing_are_left_out(self) -> None:
        assert judged([None, True, None])[:2] == (1, 1)
        assert judged([None])[4:] == ("not decidable", "no seed tells")

    def test_a_claim_of_a_tracker_that_is_not_here_is_not_decidable_and_says_why(self) -> None:
        found = found_of("tiny", a=[run_of(0)])
        (outcome,) = found.values()
        found = {"tiny": replace(outcome, absent={"b": "unknown tracker 'b'"})}
        judgement = verdict(Claim("b holds", "p. 1", "tiny", rules.holds("b")), found).judgement
        assert (judgement.word, judgement.why) == ("not decidable", "unknown tracker 'b'")

    def test_failed_runs_tell_nothing(self) -> None:
        found = found_of("tiny", a=[run_of(0), None, run_of(0)], b=[run_of(3), run_of(3), None])
        claim = Claim("a is nearer", "", "tiny", rules.less(rules.error_all, "error", "a", "b"))
        assert verdict(claim, found).judgement.told == 1


class TestRules:
    def test_holding_and_losing(self) -> None:
        pair = {"near": run_of(1), "far": run_of(40)}
        assert rules.holds("near").of(pair) is True
        assert rules.loses("near").of(pair) is False
        assert rules.loses("far").of(pair) is True

    def test_comparisons(self) -> None:
        pair = {"a": run_of(2), "b": run_of(6)}
        assert rules.less(rules.error_all, "", "a", "b").of(pair) is True
        assert rules.less(rules.error_all, "", "a", "a").of(pair) is None
        assert rules.times(rules.error_all, "", "b", 3, "a").of(pair) is True
        assert rules.times(rules.error_all, "", "b", 3.1, "a").of(pair) is False
        assert rules.nearly(rules.error_all, "", "a", "b", 4).of(pair) is True
        assert rules.nearly(rules.error_all, "", "a", "b", 3.9).of(pair) is False
        assert rules.at_most(rules.abs_x, "", "a", 2).of(pair) is True
        assert rules.mostly_nearer("a", "b").of(pair) is True
        assert rules.mostly_nearer("b", "a").of(pair) is False
        assert rules.as_long("a", "b", 0).of(pair) is True  # both take 2 ms

    def test_a_loss_about_a_frame(self) -> None:
        """Off from frame 1 on: lost there."""
        pair = {"near": run_of(1), "far": run_of(40)}
        assert rules.loses_about("far", 3, 2).of(pair) is True
        assert rules.loses_about("far", 4, 2).of(pair) is False
        assert rules.loses_about("near", 3, 2).of(pair) is False
        assert rules.on_target("near", 5, 9).of(pair) is True
        assert rules.on_target("far", 5, 9).of(pair) is False

    def test_a_lost_run_says_nothing_of_the_error_of_runs_that_are_not_lost(self) -> None:
        limit = rules.at_most(rules.unless_lost(rules.abs_x), "", "a", 2)
        assert limit.of({"a": run_of(1)}) is True
        assert limit.of({"a": run_of(3)}) is False
        assert limit.of({"a": run_of(40)}) is None

    def test_the_error_of_some_frames_leaves_the_start_out(self) -> None:
        assert rules.error_over(0, 5)(run_of(4)) == pytest.approx(4)
        assert rules.error_over(40, 50)(run_of(4)) is None

    def test_being_back_in_time_is_counted_from_the_first_return(self) -> None:
        hidden = np.ones(30)
        hidden[10:15] = 0
        assert rules.back_in_time("a").of({"a": run_of(1, visible=hidden)}) is True
        assert rules.back_in_time("a").of({"a": run_of(40, visible=hidden)}) is False
        assert rules.back_in_time("a").of({"a": run_of(1)}) is None

    def test_detections_and_false_alarms_need_the_word_tracking(self) -> None:
        assert rules.detected(run_of(1)) == 1
        assert rules.false_alarms(run_of(30)) == 1
        assert rules.detected(run_of(1, "lost")) == 0
        assert rules.false_alarms(run_of(30, "lost")) == 0


def test_a_switch_is_told_by_paired_differences() -> None:
    found = found_of("tiny", a=[run_of(1), run_of(1), run_of(1)], b=[run_of(3), run_of(4), None])
    told = effect(Switch("a mechanism", Scene.of("tiny"), "a", "b"), found["tiny"])
    assert told.error is not None
    assert told.error.mean == pytest.approx(-2.5)
    assert told.seeds == 2
    assert effect(Switch("a mechanism", Scene.of("tiny"), "a", "c"), found["tiny"]).why


def hard_found(**runs: list[Run | None]) -> dict[str, Outcome]:
    names = [experiment.scene.name for experiment in HARD]
    return {name: found_of(name, **runs)[name] for name in names}


def test_the_best_of_ours_is_picked_on_development_seeds() -> None:
    """On the seeds that are compared another one is better: it is not taken."""
    development = hard_found(grey_pf=[run_of(1)], template=[run_of(40)])
    fresh = hard_found(grey_pf=[run_of(40)] * 8, template=[run_of(1)] * 8, dlib=[run_of(1)] * 8)
    for duel in duels(fresh, development):
        assert (duel.best, duel.own, duel.other, duel.word) == ("grey_pf", 1, 0, "not held")


def test_a_rival_is_chosen_on_development_seeds() -> None:
    scene = Scene.of("tiny")
    paper = Paper("p", "", rivals=(Rival("m", scene, "own", Choice((scene,), ("a", "b", "c"))),))
    assert wanted_choices([paper]).trackers == {"tiny": {"a": "a", "b": "b", "c": "c"}}
    found = found_of("tiny", a=[run_of(40), run_of(1)], b=[run_of(1), run_of(1)], c=[None, None])
    assert settled(paper, found).switches == (Switch("m", scene, "own", "b"),)


class TestGoals:
    def test_a_share_of_seeds(self) -> None:
        goal = Goal("kept", Scene.of("tiny"), "a", rules.holds("a"), 0.5)
        told = reached(goal, found_of("tiny", a=[run_of(1)] * 9 + [None]))
        assert (told.value, told.seeds, told.word) == (1, 9, "held")

    def test_a_mean_over_seeds(self) -> None:
        """1, 2, 3 px: mean 2, t(.975, 2) = 4.303 and sd 1, so 2 +- 4.303 / sqrt 3 (tables of Student's t)."""
        found = found_of("tiny", a=[run_of(1), run_of(2), run_of(3), run_of(40)])
        figure = rules.unless_lost(rules.abs_x)
        told = reached(Goal("", Scene.of("tiny"), "a", figure, 2.5), found)
        assert told.value == pytest.approx(2)
        assert (told.seeds, told.word) == (3, "not decidable")
        assert (told.low, told.high) == pytest.approx((2 - 2.4843, 2 + 2.4843), abs=1e-3)
        assert "some 75 seeds" in told.why  # (4.303 x 1 / .5)^2 = 74.05
        assert reached(Goal("", Scene.of("tiny"), "a", figure, 4.5), found).word == "held"

    def test_of_a_tracker_that_is_not_here(self) -> None:
        told = reached(Goal("", Scene.of("tiny"), "z", rules.holds("z"), 0.5), found_of("tiny", a=[run_of(1)]))
        assert (told.word, told.why) == ("not decidable", "z was not run")


def test_a_failed_peer_counts_as_off_throughout() -> None:
    found = hard_found(grey_pf=[run_of(1)] * 3, cv_kcf=[None, run_of(1), None])
    duel = next(each for each in duels(found, found) if each.peer == "cv_kcf")
    assert duel.best == "grey_pf"
    assert duel.other == pytest.approx(2 / 3)
    assert duel.difference.mean == pytest.approx(-2 / 3)
