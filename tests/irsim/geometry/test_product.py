"""Matrix products a few rows at a time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irsim.geometry import product as module
from irsim.geometry.product import product


@given(m=st.integers(1, 40), k=st.integers(0, 9), n=st.integers(1, 9), stacked=st.booleans(), alone=st.integers(1, 400))
def test_it_is_the_product_whatever_the_blocks(m: int, k: int, n: int, stacked: bool, alone: int) -> None:
    """Whole numbers add up without rounding; summed by einsum, which is not BLAS."""
    draws = np.random.default_rng(m + 100 * k + 10_000 * n)
    left = draws.integers(-9, 9, (m, k)).astype(np.float64)
    right = draws.integers(-9, 9, (2, k, n) if stacked else (k, n)).astype(np.float64)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "ALONE", alone)
        np.testing.assert_array_equal(product(left, right), np.einsum("mk,...kn->...mn", left, right))


@pytest.mark.parametrize("rows", [3, 3000])
@pytest.mark.parametrize("kinds", [("f4", "f4"), ("f4", "f8"), ("f8", "f4")])
def test_it_is_as_precise_as_numpys_whatever_the_blocks(rows: int, kinds: tuple[str, str]) -> None:
    left, right = np.ones((rows, 20), kinds[0]), np.ones((20, 30), kinds[1])
    assert product(left, right).dtype == (left @ right).dtype
