"""Shares of causes by games with known values: no scene is rendered."""

from __future__ import annotations

import numpy as np
import pytest
from planted_causes import RULES, game

from irtrack.explain.game import Game, is_full


@pytest.mark.parametrize("causes", ["abcd", "abcdef"])
@pytest.mark.parametrize("name", RULES)
def test_known_values_are_found_and_named(name: str, causes: str) -> None:
    """Among inert causes, with all subsets and with first and last arrivals."""
    rule, values = RULES[name]
    shares = game(causes, rule).shares()
    assert is_full(causes) == (len(causes) == 4)
    for share in shares:
        assert share.value == pytest.approx(values.get(share.cause, 0.0))
        assert share.low < share.value < share.high or share.value == 1
        assert share.named == (share.cause in values)


@pytest.mark.parametrize("seed", range(5))
def test_shapley_values_add_up(seed: int) -> None:
    found = game("abcd", RULES["or"][0], error=0.4, seed=seed)
    assert sum(share.value for share in found.shares()) == pytest.approx(found.probability() - found.p_none)
    assert found.residual == pytest.approx(0, abs=1e-12)


def test_the_residual_of_first_and_last_arrivals_is_stated() -> None:
    """Three causes that are needed together: each is last alone, so that the shares add up to 1.5."""
    found = game("abcdef", lambda present: set("abc") <= present)
    assert found.residual == pytest.approx(-0.5)


def test_a_cause_that_holds_the_track_has_a_negative_share() -> None:
    found = game("ab", lambda present: "a" not in present)
    assert [(share.cause, share.value) for share in found.shares()] == [("b", 0.0), ("a", -1.0)]
    assert found.p_none == 1
    assert not any(share.named for share in found.shares())


def test_a_single_cause_is_the_largest_and_inert_ones_are_not_named() -> None:
    """In 200 games each with a tenth of errors; inert causes with half of the runs lost by chance."""
    single = [game("abcd", RULES["single"][0], error=0.1, seed=seed).shares() for seed in range(200)]
    assert sum(shares[0].cause == "a" for shares in single) >= 190
    assert sum(any(share.named for share in shares[1:]) for shares in single) <= 10
    inert = [game("abcd", lambda present: True, error=0.5, seed=seed).shares() for seed in range(200)]
    assert sum(any(share.named for share in shares) for shares in inert) <= 10


def test_minimal_repairs_and_their_frequency() -> None:
    assert [(each.causes, each.restored) for each in game("abc", RULES["and"][0]).repairs()] == [
        (("a",), 5),
        (("b",), 5),
    ]
    assert [(each.causes, each.restored) for each in game("abc", RULES["or"][0]).repairs()] == [(("a", "b"), 5)]
    many = game("abcdef", RULES["or"][0])
    assert not many.repairs()
    assert frozenset("ab") in many.pairs_to_try()


def test_the_placebo_is_the_bar() -> None:
    """Other seeds alone restore all tracks: no cause is named, however large its share."""
    found = game("ab", RULES["single"][0])
    other = Game(found.causes, found.lost, np.zeros(5, dtype=bool))
    assert other.placebo_effect == 1
    assert not any(share.named for share in other.shares())
    assert other.placebo_restored == 0.5
