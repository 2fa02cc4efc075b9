"""Periodic pictures as wholes."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.backgrounds.texture import FINE, coarseness, enlarged, shrunk, wrapped_blur
from irsim.geometry.random_fields import spectral


@pytest.mark.parametrize(("sigma_px", "coarse"), [(0.5, 1), (4.9, 1), (5.0, 2), (9.9, 2), (10.0, 4), (80.0, 32)])
def test_what_is_blurred_is_kept_on_no_coarser_pixels_than_tell_it(sigma_px: float, coarse: int) -> None:
    assert coarseness(sigma_px, 1024) == coarse
    assert sigma_px / coarse >= FINE or coarse == 1


@pytest.mark.parametrize("sigma_px", [5.0, 10.0, 23.0, 60.0])
def test_a_blurred_picture_made_smaller_and_larger_is_the_same(sigma_px: float) -> None:
    """Across its edges, too: it is rolled by an odd number of pixels first."""
    picture = np.roll(spectral((256, 256), 3.0, None, 60.0, 1.0, 4, "t"), (37, 91), axis=(0, 1))
    wanted, coarse = wrapped_blur(picture, sigma_px), coarseness(sigma_px, 256)
    whole = slice(0, 256)
    found = enlarged(wrapped_blur(shrunk(picture, coarse), sigma_px / coarse), coarse, whole, whole)
    assert found.shape == picture.shape
    assert np.abs(found - wanted).max() < 0.015 * np.ptp(wanted)
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.02 * wanted.std()


def test_a_picture_as_it_is_needs_no_change() -> None:
    picture = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    np.testing.assert_array_equal(enlarged(shrunk(picture, 1), 1, slice(0, 64), slice(0, 64)), picture)


@pytest.mark.parametrize("coarse", [1, 2, 8])
def test_a_part_is_that_of_the_whole_repeated(coarse: int) -> None:
    small = np.random.default_rng(0).random((64 // coarse, 64 // coarse)).astype(np.float32)
    whole = enlarged(small, coarse, slice(0, 64), slice(0, 64))
    tiled = np.tile(whole, (3, 3))
    for top, left in [(0, 0), (-5, 3), (33, -17), (40, 41)]:
        part = enlarged(small, coarse, slice(top, top + 37), slice(left, left + 29))
        wanted = tiled[64 + top : 64 + top + 37, 64 + left : 64 + left + 29]
        np.testing.assert_allclose(part, wanted, atol=1e-6)
