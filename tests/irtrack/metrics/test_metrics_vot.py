"""The figures of the VOT challenge, and runs from anchors."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.types import Box, TargetTruth, Truth
from irtrack.metrics import AnchorRun, vot
from irtrack.metrics.vot import orders, run_anchors


def run(overlap: list[float], absent: tuple[int, ...] = ()) -> AnchorRun:
    present = np.ones(len(overlap), bool)
    present[list(absent)] = False
    return AnchorRun(np.array(overlap), present)


def test_progress_by_hand() -> None:
    assert run([1.0] + [0.5] * 20).progress == 21
    assert run([1.0] + [0.5] * 5 + [0.1] * 10 + [0.9]).progress == 6
    assert run([1.0] + [0.5] * 5 + [0.1] * 9 + [0.9] * 5).progress == 20  # nine are no failure
    assert run([1.0] + [0.0] * 12).progress == 0  # the start counts in the row: nothing was told there
    assert run([1.0] + [0.5] * 5 + [0.0] * 12, absent=(10,)).progress == 18  # away in between: the row starts anew


def sequence(k: int) -> list[AnchorRun]:
    """Four runs of overlaps by whole-number arithmetic: some dip, some fail, some hold."""
    runs = []
    for i in range(4):
        n = 40 + 13 * i + 7 * k
        overlap = np.array([(i * 7919 + j * 104729 + k * 1299709) % 1000 / 1000 for j in range(n)])
        if (i + k) % 3 == 0:
            overlap[20 + 5 * i :] *= 0.08
        if (i + k) % 3 == 1:
            overlap[15:22] *= 0.05
        present = np.ones(n, bool)
        present[18:20] = i != 2
        runs.append(AnchorRun(overlap, present))
    return runs


def test_figures_equal_the_vot_toolkit() -> None:
    """vot-toolkit 0.9.0, the steps of AccuracyRobustness, EAOCurves and EAOScore on the same overlaps."""
    found = vot([sequence(k) for k in range(3)], [100, 80, 120], 20, 70)
    assert found.accuracy == pytest.approx(0.4702624036979969)
    assert found.robustness == pytest.approx(0.8101135190918473)
    assert found.eao == pytest.approx(0.3965132381434139)


def test_anchors_start_on_visible_targets() -> None:
    def truth(k: int) -> Truth:
        hidden = 48 <= k < 53
        return Truth(k, k / 10, (TargetTruth("a", (9.0, 9.0), Box(9, 9, 5, 5), visible=0.0 if hidden else 1.0),))

    found = orders([truth(k) for k in range(121)], "a")
    assert found == [range(121), range(53, 121), range(100, -1, -1), range(120, -1, -1)]
    assert orders([truth(k) for k in range(48, 53)], "a") == []


def test_a_tracker_runs_from_anchors_both_ways() -> None:
    import irsim

    scene = irsim.load("sky", ["frames=30"])
    runs = run_anchors("kalman", scene, every=10)
    assert [len(each.overlap) for each in runs] == [30, 20, 21, 30]
    found = vot([runs], [30], 5, 20)
    assert found.robustness > 0.9
    assert found.accuracy < 1 - 1 / 30  # the start frames count as 0
