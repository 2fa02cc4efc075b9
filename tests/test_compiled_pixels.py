"""Compiled loops over pixels give what the plain ones give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from irsim import rng
from irsim.compiled import COMPILED, kernels
from irsim.detector import ar1, grain, noise_3d, shot
from irsim.detector.ar1 import Ar1
from irsim.detector.base import Moment, Noise
from irsim.detector.noise_3d import Noise3d
from irsim.detector.response import Electrons, Setting
from irsim.detector.shot import Shot
from irsim.detector.white import White
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
        kernels.normals(state, table, refined, out.astype(float))
    with pytest.raises(ValueError, match="read-only"):
        kernels.normals(state, table, refined, cell_means())
    assert not out.any()


NOISES = [
    White(ratio=2.5),
    Shot(),
    Ar1(rho=0.9),
    Ar1(rho=0.5, over="row"),
    Noise3d(t=0.2, tv=0.3, th=0.1, tvh=0.7),
    Noise3d(th=0.5),
    Noise3d(),
]


@given(rows=st.integers(1, 90), columns=st.integers(1, 90), index=st.integers(0, 10**6), noise=st.sampled_from(NOISES))
@example(rows=512, columns=640, index=77, noise=NOISES[0])
@example(rows=512, columns=640, index=77, noise=NOISES[1])
@example(rows=512, columns=640, index=77, noise=NOISES[2])
@example(rows=512, columns=640, index=77, noise=NOISES[4])
def test_noise_added_where_it_is_drawn_is_that_of_passes(rows: int, columns: int, index: int, noise: Noise) -> None:
    """To an ulp for each of two passes: OpenCV may have been built to round another way on this processor."""
    response = Electrons().response(Setting("mwir", 14, 20.0, (250.0, 350.0)))
    light = np.random.default_rng(index).uniform(1e3, 1.1 * response.well, (rows, columns)).astype(np.float32)
    found = []
    for compiled in (True, False):
        ar1._process.cache_clear()
        with pytest.MonkeyPatch.context() as patch:
            for module in (rng, ar1, grain, noise_3d, shot):
                patch.setattr(module, "COMPILED", compiled)
            found.append(np.minimum(light, np.float32(response.well)))
            noise.add(found[-1], response, Moment(index, (rows, columns), 50.0, 1))
    np.testing.assert_array_max_ulp(found[0], found[1], maxulp=2)
