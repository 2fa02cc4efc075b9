"""Compiled loops over counts give what the plain ones give."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from irsim._native import COMPILED, kernels
from irsim.camera import agc as base
from irsim.rng import lookup

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


@given(
    shape=st.lists(st.integers(0, 40), min_size=1, max_size=3).map(tuple),
    entry=st.sampled_from([np.uint8, np.float32]),
    seed=st.integers(0, 99),
)
@example(shape=(512, 640), entry=np.uint8, seed=1)
def test_a_table_is_read_as_by_numpy(shape: tuple[int, ...], entry: type, seed: int) -> None:
    drawn = np.random.default_rng(seed)
    words = drawn.integers(0, 2**16, shape, np.uint16)
    table: npt.NDArray[Any] = drawn.integers(0, 256, 2**16).astype(entry)
    for each in (words, words[..., ::2]):
        wanted, out = table[each], np.empty_like(table, shape=each.shape)
        np.testing.assert_array_equal(lookup(table, each), wanted, strict=True)
        assert lookup(table, each, out) is out
        np.testing.assert_array_equal(out, wanted)


@pytest.mark.parametrize("entry", [np.uint8, np.float32])
def test_a_table_or_a_place_of_another_size_is_refused(entry: type) -> None:
    table: npt.NDArray[Any] = np.zeros(2**16, entry)
    words, out = np.zeros((2, 3), np.uint16), np.ones_like(table, shape=(2, 3))
    kernels.lookup(table, words, out)
    assert not out.any()
    for wrong in ((table[1:], words, out), (table, words[1:], out), (table, words, out[1:])):
        with pytest.raises(ValueError, match="table of 65536"):
            kernels.lookup(*wrong)
    for other in ((table, out, out), (table, words, words), (table.astype(np.float64), words, out)):
        with pytest.raises(TypeError, match="an array of"):
            kernels.lookup(*other)


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
