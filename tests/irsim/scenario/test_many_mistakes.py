"""Scenarios with many mistakes: the work grows as their number, not as its square."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import pytest

import irsim

TARGET = "{{id: t{k}, shape: {{kind: {shape}}}, path: {{kind: {path}}}}}"


def kinds(count: int) -> str:
    return "targets: [" + ", ".join(TARGET.format(k=k, shape="pont", path="straigt") for k in range(count)) + "]\n"


def names(count: int) -> str:
    return f"without: [{', '.join(f'x{k}' for k in range(count))}]\n"


def chain(count: int) -> str:
    point = "point, area_m2: 1"
    first = TARGET.format(k=0, shape=point, path="straight, start: [1, 1]")
    rest = [TARGET.format(k=k, shape=point, path=f"follow, target: t{k - 1}") for k in range(1, count)]
    return f"targets: [{', '.join([first, *rest])}]\n"


def calls(text: str) -> int:
    """Return the number of calls of functions while a text is read."""
    found = 0

    def count(frame: Any, event: str, argument: Any) -> None:
        nonlocal found
        found += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        with suppress(irsim.InputError):
            irsim.loads(f"background: {{kind: sky}}\n{text}")
    finally:
        sys.setprofile(None)
    return found


@pytest.mark.parametrize("mistakes", [kinds, names, chain])
def test_work_grows_as_the_number_of_mistakes(mistakes: Callable[[int], str]) -> None:
    calls(mistakes(2))  # imports
    assert calls(mistakes(96)) < 6 * calls(mistakes(24))


def test_a_circle_behind_a_chain_is_found() -> None:
    text = chain(3).replace("kind: straight, start: [1, 1]", "kind: follow, target: t1")
    with pytest.raises(irsim.InputError, match="t0, t1 refer to each other in a circle"):
        irsim.loads(f"background: {{kind: sky}}\n{text}")
