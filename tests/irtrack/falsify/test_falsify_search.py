"""Searches against a planted box; shrinking against a known minimum."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

import irsim
from irsim.rng import stream
from irsim.types import Floats
from irtrack.falsify.counterexample import Candidate, all_moves, lower_values, removable_parts, shrink
from irtrack.falsify.search import SEARCHES, search

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


def planted(dimension: int, k: int) -> Callable[[Floats], float]:
    """Return the margin of a box with 0.5 % of the cube, of random sides, at a random position."""
    rng = stream(5, "planted box", k)
    sides = 0.005 ** rng.dirichlet(np.ones(dimension))
    middle = sides / 2 + (1 - sides) * rng.random(dimension)
    return lambda point: float(np.max(np.abs(point - middle) - sides / 2))


@pytest.mark.parametrize("dimension", [1, 3])
def test_cma_finds_half_a_percent_of_the_space(dimension: int) -> None:
    """In at least 9 of 10 searches of 500 runs, and sooner than random search on the same boxes."""
    runs: dict[str, list[int]] = {"cma": [], "random": []}
    for kind, found in runs.items():
        for k in range(10):
            box = planted(dimension, k)
            tried = search(kind, dimension, k, 500, lambda batch, box=box: map(box, batch))  # type: ignore[misc]  # mypy cannot type a lambda's default
            found.append(next((each.run for each in tried if each.margin < 0), 501))
    assert sum(run <= 500 for run in runs["cma"]) >= 9
    assert np.median(runs["cma"]) < np.median(runs["random"])


@pytest.mark.parametrize("kind", SEARCHES)
def test_searches_keep_the_budget_and_repeat(kind: str) -> None:
    def points(seed: int) -> Floats:
        tried = list(search(kind, 3, seed, 70, lambda batch: (float(x @ x) for x in batch)))
        assert [each.run for each in tried] == list(range(1, 71))
        return np.array([each.shares for each in tried])

    assert points(1).tobytes() == points(1).tobytes()
    assert points(1).tobytes() != points(2).tobytes()
    assert points(1).min() >= 0
    assert points(1).max() <= 1
    assert len(np.unique(points(1), axis=0)) == 70


def test_lower_values() -> None:
    knobs = {knob.key: knob for knob in irsim.variations(irsim.loads(SPACE)).knobs}
    assert lower_values(knobs["camera.netd_mk"], 105.0) == pytest.approx([40, 63.4, 100.5], abs=0.1)
    assert lower_values(knobs["targets.jet.path.heading_deg"], -30.0) == [0, 10, -10, 20, -20]
    assert lower_values(knobs["targets.jet.path.heading_deg"], -25.0) == [0, 10, -10, 20, -20]
    assert lower_values(knobs["frames"], 100) == []
    assert lower_values(knobs["targets.jet.cls"], "c") == ["a", "b"]


def test_shrinking_ends_at_the_known_minimum() -> None:
    scene = irsim.loads(SPACE)
    space = irsim.variations(scene)

    def fails(candidate: Candidate) -> bool:
        point = candidate.point
        turned = abs(point["targets.jet.path.heading_deg"]) >= 20
        return bool(turned and point["camera.netd_mk"] > 90 and point["frames"] > 130)

    def breaks(candidates: Sequence[Candidate]) -> Iterator[bool]:
        yield from map(fails, candidates)

    start = Candidate(space.at([0.9, 0.05, 0.8, 0.99]))
    assert fails(start)
    names = removable_parts(scene, {"jet"})
    assert "post" in names
    assert "jet" not in names
    steps = list(shrink(start, all_moves(space, names), breaks))
    assert all(map(fails, steps))
    least = steps[-1]
    assert set(least.without) == set(names)
    assert least.point == {
        "camera.netd_mk": pytest.approx(40 * 10 ** (2 / 5)),
        "targets.jet.path.heading_deg": 20.0,
        "frames": 140,
        "targets.jet.cls": "a",
    }
