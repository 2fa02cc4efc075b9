"""16-bit images, and the cached sums of patterns and products of gains."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.camera.buffers import int16_image, int16_sum
from irsim.camera.noise_base import FINEST_UNIT, ArrayCache, FrameContext, gain_product, pattern_sum
from irsim.rng import normals
from irsim.types import Floats

FRAME = FrameContext(0, (60, 80), 50.0, 1)


@pytest.mark.parametrize("largest", [1e-25, 1.0, 1e6])
def test_rounding_is_relative_to_the_greatest_magnitude(largest: float) -> None:
    image = (drawn("image", 1.0) / np.float32(5) * np.float32(largest)).astype(np.float32)
    found = int16_image(image)
    assert found.values.dtype == np.int16
    assert np.abs(found.to_float() - image).max() <= 0.502 * np.abs(image).max() / 32_767


def test_zeros_halves_and_clipping() -> None:
    zeros = np.zeros((3, 40), np.float32)
    np.testing.assert_array_equal(int16_image(zeros).to_float(), zeros, strict=True)
    image = np.array([[0.5, 1.5, -2.5, 1e5, -1e5, 3.75]], np.float32)
    np.testing.assert_array_equal(int16_image(image, 1.0).values, [[0, 2, -2, 32_767, -32_768, 4]])
    np.testing.assert_array_equal(int16_image(image, 0.5).to_float(), [[0.5, 1.5, -2.5, 16_383.5, -16_384.0, 4.0]])


def drawn(name: str, sigma: float) -> Floats:
    return normals(FRAME.shape, 1, name) * np.float32(sigma)


@pytest.mark.parametrize("far", [0.0, 100.0, 1e4])
def test_small_patterns_are_kept_beside_large_values(far: float) -> None:
    small, hot = drawn("small", 0.02), np.zeros(FRAME.shape, np.float32)
    hot[::7, 5] = far
    total = np.zeros(FRAME.shape)
    for part in pattern_sum(FRAME.shape, [small, hot]):
        total += part.to_float()
    assert np.abs((total - small)[hot == 0]).max() <= FINEST_UNIT / 2
    assert len(int16_sum(small + hot, FINEST_UNIT)) == (2 if far > 1000 else 1)


def test_sums_and_products_of_patterns_are_cached() -> None:
    first, second, third = (drawn(name, 0.03) for name in ("one", "two", "three"))
    total = ArrayCache(pattern_sum)
    once = total.of(FRAME.shape, [first, second])
    assert total.of(FRAME.shape, [first, second]) is once
    changed = total.of(FRAME.shape, [first, third])[0]
    np.testing.assert_allclose(changed.to_float(), first + third, atol=changed.unit)
    assert total.of(FRAME.shape, []) == ()
    both = gain_product(FRAME.shape, [first, second])
    expected = (1 + first.astype(np.float64)) * (1 + second) - 1
    np.testing.assert_allclose(both.to_float(), expected, atol=both.unit)
