"""Local binary patterns against scikit-image, and on flat noise."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.feature import local_binary_pattern

from irtrack.features.lbp import PATTERNS, TexturePicture, uniform_patterns
from irtrack.features.quantiser import Quantiser, full_range


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_patterns_equal_scikit_image(dtype: type[np.uint8] | type[np.uint16]) -> None:
    """Inside the frame: it takes pixels beyond the frame as 0."""
    for seed in range(5):
        image = np.random.default_rng(seed).integers(0, np.iinfo(dtype).max, (140, 150), dtype)
        theirs = local_binary_pattern(image, 8, 1, "uniform")  # type: ignore[no-untyped-call]
        ours = uniform_patterns(image, 0.0)
        assert np.array_equal(ours[1:-1, 1:-1], theirs[1:-1, 1:-1])
        assert set(np.unique(ours)) == set(range(PATTERNS))


def test_patterns_by_hand() -> None:
    step = np.repeat([[10, 10, 50, 50]], 4, axis=0).astype(np.uint8)
    found = uniform_patterns(step, 3.0)
    assert found[1:-1].tolist() == [[0, 3, 0, 0]] * 2  # of a step three neighbours are higher, none by 3 elsewhere
    spot = np.full((5, 5), 20, np.uint8)
    spot[2, 2] = 10
    assert uniform_patterns(spot, 3.0)[2, 2] == 8
    lines = np.array([[9, 0, 9], [0, 4, 0], [9, 0, 9]], np.uint8) * 20
    assert uniform_patterns(lines, 3.0)[1, 1] == PATTERNS - 1


def test_offset_silences_noise_on_flat_ground() -> None:
    flat = np.clip(np.rint(np.random.default_rng(0).normal(100, 0.8, (60, 60))), 0, 255).astype(np.uint8)
    assert (uniform_patterns(flat, 0.0) == 0).mean() < 0.3
    assert (uniform_patterns(flat, 3.0) == 0).mean() > 0.85


def test_picture_holds_level_and_pattern() -> None:
    image = np.random.default_rng(1).integers(0, 256, (20, 30), np.uint8)
    picture = TexturePicture(full_range(8, 8), 3.0)
    codes = picture(image)
    assert np.array_equal(codes // PATTERNS, image // 32)
    assert np.array_equal(codes % PATTERNS, uniform_patterns(image, 3.0))
    assert np.array_equal(picture.joint(codes), codes)
    assert picture.joint == Quantiser(0.0, 80.0, 80)
