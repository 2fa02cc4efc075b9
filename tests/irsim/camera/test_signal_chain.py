"""From light to counts: quantisation, noise in counts, shot noise, the full well, response time."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from irsim.camera.camera import Camera
from irsim.camera.noise import Shot, White, poisson
from irsim.camera.noise_base import Additive, FrameContext
from irsim.camera.response import ResponseTime, response_weights
from irsim.camera.sensor import ElectronSensor, NetdSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance, slope
from irsim.types import Band, Floats

INSB: Band = (3.4, 4.9)
SHAPE = (256, 256)
N = SHAPE[0] * SHAPE[1]


class Given(Additive):
    """A noise with a given pattern in every frame."""

    size: float = 0.0

    def pattern(self, frame: FrameContext) -> Floats:
        return np.full(frame.shape, self.size, np.float32)

    def pattern_variance(self, frame: FrameContext, fixed: bool) -> float:
        return 0.0


# A sensor of given NETD


def netd_chain(bits: int = 14, netd_mk: float = 40.0, noises: tuple[Any, ...] = ()) -> SignalChain:
    return SignalChain(NetdSensor().response(SensorSettings("lwir", bits, netd_mk, (250.0, 350.0))), noises, 30.0, 1)


def counts_of(kelvin: float, bits: int = 14, netd_mk: float = 40.0, noises: tuple[Any, ...] = ()) -> Any:
    light = np.full((4, 5), radiance("lwir", kelvin), np.float32)
    return netd_chain(bits, netd_mk, noises).expose(light, 0)


@pytest.mark.parametrize("bits", [8, 14, 16])
def test_counts_span_the_range_and_saturate(bits: int) -> None:
    """Counts never wrap around, and the variance is infinite where they are clipped."""
    full = 2**bits - 1
    middle = float(radiance("lwir", 250.0) + radiance("lwir", 350.0)) / 2
    light = np.array([[radiance("lwir", 250.0), middle, radiance("lwir", 350.0)]], np.float32)
    counts = netd_chain(bits).expose(light, 0)
    assert counts.dtype == np.uint16
    np.testing.assert_allclose(counts, [[0, full / 2, full]], atol=0.51)
    assert (counts_of(200.0, bits) == 0).all()
    assert (counts_of(5000.0, bits) == full).all()
    for size in (1e4, 1e30):
        assert (counts_of(300.0, bits, noises=(Given(size=size),)) == full).all()
        assert (counts_of(300.0, bits, noises=(Given(size=-size),)) == 0).all()
    beyond = np.array([[radiance("lwir", kelvin) for kelvin in (200.0, 300.0, 400.0)]], np.float32)
    np.testing.assert_array_equal(np.isinf(netd_chain(bits).variance(beyond, 0)), [[True, False, True]])


def test_counts_are_rounded_to_the_nearest_and_halves_to_even() -> None:
    gain = 255 / float(radiance("lwir", 350.0) - radiance("lwir", 250.0))
    wanted = np.array([[9.6, 10.0, 10.4, 10.6, 200.49, 200.51]])
    light = (wanted / gain + radiance("lwir", 250.0)).astype(np.float32)
    np.testing.assert_array_equal(netd_chain(8, 0.0).expose(light, 0), [[10, 10, 10, 11, 200, 201]])
    halves = np.array([[0.5, 1.5, 2.5, 100.5, 101.5, -0.5, 255.5]], np.float32)
    np.testing.assert_array_equal(netd_chain(8).response.counts(halves), [[0, 2, 2, 100, 102, 0, 255]])


def test_noise_of_counts_has_the_given_netd() -> None:
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    response = NetdSensor().response(SensorSettings("mwir", 14, 500.0, (220.0, 400.0)))
    chain = SignalChain(response, (White(),), 30.0, 1)
    found = chain.expose(light, 0).astype(np.float64)
    gain = (2**14 - 1) / float(radiance("mwir", 400.0) - radiance("mwir", 220.0))
    variance = (0.5 * slope("mwir", 300.0) * gain) ** 2 + 1 / 12  # rounding adds 1/12
    assert found.var() == pytest.approx(variance, rel=4.5 * np.sqrt(2 / N))
    np.testing.assert_allclose(chain.variance(light, 0), variance, rtol=1e-6)
    assert found.mean() == pytest.approx(chain.mean(light, 0)[0, 0], abs=4.5 * np.sqrt(variance / N))


# A sensor that counts electrons


def chain_of(bits: int = 14, **fields: float) -> SignalChain:
    response = ElectronSensor.model_validate(fields).response(SensorSettings(INSB, bits, 0.0, (220.0, 400.0)))
    return SignalChain(response, (Shot(),), 30.0, 1)


def light_of(chain: SignalChain, electrons: float, shape: tuple[int, int] = SHAPE) -> Floats:
    """Return the light of so many electrons: S = a L + b sqrt(L) + zero solved for sqrt(L)."""
    response = chain.response
    root = math.sqrt(response.root**2 + 4 * response.linear * (electrons - response.zero)) - response.root
    return np.full(shape, (root / (2 * response.linear)) ** 2, np.float32)


def test_photon_transfer_has_the_slope_of_the_gain() -> None:
    """Variance against mean in counts: slope 1 / gain, intercept (read noise / gain)² + 1/12."""
    chain, gain = chain_of(read_noise_e=400.0), 7e6 / (2**14 - 1)
    means, variances = [], []
    for level in np.linspace(0.1e6, 6.5e6, 12):
        counts = chain.expose(light_of(chain, level), int(level)).astype(np.float64)
        means.append(counts.mean())
        variances.append(counts.var())
        assert counts.mean() == pytest.approx(level / gain, abs=0.1)
    rise, intercept = np.polyfit(means, variances, 1, w=1 / np.array(variances))
    assert rise == pytest.approx(1 / gain, rel=0.005)
    assert intercept == pytest.approx((400 / gain) ** 2 + 1 / 12, abs=0.08)


def test_netd_of_frames_is_that_of_the_camera() -> None:
    """Sigma of the difference of two frames at 300 K, over sqrt 2, by the mean's rise from 299 to 301 K."""
    camera = Camera.model_validate({"preset": "cooled_lwir", "noise": [{"kind": "shot"}]})
    chain = camera.signal_chain(3)
    cold, here, warm = (np.full(SHAPE, radiance(camera.band, kelvin), np.float32) for kelvin in (299.0, 300.0, 301.0))
    first, second = (chain.expose(here, index).astype(np.float64) for index in (0, 1))
    rise = float((chain.mean(warm, 0) - chain.mean(cold, 0)).mean()) / 2
    measured = (first - second).std() / math.sqrt(2) / rise * 1e3
    assert measured == pytest.approx(camera.netd(), rel=4.5 / math.sqrt(2 * N))


@pytest.mark.parametrize("level", [0.0, 3.0, 199.0, 201.0])
def test_electrons_have_poisson_mean_and_variance(level: float) -> None:
    chain = chain_of(bits=16, read_noise_e=0.0, gain_e=1.0)
    counts = chain.expose(light_of(chain, level), 0).astype(np.float64)
    assert counts.mean() == pytest.approx(level, abs=4.5 * math.sqrt(level / N) + 1e-9)
    rounding = 1 / 12 if level >= 200 else 0  # below, they are whole already
    assert counts.var() == pytest.approx(level + rounding, rel=4.5 * math.sqrt((2 + 1 / max(level, 1)) / N), abs=1e-9)
    if level == 3.0:
        seen, expected = (
            np.bincount(counts.ravel().astype(int), minlength=14)[:14],
            stats.poisson(3.0).pmf(range(14)) * N,
        )
        assert ((seen - expected) ** 2 / expected).sum() < stats.chi2(13).ppf(0.9999)


def test_poisson_numbers_are_the_quantiles() -> None:
    rng = np.random.default_rng(2)
    means, uniform = rng.uniform(0, 250, 4000), rng.random(4000)
    np.testing.assert_array_equal(poisson(means, uniform), stats.poisson.ppf(uniform, means))
    assert poisson(np.array([0.0, 1e-9]), np.array([1 - 2**-53, 0.5])).tolist() == [0, 0]


def test_variance_is_that_of_shot_noise_read_noise_and_rounding() -> None:
    chain, gain = chain_of(read_noise_e=900.0), 7e6 / (2**14 - 1)
    light = np.linspace(0.5, 3.0, 500, dtype=np.float32)[None]
    expected = (chain.response.signal(light).astype(np.float64) + 900**2) / gain**2 + 1 / 12
    np.testing.assert_allclose(chain.variance(light, 0), expected, rtol=1e-6)
    frames = np.stack([chain.expose(light, index) for index in range(200)]).astype(np.float64)
    ratio = ((frames - chain.mean(light, 0)) ** 2).mean(axis=0) / expected
    assert ratio.mean() == pytest.approx(1, abs=4.5 * math.sqrt(2 / (200 * 500)))


def test_a_full_well_has_read_noise_only() -> None:
    chain = chain_of(read_noise_e=1000.0, gain_e=1000.0)
    hot = np.full((60, 80), radiance(INSB, 500.0), np.float32)
    counts = chain.expose(hot, 0).astype(np.float64)
    assert counts.mean() == pytest.approx(7000, abs=0.1)
    assert counts.var() == pytest.approx(1 + 1 / 12, rel=4.5 * math.sqrt(2 / counts.size))
    assert np.isinf(chain.variance(hot, 0)).all()
    assert (chain_of().expose(hot, 0) >= 2**14 - 8).all()  # read noise of 0.94 counts
    offset = chain_of(offset=500.0)
    assert offset.expose(np.zeros((60, 80), np.float32), 0).mean() == pytest.approx(500, abs=1)
    assert offset.response.counts(np.full((1, 1), 7e6, np.float32))[0, 0] == 2**14 - 1


def test_overwriting_the_light_changes_no_counts() -> None:
    share = np.linspace(0.5, 1, 21 * 31, dtype=np.float32).reshape(21, 31)
    chain = replace(chain_of(), vignetting=lambda index: share)
    light = light_of(chain, 1e6, (21, 31)) * np.linspace(0, 1, 31, dtype=np.float32)
    kept, spent = light.copy(), light.copy()
    np.testing.assert_array_equal(chain.expose(spent, 2, spent=True), chain.expose(kept, 2))
    np.testing.assert_array_equal(kept, light)


# Response time


def test_a_step_of_light_is_followed_exponentially() -> None:
    """Light that jumps at frame 5: 1 - a^(k - 4) of the jump is seen at frame k >= 5, a = exp(-T / tau)."""
    rate, tau = 60.0, 0.010
    kept = math.exp(-1 / (rate * tau))

    def scene(index: int) -> Floats:
        return np.full((3, 4), 10.0 if index >= 5 else 2.0, np.float32)

    low_pass = ResponseTime(tau, rate)
    for index in (0, 3, 5, 6, 7, 9, 30, 6):
        expected = 2 + 8 * (1 - kept ** max(index - 4, 0))
        np.testing.assert_allclose(low_pass.light(index, scene), expected, atol=8e-3)
    weights = response_weights(tau, rate)
    assert weights.sum() == pytest.approx(1)
    assert weights[1] / weights[0] == pytest.approx(kept)
    np.testing.assert_array_equal(response_weights(0.0, rate), [1.0])
    still = np.linspace(1, 5, 12, dtype=np.float32).reshape(3, 4)
    np.testing.assert_allclose(ResponseTime(0.05, 30.0).light(40, lambda index: still), still, rtol=1e-6)
