"""Several tracks against several targets: hand-worked cases, and figures of TrackEval."""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.types import Box
from irtrack.metrics.multi_target import Scene, clear_mot, gospa, hota, idf1


def walk(kind: int) -> list[Scene]:
    """Sixty frames of four targets that cross; tracks swap (kind 1), miss, change names and invent as well (2)."""
    scenes = []
    for k in range(60):
        targets = {
            "a": Box(10.0 + 2 * k, 40.0, 12, 10),
            "b": Box(130.0 - 2 * k, 42.0, 12, 10),
            "c": Box(60.0, 10.0 + k, 8, 8),
        }
        if 15 <= k < 45:
            targets["d"] = Box(100.0, 80.0 - k, 20, 6)
        tracks = {name: Box(box.cx + (k * 7 + 1) % 4, box.cy - k % 3, box.w, box.h) for name, box in targets.items()}
        if kind >= 1 and k >= 30:
            tracks["a"], tracks["b"] = tracks["b"], tracks["a"]
        if kind >= 2:
            if k % 5 == 0:
                tracks.pop("c", None)
            if k > 40:
                tracks["e"] = tracks.pop("a")
            if k % 7 < 3:
                tracks["ghost"] = Box(20.0 + k, 90.0, 10, 10)
        scenes.append(Scene.of(targets, tracks))
    return scenes


# TrackEval 1.3.0 (metrics.HOTA, CLEAR, Identity at their defaults) on the similarities of `walk`:
# (HOTA, DetA, AssA, IDF1, switches, MOTA)
TRACKEVAL = {
    0: (0.5859584002718928, 0.5794510087616199, 0.5927510173503027, 0.7761904761904762, 0, 0.5523809523809524),
    1: (0.4514786202012093, 0.5794510087616199, 0.352032298813096, 0.5238095238095238, 2, 0.5428571428571428),
    2: (0.39944007711922136, 0.49015708377812056, 0.3256320363933376, 0.4689655172413793, 3, 0.4095238095238095),
}


@pytest.mark.parametrize("kind", TRACKEVAL)
def test_figures_equal_trackeval(kind: int) -> None:
    scenes = walk(kind)
    found, clear = hota(scenes), clear_mot(scenes)
    figures = (found.hota, found.detection, found.association, idf1(scenes), clear.switches, clear.mota)
    assert figures == pytest.approx(TRACKEVAL[kind], abs=1e-9)


def test_switches_by_hand() -> None:
    """A pair holds while it is alike enough, though another is more so; a switch counts after a gap too."""
    one = np.array([[0.6, 0.9]])
    first = Scene(("a",), ("x",), np.array([[0.8]]))
    stays = [first, Scene(("a",), ("x", "y"), one)]
    assert clear_mot(stays).switches == 0
    gap = [first, Scene(("a",), (), np.zeros((1, 0))), Scene(("a",), ("y",), np.array([[0.7]]))]
    found = clear_mot(gap)
    assert (found.matches, found.misses, found.false, found.switches) == (2, 1, 0, 1)
    assert found.mota == pytest.approx(1 - 2 / 3)


def test_perfect_tracks_and_none_at_all() -> None:
    same = [Scene(("a", "b"), ("x", "y"), np.eye(2))] * 3
    assert hota(same).hota == idf1(same) == clear_mot(same).mota == 1
    nothing = [Scene((), (), np.zeros((0, 0)))]
    assert np.isnan([hota(nothing).hota, idf1(nothing), clear_mot(nothing).mota]).all()
    missed = [Scene(("a",), (), np.zeros((1, 0)))]
    assert hota(missed).hota == idf1(missed) == clear_mot(missed).mota == 0


points = st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=4).map(
    lambda rows: np.array(rows, dtype=float).reshape(-1, 2)
)


@settings(deadline=None)
@given(points, points, st.integers(1, 20), st.sampled_from([1.0, 2.0]))
def test_gospa_is_the_best_of_all_assignments(targets: np.ndarray, estimates: np.ndarray, c: int, p: float) -> None:
    n, m = len(targets), len(estimates)
    tried = []
    for size in range(min(n, m) + 1):
        for chosen in combinations(range(n), size):
            for partners in permutations(range(m), size):
                gaps = [np.hypot(*(targets[i] - estimates[j])) for i, j in zip(chosen, partners, strict=True)]
                tried.append(sum(gap**p for gap in gaps) + c**p / 2 * (n + m - 2 * size))
    found = gospa(targets, estimates, c, p)
    assert found.distance == pytest.approx(min(tried) ** (1 / p))
    assert found.distance**p == pytest.approx(found.localisation + found.missed + found.false)
    assert gospa(estimates, targets, c, p).distance == pytest.approx(found.distance)
