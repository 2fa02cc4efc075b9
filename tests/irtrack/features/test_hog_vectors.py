"""Histograms of oriented gradients against scikit-image, and in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.feature import hog

from irtrack.features.hog import HOG
from irtrack.features.scaled_region import ScaledRegion


@pytest.mark.parametrize(("columns", "rows", "cell"), [(20, 20, 4), (16, 32, 4), (64, 128, 8)])
def test_vectors_equal_scikit_image(columns: int, rows: int, cell: int) -> None:
    layout = HOG(columns, rows, cell)
    for seed in range(3):
        picture = np.random.default_rng(seed).integers(0, 256, (rows, columns)).astype(np.float32)
        ours = layout.vectors(picture, np.array([[(columns - 1) / 2, (rows - 1) / 2]]), np.ones((1, 2)))[0]
        theirs = hog(picture.astype(float), 9, (cell, cell), (2, 2), "L2-Hys")
        assert layout.length == len(theirs)
        np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_an_edge_has_one_orientation() -> None:
    """A step along x has gradients of 0 degrees in the cells that it crosses: sqrt(1/2) or 1 after L2-Hys."""
    picture = np.repeat(np.where(np.arange(16) < 6, 10, 90)[None], 16, axis=0).astype(np.float32)
    vector = HOG(16, 16, 4).vectors(picture, np.array([[7.5, 7.5]]), np.ones((1, 2)))[0].reshape(3, 3, 2, 2, 9)
    assert np.count_nonzero(vector[..., 1:]) == 0
    assert vector[:, 0, :, 1, 0] == pytest.approx(np.sqrt(0.5), abs=1e-6)
    assert vector[:, 2].max() == 0


def test_gain_and_offset_do_not_matter() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (40, 40)).astype(np.float32)
    place, spacing = np.array([[18.3, 20.7]]), np.array([[1.2, 0.8]])
    layout = HOG(20, 20, 4)
    one, other = (layout.vectors(each, place, spacing) for each in (picture, 300 - np.float32(0.5) * picture))
    np.testing.assert_allclose(one, other, atol=1e-5)


def test_scaled_regions_keep_places() -> None:
    """A ramp, enlarged and shrunk: the sample at a place has the ramp's level there; beyond the frame, its edge's."""
    image = (2 * np.arange(80)[None] + np.zeros((60, 1))).astype(np.uint8)
    for step in (0.5, 1.0, 2.3):
        region = ScaledRegion.of(image, np.array([20.0, 10.0]), np.array([50.0, 40.0]), np.array([step, step]))
        places = region.places(np.array([[30.25, 20.0], [41.0, 33.0]]))
        for (x, y), level in zip(places, (60.5, 82.0), strict=True):
            row = region.pixels[round(float(y))]
            assert np.interp(x, np.arange(len(row)), row) == pytest.approx(level, abs=0.1)
        np.testing.assert_allclose(region.centers(places), [[30.25, 20.0], [41.0, 33.0]])
    outside = ScaledRegion.of(image, np.array([-20.0, 0.0]), np.array([-10.0, 10.0]), np.ones(2))
    assert outside.pixels.max() == 0
