"""Causes of planted losses: single causes among inert ones, pairs with known values, and losses by chance.

The scenes and the tracker were written before `irtrack.explain` was tuned (tests/support/planted_causes.py).
"""

from __future__ import annotations

import numpy as np
import pytest
from planted_causes import RULES, game, planted

import irtrack
from irtrack.explain import Explanation, explain_loss
from irtrack.explain.game import Game, subsets

ERROR = 0.1
"""Probability with which the planted tracker does the opposite of its rule."""


def explained(seed: int, rule: str, error: float = ERROR) -> Explanation:
    """Return the explanation of the first lost run in a planted scene, with other tracker seeds in each scene."""
    scenario, tracker = planted(seed, rule, error)
    for own in range(1000 * seed, 1000 * seed + 100):
        track = irtrack.run(tracker, scenario, seed=own)
        if irtrack.score(track, scenario).lost:
            return explain_loss(scenario, tracker, tracker_seed=own)
    raise AssertionError("no run is lost")


def test_single_causes_are_first_among_three_inert() -> None:
    found = [explained(seed, "a") for seed in range(60)]
    assert sum(each.shares[0].cause == "a" for each in found) >= 57
    assert sum(set(each.named) > {"a"} for each in found) <= 3
    assert np.mean([each.shares[0].value for each in found]) == pytest.approx(1 - 2 * ERROR, abs=0.12)


@pytest.mark.parametrize("rule", ["a and b", "a or b"])
def test_pairs_have_equal_shares(rule: str) -> None:
    """Each of the two has half of the part that the rule explains, 1 - 2 ERROR."""
    found = [explained(seed, rule) for seed in range(100, 120)]
    values = np.array(
        [[share.value for name in "ab" for share in each.shares if share.cause == name] for each in found]
    )
    np.testing.assert_allclose(values.mean(axis=0), 0.5 * (1 - 2 * ERROR), atol=0.1)
    exact = [explained(seed, rule, 0.0) for seed in range(120, 124)]
    for each in exact:
        assert {share.cause: share.value for share in each.shares[:2]} == {"a": 0.5, "b": 0.5}
        assert set(each.named) == {"a", "b"}


@pytest.mark.parametrize("chance", [0.3, 0.5, 0.8])
def test_inert_causes_are_seldom_named(chance: float) -> None:
    found = [explained(seed, "never", chance) for seed in range(200, 240)]
    assert sum(bool(each.named) for each in found) <= 2


@pytest.mark.parametrize("causes", ["abc", "abcd", "abcdef"])
@pytest.mark.parametrize("chance", [0.2, 0.5, 0.8, 0.95])
def test_games_without_a_cause_name_one_in_five_of_a_hundred(causes: str, chance: float) -> None:
    """Chance anew in each twin, and chance that two of the causes draw anew for all twins alike."""
    anew = [game(causes, lambda present: True, error=1 - chance, seed=seed) for seed in range(1000)]
    assert np.mean([any(share.named for share in each.shares()) for each in anew]) <= 0.05
    named = []
    for seed in range(1000):
        drawn = np.random.default_rng(seed)
        outcomes = {present: drawn.random(5) < chance for present in map(frozenset, ("", "a", "b", "ab"))}
        every = frozenset(causes)
        lost = {removed: outcomes[(every - removed) & frozenset("ab")] for removed in subsets(causes)}
        named.append(any(share.named for share in Game(tuple(causes), lost, drawn.random(5) < chance).shares()))
    assert np.mean(named) <= 0.05


@pytest.mark.parametrize("name", RULES)
def test_the_first_cause_is_right_in_games_with_chance(name: str) -> None:
    rule, values = RULES[name]
    for causes in ("abcd", "abcdef"):
        firsts = [game(causes, rule, error=0.15, seed=seed).shares()[0].cause for seed in range(500)]
        assert np.mean([first in values for first in firsts]) >= 0.95
