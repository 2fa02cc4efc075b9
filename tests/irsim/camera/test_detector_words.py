"""Pictures of 16-bit words."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.camera.buffers import int16_image, int16_sum
from irsim.camera.noise_base import FINEST_UNIT, FrameContext, GainProduct, PatternSum
from irsim.rng import normals
from irsim.types import Floats

Values = st.lists(st.floats(-1e6, 1e6, width=32, allow_subnormal=False), min_size=1, max_size=50)


@given(values=Values)
def test_a_picture_is_rounded_to_parts_of_its_greatest_magnitude(values: list[float]) -> None:
    picture = np.array([values], np.float32)
    found = int16_image(picture)
    assert found.values.dtype == np.int16
    assert not found.values.flags.writeable
    off = np.abs(found.numbers() - picture).max()
    assert off <= max(0.5001 * np.abs(picture).max() / 32_767, 1e-30)


@pytest.mark.parametrize("shape", [(1, 1), (5, 1), (1, 7), (3, 40)])
def test_nothing_is_nothing(shape: tuple[int, int]) -> None:
    np.testing.assert_array_equal(
        int16_image(np.zeros(shape, np.float32)).numbers(), np.zeros(shape, np.float32), strict=True
    )


def test_halves_are_even_and_what_is_beyond_is_the_last_word() -> None:
    picture = np.array([[0.5, 1.5, -2.5, 1e5, -1e5, 3.75]], np.float32)
    np.testing.assert_array_equal(int16_image(picture, 1.0).values, [[0, 2, -2, 32_767, -32_768, 4]])
    np.testing.assert_array_equal(int16_image(picture, 0.5).numbers(), [[0.5, 1.5, -2.5, 16_383.5, -16_384.0, 4.0]])


MOMENT = FrameContext(0, (60, 80), 50.0, 1)


def drawn(name: str, sigma: float) -> Floats:
    return normals(MOMENT.shape, 1, name) * np.float32(sigma)


@pytest.mark.parametrize("far", [0.0, 100.0, 1e4])
def test_small_patterns_last_beside_what_is_far_out(far: float) -> None:
    small, hot = drawn("small", 0.02), np.zeros(MOMENT.shape, np.float32)
    hot[::7, 5] = far
    summed = np.zeros(MOMENT.shape)
    for part in PatternSum().of([small, hot], MOMENT):
        summed += part.numbers()
    left = summed[hot == 0] if far else summed
    assert np.abs(left - (small[hot == 0] if far else small)).max() <= FINEST_UNIT / 2
    assert len(int16_sum(small + hot, FINEST_UNIT)) == (2 if far > 1000 else 1)


def test_what_is_steady_is_summed_up_once_for_the_same_arrays() -> None:
    first, second, third = (drawn(name, 0.3) for name in ("one", "two", "three"))
    total = PatternSum()
    once = total.of([first, second], MOMENT)
    assert total.of([first, second], MOMENT) is once
    changed = total.of([first, third], MOMENT)
    np.testing.assert_allclose(changed[0].numbers(), first + third, atol=changed[0].unit)
    assert total.of([], MOMENT) == ()


def test_gains_are_one_by_their_product_for_the_same_arrays() -> None:
    first, second = drawn("one", 0.01), drawn("two", 0.02)
    gains = GainProduct()
    both = gains.of([first, second])
    expected = (1 + first.astype(np.float64)) * (1 + second) - 1
    np.testing.assert_allclose(both.numbers(), expected, atol=both.unit)
    assert gains.of([first, second]) is both
    alone = gains.of([second])
    np.testing.assert_allclose(alone.numbers(), second, atol=alone.unit)
