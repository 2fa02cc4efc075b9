"""Haar-like features by hand."""

from __future__ import annotations

import numpy as np
import pytest

from irtrack.features.haar import CORNERS, HaarFeatures, IntegralImage


def test_values_are_sums_of_pixels() -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 256, (30, 40)).astype(np.float32)
    features = HaarFeatures.of(16, 4)
    corners = np.array([[3, 5], [20, 11]])
    values = features.values(IntegralImage.of(picture), corners)
    for (x, y), row in zip(corners.tolist(), values, strict=True):
        window = picture[y : y + 16, x : x + 16].astype(float)
        padded = np.zeros((17, 17))
        padded[1:, 1:] = window.cumsum(axis=0).cumsum(axis=1)
        raw = (padded[features.y, features.x] * features.weights).sum(axis=1)
        np.testing.assert_allclose(row, raw / (256 * window.std()), atol=1e-9)
    # the first two features: a square of 4 px against the one right of it, and against the one below it
    window = picture[5:21, 3:19].astype(float)
    assert values[0, 0] * 256 * window.std() == pytest.approx(window[:4, 4:8].sum() - window[:4, :4].sum())
    assert values[0, 1] * 256 * window.std() == pytest.approx(window[4:8, :4].sum() - window[:4, :4].sum())


def test_every_feature_is_zero_on_flat_ground_and_has_no_mean() -> None:
    features = HaarFeatures.of(16, 2)
    assert features.x.shape == (len(features), CORNERS)
    flat = IntegralImage.of(np.full((16, 16), 77, np.float32))
    assert not features.values(flat, np.zeros((1, 2), np.int64)).any()
    tilted = (features.weights * features.x * features.y).sum(axis=1)
    assert tilted == pytest.approx(np.zeros(len(features)))


def test_gain_and_offset_do_not_matter() -> None:
    picture = np.random.default_rng(3).integers(0, 256, (16, 16)).astype(np.float32)
    features, corner = HaarFeatures.of(16, 4), np.zeros((1, 2), np.int64)
    one, other = (features.values(IntegralImage.of(each), corner) for each in (picture, 7 + 20 * picture))
    np.testing.assert_allclose(one, other, atol=1e-9)
