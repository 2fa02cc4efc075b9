"""Ends of what a likelihood allows of variances that are not below 0, against a general optimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from irsim.measure.allowed import Allowed
from irsim.rng import stream
from irsim.types import Floats


def drawn(seed: int, kept: tuple[bool, ...]) -> Allowed:
    """About a greatest value where some variances are 0, as more than that would be unlikelier."""
    random = stream(seed, "allowed")
    square = random.normal(size=(len(kept), len(kept)))
    free = np.array(kept)
    variances = np.where(free, random.uniform(0.1, 3, len(kept)), 0)
    return Allowed(variances, np.where(free, 0, random.uniform(0, 2, len(kept))), square.T @ square)


def least(allowed: Allowed, function: Floats, room: float) -> float:
    """By sequential quadratic programming from several starts."""

    def left(variances: Floats) -> float:
        moved = variances - allowed.variances
        return room - float(allowed.slopes @ moved + moved @ allowed.information @ moved)

    count = len(function)
    ends = []
    for start in range(12):
        begin = allowed.variances + np.abs(stream(start, "start").normal(0, 0.3, count))
        bounds = [(0, None)] * count
        found = minimize(
            lambda x: float(function @ x), begin, bounds=bounds, constraints={"type": "ineq", "fun": left}, tol=1e-10
        )
        if found.success and left(found.x) > -1e-6:
            ends.append(float(found.fun))
    return min(ends)


@pytest.mark.parametrize("kept", [(True, True, True), (True, False, True), (False, True, False), (False, False, False)])
def test_ends_are_those_of_a_general_optimiser(kept: tuple[bool, ...]) -> None:
    for seed in range(4):
        allowed = drawn(seed, kept)
        function = stream(seed, "function").normal(size=3)
        low, high = allowed.ends(function, 0.8)
        assert low == pytest.approx(least(allowed, function, 0.8), abs=1e-4)
        assert high == pytest.approx(-least(allowed, -function, 0.8), abs=1e-4)


def test_two_that_look_alike_are_bounded_by_their_sum() -> None:
    """Of what is 2 in all, with an error of 0.1, each of two may have anything from none on."""
    alike = Allowed(np.array([2.0, 0.0]), np.zeros(2), np.full((2, 2), 100.0))
    assert alike.ends(np.array([1.0, 0.0]), 1.0) == pytest.approx((0, 2.1), abs=1e-6)
    assert alike.ends(np.array([0.0, 1.0]), 1.0) == pytest.approx((0, 2.1), abs=1e-6)
    assert alike.ends(np.array([1.0, 1.0]), 1.0) == pytest.approx((1.9, 2.1), abs=1e-6)
