"""AR(1) noise: variance in every frame, correlation over frames without a seam, Markov property."""

from __future__ import annotations

import math

import even_noise
import numpy as np
import pytest
from even_noise import pattern
from pydantic import ValidationError

from irsim.camera.ar1 import Ar1
from irsim.camera.noise import White
from irsim.camera.noise_base import FrameContext
from irsim.camera.sensor import ElectronSensor, SensorSettings

SHAPE = (256, 256)
N = SHAPE[0] * SHAPE[1]


def at(index: int, shape: tuple[int, int] = SHAPE, rate_hz: float = 30.0) -> FrameContext:
    return FrameContext(index, shape, rate_hz, 3)


@pytest.mark.parametrize(("rho", "lag"), [(0.3, 1), (0.9, 5), (0.97, 20)])
def test_correlation_is_rho_to_the_lag_without_a_seam(rho: float, lag: int) -> None:
    """Anchors stand at multiples of 16 (rho 0.3), 256 (0.9) and 512 (0.97)."""
    noise, expected = Ar1(rho=rho), rho**lag
    for start in (0, 5, 255, 256, 512 - lag):
        first, second = (pattern(noise, at(index)).ravel() for index in (start, start + lag))
        error = (1 - expected**2) / np.sqrt(N)  # of a sample correlation
        assert second.var(dtype=np.float64) == pytest.approx(1, abs=4.5 * np.sqrt(2 / N)), start
        assert np.corrcoef(first, second)[0, 1] == pytest.approx(expected, abs=4.5 * error), start


@pytest.mark.parametrize("now", [1, 64, 257])
def test_innovations_are_independent_of_the_past(now: int) -> None:
    noise = Ar1(rho=0.9)
    patterns = {index: pattern(noise, at(index)).astype(np.float64) for index in range(max(now - 9, 0), now + 1)}
    innovation = patterns[now] - 0.9 * patterns[now - 1]
    assert innovation.var() == pytest.approx(1 - 0.9**2, rel=4.5 * np.sqrt(2 / N))
    for index in range(max(now - 9, 0), now):
        assert abs(np.corrcoef(innovation.ravel(), patterns[index].ravel())[0, 1]) < 4.5 / np.sqrt(N), index


def test_rho_of_zero_is_white_noise() -> None:
    np.testing.assert_array_equal(pattern(Ar1(rho=0.0, id="n"), at(9)), pattern(White(id="n"), at(9)))


def test_a_time_constant_is_a_rho_at_a_rate() -> None:
    """1.05 s is rho 0.9 at 9 Hz and 0.97 at 30 Hz."""
    noise = Ar1(time_constant_s=1.05)
    assert np.exp(-noise.decay(9.0)) == pytest.approx(0.9, abs=5e-4)
    assert np.exp(-noise.decay(30.0)) == pytest.approx(0.97, abs=2e-3)
    assert Ar1(rho=0.9).decay(30.0) == pytest.approx(-np.log(0.9))


@pytest.mark.parametrize(
    ("over", "shape", "frames"), [("row", (400, 1), 60), ("column", (1, 300), 60), ("frame", (1, 1), 1000)]
)
def test_rows_columns_and_levels_have_memory(over: str, shape: tuple[int, int], frames: int) -> None:
    noise = Ar1.model_validate({"over": over, "rho": 0.8, "ratio": 3.0})
    patterns = np.stack([pattern(noise, at(index, shape)) for index in range(frames)])
    count = patterns.size * 0.2 / 1.8  # independent draws in AR(1): (1 - rho) / (1 + rho)
    assert patterns.var() == pytest.approx(9, rel=6 * math.sqrt(2 / count))
    lag = (patterns[1:] * patterns[:-1]).mean() / patterns.var()
    assert lag == pytest.approx(0.8, abs=6 * math.sqrt((1 - 0.64) / patterns.size))
    response = ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))
    assert even_noise.effect(noise, at(3, (400, 300)), response, 2e6).shape == (400, 300)


@pytest.mark.parametrize("fields", [{}, {"rho": 0.9, "time_constant_s": 1.0}, {"rho": 1.0}, {"rho": -0.1}])
def test_exactly_one_parameter_is_required(fields: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Ar1.model_validate(fields)
