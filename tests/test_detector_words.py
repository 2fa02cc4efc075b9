"""Pictures of 16-bit words."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.detector.words import words

Values = st.lists(st.floats(-1e6, 1e6, width=32, allow_subnormal=False), min_size=1, max_size=50)


@given(values=Values)
def test_a_picture_is_rounded_to_parts_of_its_greatest_magnitude(values: list[float]) -> None:
    picture = np.array([values], np.float32)
    found = words(picture)
    assert found.values.dtype == np.int16
    assert not found.values.flags.writeable
    off = np.abs(found.numbers() - picture).max()
    assert off <= max(0.5001 * np.abs(picture).max() / 32_767, 1e-30)


@pytest.mark.parametrize("shape", [(1, 1), (5, 1), (1, 7), (3, 40)])
def test_nothing_is_nothing(shape: tuple[int, int]) -> None:
    np.testing.assert_array_equal(
        words(np.zeros(shape, np.float32)).numbers(), np.zeros(shape, np.float32), strict=True
    )


def test_halves_are_even_and_what_is_beyond_is_the_last_word() -> None:
    picture = np.array([[0.5, 1.5, -2.5, 1e5, -1e5, 3.75]], np.float32)
    np.testing.assert_array_equal(words(picture, 1.0).values, [[0, 2, -2, 32_767, -32_768, 4]])
    np.testing.assert_array_equal(words(picture, 0.5).numbers(), [[0.5, 1.5, -2.5, 16_383.5, -16_384.0, 4.0]])
