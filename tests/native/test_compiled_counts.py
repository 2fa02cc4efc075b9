"""Compiled loops over counts give what the plain ones give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from irsim._native import COMPILED, kernels
from irsim.camera import agc as base

pytestmark = pytest.mark.skipif(not COMPILED, reason="there is no compiler here")


@given(
    rows=st.integers(0, 40),
    columns=st.integers(0, 40),
    bits=st.sampled_from([8, 14, 16]),
    deepest=st.integers(0, 2**16 - 1),
    seed=st.integers(0, 99),
)
@example(rows=512, columns=640, bits=14, deepest=2**14 - 1, seed=1)
@example(rows=512, columns=640, bits=16, deepest=2**16 - 1, seed=1)
@example(rows=512, columns=640, bits=14, deepest=0, seed=1)
def test_a_histogram_is_that_of_numpy(rows: int, columns: int, bits: int, deepest: int, seed: int) -> None:
    """Of counts within their depth and beyond it, and of every other column of a picture."""
    counts = np.random.default_rng(seed).integers(0, deepest, (rows, columns), np.uint16, endpoint=True)
    for each in (counts, counts[:, ::2]):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(base, "COMPILED", False)
            wanted = base.histogram(each, bits)
        np.testing.assert_array_equal(base.histogram(each, bits), wanted, strict=True)


def test_a_histogram_of_what_has_not_16_bits_is_refused() -> None:
    counts, pixels = np.zeros((2, 3), np.uint16), np.zeros(4, np.int64)
    kernels.histogram(counts, pixels)
    assert pixels.tolist() == [6, 0, 0, 0]
    with pytest.raises(TypeError, match="array of H"):
        kernels.histogram(counts.astype(np.uint8), pixels)
    with pytest.raises(TypeError, match="array of l"):
        kernels.histogram(counts, pixels.astype(np.int32))
    with pytest.raises(ValueError, match="levels of 16 bits"):
        kernels.histogram(counts, np.zeros(2**16 + 1, np.int64))
