"""Rules: margins against their definitions, and explanations of margins by hand."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from traces import trace

import irsim
from irsim.scenario.expectation import Expectation
from irtrack.falsify.rules import KINDS, explain, margin, rule_text, rules_of
from irtrack.metrics import Trace

SPACE = "background: {kind: sky}\n"

frames = st.lists(
    st.tuples(st.integers(0, 12), st.sampled_from([0.0, 0.4, 1.0]), st.sampled_from(["tracking", "lost"])),
    min_size=2,
    max_size=45,
).map(lambda rows: trace([r[0] for r in rows], [r[1] for r in rows], [r[2] for r in rows]))


def test_every_kind_of_rule_has_a_margin() -> None:
    rules = irsim.loads(
        SPACE + "expect: [{kind: never_lost}, {kind: error_below, px: 3}, {kind: reacquired_within, frames: 5},"
        " {kind: honest_while_hidden}, {kind: pd_at_least}, {kind: switches_at_most},"
        " {kind: false_tracks_at_most, per_minute: 1}, {kind: false_alarms_at_most, per_frame: 1}]"
    ).expect
    assert {type(rule) for rule in rules} == set(KINDS)
    assert rule_text(rules[1]) == "error_below (px 3.0, share 1.0)"
    assert [rule.kind for rule in rules_of(irsim.loads(SPACE))] == ["never_lost"]


@given(frames)
def test_never_lost_agrees_with_the_loss_rule(found: Trace) -> None:
    assert (margin(irsim.NeverLost(), found) < 0) == (found.lost_position is not None)


@given(frames, st.integers(1, 12), st.sampled_from([0.5, 0.9, 1.0]))
def test_error_below_agrees_with_its_definition(found: Trace, px: int, share: float) -> None:
    errors = found.errors[found.counted]
    held = len(errors) == 0 or (errors <= px).mean() >= share - 1e-12
    assert (margin(irsim.ErrorBelow(px=float(px), share=share), found) < 0) != held


@given(frames, st.integers(0, 8))
def test_reacquired_within_agrees_with_its_definition(found: Trace, within: int) -> None:
    late = [each for each in found.returns if (each.after is None or each.after > within) and each.watched > within]
    assert (margin(irsim.ReacquiredWithin(frames=within), found) < 0) == bool(late)


@given(frames, st.integers(0, 6))
def test_honest_while_hidden_agrees_with_its_definition(found: Trace, within: int) -> None:
    hidden, late = 0, False
    for k in range(1, len(found.indices)):
        hidden = hidden + 1 if found.visible[k] == 0 else 0
        late |= hidden > within and found.statuses[k] == "tracking"
    assert (margin(irsim.HonestWhileHidden(within=within), found) < 0) == late


def test_margins_by_hand() -> None:
    """Bound 5 px; the best frame of the worst ten; one of 20 frames may be worse."""
    near = trace([0, *[4.0] * 10])
    assert margin(irsim.NeverLost(), near) == pytest.approx(1 - 4 / 5)
    assert margin(irsim.NeverLost(), trace([0, *[7.5] * 9, 3.0, *[7.5] * 9])) == pytest.approx(1 - 3 / 5)
    assert margin(irsim.ErrorBelow(px=8), near) == pytest.approx(0.5)
    assert margin(irsim.ErrorBelow(px=8, share=0.95), trace([0, *[2.0] * 19, 80.0])) == pytest.approx(0.75)
    gone = [1, 1, *[0] * 8, 1, 1, 1]
    claims = ["tracking"] * 6 + ["lost"] * 7
    assert margin(irsim.HonestWhileHidden(within=5), trace([0.0] * 13, gone, claims)) == pytest.approx((5 - 4) / 5)
    back = trace([0.0] * 10 + [10.0, 7.0, 2.0], gone)
    assert margin(irsim.ReacquiredWithin(frames=1), back) == pytest.approx(1 - 7 / 5)
    assert margin(irsim.ReacquiredWithin(frames=2), back) == pytest.approx(1 - 2 / 5)
    assert margin(irsim.ReacquiredWithin(frames=2), trace([0.0] * 5)) == 1


def test_own_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    class Still(Expectation):
        def margin(self, found: Trace) -> float:
            return -0.5

    scene = irsim.loads(SPACE).model_copy(update={"expect": (Still(),)})
    assert margin(rules_of(scene)[0], trace([0, 0])) == -0.5
    monkeypatch.delattr(Still, "margin")
    with pytest.raises(irsim.InputError, match=r"expect\.0: .*has no margin; allowed: never_lost"):
        rules_of(scene)


HIDDEN = [1, 1, *[0] * 8, 1, 1, 1]


@pytest.mark.parametrize(
    ("rule", "found", "asks", "got"),
    [
        (
            irsim.NeverLost(),
            trace([0, 9, 9, 1, *[9] * 4, *[9] * 2, 1], [1] * 6 + [0] * 2 + [1] * 3),
            "never 10 visible frames in a row off the target",
            "4 frames in a row off it, from frame 4 on",  # 4, 5, 8, 9: occluded frames do not count
        ),
        (
            irsim.ErrorBelow(px=3, share=0.95),
            trace([0, *[2.0] * 17, 4.0, 5.0, 6.0]),
            "at most 3 px in 95 % of the frames",
            "5 px, at frame 19",  # of 20 frames one may be worse
        ),
        (
            irsim.ReacquiredWithin(frames=1),
            trace([0.0] * 10 + [9, 8, 7], HIDDEN),
            "on the target again within 1 frame of its return",
            "still not at frame 12, 2 frames after its return at frame 10",
        ),
        (irsim.ReacquiredWithin(frames=1), trace([0.0] * 10 + [9, 8, 2], HIDDEN), "", "2 frames after its return at"),
        (
            irsim.HonestWhileHidden(within=5),
            trace([0.0] * 13, HIDDEN, ["tracking"] * 9 + ["lost"] * 4),
            'status "tracking" no longer than 5 frames after the target\'s disappearance',
            "7 frames after its disappearance at frame 2",
        ),
    ],
)
def test_explanation(rule: Expectation, found: Trace, asks: str, got: str) -> None:
    explanation = explain(rule, found)
    assert asks in explanation.asked
    assert explanation.reached.startswith(got)
    assert explanation.margin == margin(rule, found)


def test_explanation_of_own_rule() -> None:
    class Own(Expectation):
        def margin(self, found: Trace) -> float:
            return -0.125

    explanation = explain(Own(), trace([0, 0]))
    assert (explanation.asked, explanation.reached) == ("a margin of 0 or more", "a margin of -0.125")
