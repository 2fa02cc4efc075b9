"""Figures of detectors and of masks: pyirstdmetrics, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from oracle_cases import masks
from oracles import values_of

from irsim.types import Box, TargetTruth, Truth
from irtrack.errors import InputError
from irtrack.metrics.detection import DetectionFigures, roc
from irtrack.metrics.masks import mask_sums
from irtrack.tracks import DetectionSet


@pytest.mark.parametrize("seed", range(len(values_of("pyirstdmetrics"))))
def test_masks_equal_pyirstdmetrics(seed: int) -> None:
    predictions, truths = zip(*masks(seed), strict=True)
    sums = mask_sums(predictions, truths)
    for name, value in values_of("pyirstdmetrics")[seed].items():
        assert np.nan_to_num(getattr(sums, name)) == pytest.approx(value, abs=1e-12), name


def test_masks_of_wrong_shape_or_value() -> None:
    with pytest.raises(InputError, match="allowed: maps of one shape"):
        mask_sums([np.zeros((4, 5))], [np.zeros((5, 4), bool)])
    with pytest.raises(InputError, match="from 0 to 1"):
        mask_sums([np.full((4, 5), 255.0)], [np.zeros((4, 5), bool)])


def detections(rows: list[tuple[int, float, float, float]], frames: int) -> DetectionSet:
    """Return a set of (frame, x, y, score), 5 px wide."""
    table = np.array(sorted(rows), dtype=np.float64).reshape(-1, 4)
    ones, side = np.ones(frames), np.full(len(table), 5.0)
    index = table[:, 0].astype(np.int64)
    columns = (index, table[:, 1], table[:, 2], side, side, table[:, 3])
    return DetectionSet("s", "h", "d", {}, "display", 0, np.arange(frames), ones, ones, ones, *columns)


def truth(index: int, *targets: tuple[str, float, float | None]) -> Truth:
    """Return targets (id, x, visible) at y = 50, 4 px wide."""
    return Truth(
        index, index / 30, tuple(TargetTruth(id, (x, 50.0), Box(x, 50, 4, 4), visible=v) for id, x, v in targets)
    )


def test_figures_by_hand() -> None:
    """Four frames: found, missed, found twice with a false alarm stronger than one of them, hidden with a detection."""
    truths = [truth(k, ("a", 20.0, 0.1 if k == 3 else 1.0)) for k in range(4)]
    found = detections([(0, 21, 50, 9), (2, 20, 52, 5), (2, 19, 50, 6), (2, 90, 50, 7), (3, 20, 50, 8)], 4)
    figures = DetectionFigures.of(truths, found, 30.0)
    assert figures.pd == pytest.approx(2 / 3)
    assert (figures.false_alarms, figures.false_alarms_s) == (0.25, 7.5)
    assert figures.pd_at(0.1) == pytest.approx(1 / 3)  # above the score of the false alarm: only frame 0
    assert figures.pd_at(1) == figures.pd
    assert figures.first_detection == 0
    assert figures.rmse == pytest.approx(1.0)


def test_radius_follows_the_larger_of_3_px_and_half_the_diagonal() -> None:
    big = Truth(0, 0.0, (TargetTruth("a", (50.0, 50.0), Box(50, 50, 30, 40)),))
    figures = DetectionFigures.of([big], detections([(0, 74, 50, 1), (0, 76, 50, 2)], 1), 30.0)
    assert (figures.pd, figures.false_alarms) == (1, 1)


def test_roc_rises_to_the_own_threshold() -> None:
    targets, false = np.array([9.0, 5, -np.inf, 3]), np.array([8.0, 4, 2])
    rates, pd = roc(targets, false, 10)
    np.testing.assert_allclose(rates, [0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(pd, [0.25, 0.5, 0.75, 0.75])


def test_scenes_without_targets_or_detections() -> None:
    figures = DetectionFigures.of([Truth(0, 0.0), Truth(1, 0.1)], detections([(0, 5, 5, 1.0)], 2), 30.0)
    assert figures.false_alarms == 0.5
    assert np.isnan([figures.pd, figures.first_detection, figures.rmse]).all()
    nothing = DetectionFigures.of([truth(0, ("a", 20.0, 1.0))], detections([], 1), 30.0)
    assert (nothing.pd, nothing.false_alarms, nothing.first_detection) == (0, 0, 1)
