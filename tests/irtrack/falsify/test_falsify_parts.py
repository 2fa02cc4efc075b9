"""Margins of rules beside their definitions, searches beside a planted failure, shrinking beside known minima."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import irsim
from irsim.rng import stream
from irsim.scenario.expectation import Expectation
from irsim.types import Floats
from irtrack.falsify.counterexample import Case, droppable, moves, nearer, shrink
from irtrack.falsify.rules import MARGINS, in_words, margin, rules_of, shortest
from irtrack.falsify.search import SEARCHES, search
from irtrack.metrics import ATTRIBUTES, Trace

SPACE = """
background: {kind: sky}
targets: [{id: jet, cls: a, shape: {kind: point}, path: {kind: straight, start: [10, 10], speed: 1}}]
occluders: [{kind: bar, id: post, range_m: 100, center_px: [40, 20], size_px: [6, 60]}]
vary:
  camera.netd_mk: {kind: loguniform, low: 40, high: 400, benign: 40}
  targets.jet.path.heading_deg: {kind: uniform, low: -50, high: 50}
  frames: {kind: integers, low: 100, high: 200}
  targets.jet.cls: {kind: choice, values: [a, b, c]}
"""


def trace(errors: Sequence[float], visible: Sequence[float] | None = None, says: Sequence[str] | None = None) -> Trace:
    """A track with these centre errors to a target of 3x4 px (off beyond 5 px) that stands still."""
    n = len(errors)
    true = np.full((n, 2), 50.0)
    return Trace(
        indices=np.arange(n),
        centers=true + np.column_stack([errors, np.zeros(n)]),
        sizes=np.full((n, 2), 5.0),
        statuses=np.array(says or ["tracking"] * n, dtype=np.str_),
        scores=np.full(n, np.nan),
        neffs=np.full(n, np.nan),
        covariances=np.full((n, 2, 2), np.nan),
        truth_centers=true,
        truth_sizes=np.tile([3.0, 4.0], (n, 1)),
        visible=np.array(visible if visible is not None else [1.0] * n, dtype=float),
        accuracy=np.zeros(n),
        marks=np.zeros((n, len(ATTRIBUTES)), dtype=bool),
        step_ms=np.zeros(n),
        cpu_ms=np.zeros(n),
    )


frames = st.lists(
    st.tuples(st.integers(0, 12), st.sampled_from([0.0, 0.4, 1.0]), st.sampled_from(["tracking", "lost"])),
    min_size=2,
    max_size=45,
).map(lambda rows: trace([r[0] for r in rows], [r[1] for r in rows], [r[2] for r in rows]))


def test_every_kind_of_rule_has_a_margin() -> None:
    rules = irsim.loads(
        SPACE + "expect: [{kind: never_lost}, {kind: error_below, px: 3}, {kind: reacquired_within, frames: 5},"
        " {kind: honest_while_hidden}]"
    ).expect
    assert {type(rule) for rule in rules} == set(MARGINS)
    assert in_words(rules[1]) == "error_below (px 3.0, share 1.0)"
    assert [rule.kind for rule in rules_of(irsim.loads(SPACE))] == ["never_lost"]


@given(frames)
def test_never_lost_is_broken_where_the_loss_rule_says_lost(found: Trace) -> None:
    assert (margin(irsim.NeverLost(), found) < 0) == (found.lost_position is not None)


@given(frames, st.integers(1, 12), st.sampled_from([0.5, 0.9, 1.0]))
def test_error_below_is_broken_where_too_few_frames_are_within(found: Trace, px: int, share: float) -> None:
    errors = found.errors[found.counted]
    held = len(errors) == 0 or (errors <= px).mean() >= share - 1e-12
    assert (margin(irsim.ErrorBelow(px=float(px), share=share), found) < 0) != held


@given(frames, st.integers(0, 8))
def test_reacquired_within_is_broken_where_a_return_is_not_in_time(found: Trace, within: int) -> None:
    late = [each for each in found.returns if (each.after is None or each.after > within) and each.watched > within]
    assert (margin(irsim.ReacquiredWithin(frames=within), found) < 0) == bool(late)


@given(frames, st.integers(0, 6))
def test_honest_while_hidden_is_broken_where_a_claim_comes_too_late(found: Trace, within: int) -> None:
    hidden, late = 0, False
    for k in range(1, len(found.indices)):
        hidden = hidden + 1 if found.visible[k] == 0 else 0
        late |= hidden > within and found.statuses[k] == "tracking"
    assert (margin(irsim.HonestWhileHidden(within=within), found) < 0) == late


def test_margins_say_how_near_it_was() -> None:
    """By hand: bound 5 px; the ten frames that are worst at their best; one of 20 frames may be worse."""
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


def test_the_shortest_track_that_breaks_a_rule() -> None:
    assert shortest(irsim.NeverLost(), trace([0] * 5 + [9] * 30)) == 15
    assert shortest(irsim.ErrorBelow(px=3), trace([0, 1, 4, 9])) == 3


def test_a_rule_of_ones_own(monkeypatch: pytest.MonkeyPatch) -> None:
    class Still(Expectation):
        def margin(self, found: Trace) -> float:
            return -0.5

    scene = irsim.loads(SPACE).model_copy(update={"expect": (Still(),)})
    assert margin(rules_of(scene)[0], trace([0, 0])) == -0.5
    monkeypatch.delattr(Still, "margin")
    with pytest.raises(irsim.InputError, match=r"expect\.0: no margin is known.*allowed: never_lost"):
        rules_of(scene)


def planted(dimension: int, k: int) -> Callable[[Floats], float]:
    """The margin of a box that holds 0.5 % of the cube, of random sides, at a random place."""
    rng = stream(5, "planted box", k)
    sides = 0.005 ** rng.dirichlet(np.ones(dimension))
    middle = sides / 2 + (1 - sides) * rng.random(dimension)
    return lambda point: float(np.max(np.abs(point - middle) - sides / 2))


@pytest.mark.parametrize("dimension", [1, 2, 3, 5])
def test_cma_finds_half_a_percent_of_the_space(dimension: int) -> None:
    """In at least 18 of 20 searches of 500 runs, and sooner than chance does on the same boxes."""
    runs: dict[str, list[int]] = {"cma": [], "random": []}
    for kind, found in runs.items():
        for k in range(20):
            box = planted(dimension, k)
            tried = search(kind, dimension, k, 500, lambda batch, box=box: map(box, batch))  # type: ignore[misc]  # mypy cannot type a lambda's default
            found.append(next((each.run for each in tried if each.margin < 0), 501))
    assert sum(run <= 500 for run in runs["cma"]) >= 18
    assert np.median(runs["cma"]) < np.median(runs["random"])


@pytest.mark.parametrize("kind", SEARCHES)
def test_searches_keep_to_their_budget_and_repeat_themselves(kind: str) -> None:
    def points(seed: int) -> Floats:
        tried = list(search(kind, 3, seed, 70, lambda batch: (float(x @ x) for x in batch)))
        assert [each.run for each in tried] == list(range(1, 71))
        return np.array([each.shares for each in tried])

    assert points(1).tobytes() == points(1).tobytes()
    assert points(1).tobytes() != points(2).tobytes()
    assert points(1).min() >= 0
    assert points(1).max() <= 1
    assert len(np.unique(points(1), axis=0)) == 70


@pytest.mark.parametrize("kind", SEARCHES)
def test_a_plateau_does_not_hold_a_search_up(kind: str) -> None:
    tried = [each.shares for each in search(kind, 2, 0, 200, lambda batch: (1.0 for _ in batch))]
    ninths = (np.array(tried) * 3).astype(int).clip(0, 2) @ [3, 1]
    counts = np.bincount(ninths, minlength=9)
    assert counts.min() >= 5  # 22 in each ninth were they even


def test_values_nearer_to_the_benign_one() -> None:
    knobs = {knob.key: knob for knob in irsim.variations(irsim.loads(SPACE)).knobs}
    assert nearer(knobs["camera.netd_mk"], 105.0) == pytest.approx([40, 63.4, 100.5], abs=0.1)
    assert nearer(knobs["targets.jet.path.heading_deg"], -30.0) == [0, 10, -10, 20, -20]
    assert nearer(knobs["targets.jet.path.heading_deg"], -25.0) == [0, 10, -10, 20, -20]
    assert nearer(knobs["frames"], 100) == []
    assert nearer(knobs["targets.jet.cls"], "c") == ["a", "b"]


def test_shrinking_ends_at_the_known_minimum_and_on_the_way_always_breaks() -> None:
    scene = irsim.loads(SPACE)
    space = irsim.variations(scene)

    def fails(case: Case) -> bool:
        point = case.point
        turned = abs(point["targets.jet.path.heading_deg"]) >= 20
        return bool(turned and point["camera.netd_mk"] > 90 and point["frames"] > 130)

    def breaks(cases: Sequence[Case]) -> Iterator[bool]:
        yield from map(fails, cases)

    start = Case(space.at([0.9, 0.05, 0.8, 0.99]))
    assert fails(start)
    names = droppable(scene, {"jet"})
    assert "post" in names
    assert "jet" not in names
    steps = list(shrink(start, moves(space, names), breaks))
    assert all(map(fails, steps))
    least = steps[-1]
    assert set(least.without) == set(names)
    assert least.point == {
        "camera.netd_mk": pytest.approx(40 * 10 ** (2 / 5)),
        "targets.jet.path.heading_deg": 20.0,
        "frames": 140,
        "targets.jet.cls": "a",
    }


def test_what_no_scenario_can_be_made_of_is_no_scene() -> None:
    space = irsim.variations(irsim.loads(SPACE))
    assert Case(space.benign(), frames=7).scenario(space).frames == 7  # type: ignore[union-attr]  # not None, or the test fails
    assert Case(space.benign(), without=("nobody",)).scenario(space) is None
