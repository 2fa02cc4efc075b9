"""Compiled loops over pixels give what the plain ones give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from irsim import rng
from irsim.compiled import COMPILED, kernels
from irsim.normal import cell_means

pytestmark = pytest.mark.skipif(not COMPILED, reason="there is no compiler here")


@given(length=st.integers(0, 10_000), seed=st.integers(-(2**70), 2**70))
@example(length=512 * 640, seed=1)
def test_normals_are_those_of_the_plain_loop(length: int, seed: int) -> None:
    plain = rng._normals_plain((length,), rng.bits(seed, "a", 3), None)
    np.testing.assert_array_equal(rng.normals((length,), seed, "a", 3), plain, strict=True)


def test_a_wrong_state_or_table_is_refused() -> None:
    state, table, refined = rng.begun(1, "a")
    out = np.zeros(8, np.float32)
    for wrong in ((state[1:], table, refined), (state, table[1:], refined), (state, table, -1), (state, table, 40_000)):
        with pytest.raises(ValueError, match="wanted"):
            kernels.normals(*wrong, out)
    with pytest.raises(TypeError):
        kernels.normals(state, table, refined, out.astype(float))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="read-only"):
        kernels.normals(state, table, refined, cell_means())
    assert not out.any()
