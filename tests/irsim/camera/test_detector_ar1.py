"""AR(1) noise: its variance in every frame, its correlation over frames without a seam, its memory."""

from __future__ import annotations

import numpy as np
import pytest
from even_noise import pattern
from pydantic import ValidationError
from test_detector import SHAPE, N, at

from irsim.camera.ar1 import STATE_UNIT, Ar1, Ar1Process, from_state
from irsim.camera.noise import White
from irsim.rng import normals


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.9, 0.97])
def test_ar1_has_variance_one_in_every_frame(rho: float) -> None:
    noise = Ar1(rho=rho)
    for index in (0, 1, 2, 7, 64, 127, 128, 200, 255, 256, 257, 300, 511, 512, 513, 1000):
        seen = pattern(noise, at(index, SHAPE, 3))
        assert seen.var(dtype=np.float64) == pytest.approx(1, abs=4.5 * np.sqrt(2 / N)), index
        assert seen.mean(dtype=np.float64) == pytest.approx(0, abs=4.5 / np.sqrt(N)), index


@pytest.mark.parametrize("lag", [1, 2, 5, 20])
@pytest.mark.parametrize("rho", [0.3, 0.9, 0.97])
def test_ar1_correlation_falls_as_rho_to_the_lag_with_no_seam(rho: float, lag: int) -> None:
    noise = Ar1(rho=rho)
    # Anchors stand at multiples of 16 (rho 0.3), 256 (0.9) and 512 (0.97).
    for start in (0, 5, 100, 125, 255, 256, 257, 512 - lag, 513 - lag, 512, 1019):
        first, second = (pattern(noise, at(index, SHAPE, 3)).ravel() for index in (start, start + lag))
        expected = rho**lag
        error = (1 - expected**2) / np.sqrt(N)  # of a sample correlation
        assert np.corrcoef(first, second)[0, 1] == pytest.approx(expected, abs=4.5 * error), start


@pytest.mark.parametrize("now", [1, 2, 64, 255, 256, 257, 300, 512])
def test_ar1_remembers_nothing_but_the_frame_before(now: int) -> None:
    noise = Ar1(rho=0.9)
    patterns = {
        index: pattern(noise, at(index, SHAPE, 4)).astype(np.float64) for index in range(max(now - 9, 0), now + 1)
    }
    innovation = patterns[now] - 0.9 * patterns[now - 1]
    assert innovation.var() == pytest.approx(1 - 0.9**2, rel=4.5 * np.sqrt(2 / N))
    for index, earlier in patterns.items():
        if index < now:
            assert abs(np.corrcoef(innovation.ravel(), earlier.ravel())[0, 1]) < 4.5 / np.sqrt(N), index


def test_ar1_without_correlation_is_white() -> None:
    white = pattern(White(id="n"), at(9, SHAPE, 1))
    np.testing.assert_array_equal(pattern(Ar1(rho=0.0, id="n"), at(9, SHAPE, 1)), white)


@pytest.mark.parametrize("index", [0, 1, 2, 5, 255, 256, 511])
@pytest.mark.parametrize("rho", [0.0, 0.01, 0.9])
def test_what_is_new_and_what_is_known_of_a_frame_are_its_state(rho: float, index: int) -> None:
    process = Ar1Process(-np.log(rho) if rho else np.inf, (20, 30), 4, "noise", "n")
    told = process.new(index) * normals((20, 30), 4, "noise", "n", index)
    for known in process.known(index):
        told += known.numbers()
    np.testing.assert_allclose(told, from_state(process.frame(index)), atol=STATE_UNIT / 2 + 1e-6, rtol=0)


def test_ar1_time_constant_is_a_rho_at_a_rate() -> None:
    # DESIGN: 1.05 s is rho 0.9 at 9 Hz and 0.97 at 30 Hz.
    noise = Ar1(time_constant_s=1.05)
    assert np.exp(-noise.decay(9.0)) == pytest.approx(0.9, abs=5e-4)
    assert np.exp(-noise.decay(30.0)) == pytest.approx(0.97, abs=2e-3)
    assert Ar1(rho=0.9).decay(30.0) == pytest.approx(-np.log(0.9))


def test_ar1_far_out_in_a_long_memory_is_quick() -> None:
    noise = Ar1(time_constant_s=1e6)
    first, second = (pattern(noise, at(index, SHAPE, 1, 10_000.0)) for index in (9_999_998, 9_999_999))
    assert np.corrcoef(first.ravel(), second.ravel())[0, 1] > 1 - 1e-6
    assert first.var() == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))


@pytest.mark.parametrize("fields", [{}, {"rho": 0.9, "time_constant_s": 1.0}, {"rho": 1.0}, {"rho": -0.1}])
def test_ar1_wants_exactly_one_way(fields: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Ar1.model_validate(fields)
