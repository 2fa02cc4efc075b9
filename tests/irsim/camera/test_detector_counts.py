"""Counts of a detector that is stated by its NETD."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.camera.noise import White
from irsim.camera.noise_base import Additive, FrameContext
from irsim.camera.sensor import NetdSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance, slope
from irsim.types import Floats

SHAPE = (256, 256)
N = SHAPE[0] * SHAPE[1]


class Given(Additive):
    """A noise whose pattern is given, whatever the frame."""

    size: float = 0.0
    values: tuple[tuple[float, ...], ...] = ()

    def pattern(self, frame_context: FrameContext) -> Floats:
        if not self.values:
            return np.full(frame_context.shape, self.size, np.float32)
        return np.array(self.values, np.float32)

    def spread(self, frame_context: FrameContext, fixed: bool) -> float:
        return 0.0


def sensor(bits: int = 14, netd_mk: float = 40.0, noises: tuple[Any, ...] = ()) -> SignalChain:
    return SignalChain(NetdSensor().response(SensorSettings("lwir", bits, netd_mk, (250.0, 350.0))), noises, 30.0, 1)


def counts_of(kelvin: float, bits: int = 14, netd_mk: float = 40.0, noises: tuple[Any, ...] = ()) -> Any:
    light = np.full((4, 5), radiance("lwir", kelvin), np.float32)
    return sensor(bits, netd_mk, noises).expose(light, 0)


@pytest.mark.parametrize("bits", [8, 12, 14, 16])
def test_counts_span_the_range_of_temperatures(bits: int) -> None:
    full = 2**bits - 1
    middle = float(radiance("lwir", 250.0) + radiance("lwir", 350.0)) / 2
    light = np.array([[radiance("lwir", 250.0), middle, radiance("lwir", 350.0)]], np.float32)
    counts = sensor(bits).expose(light, 0)
    assert counts.dtype == np.uint16
    np.testing.assert_allclose(counts, [[0, full / 2, full]], atol=0.51)


@pytest.mark.parametrize("bits", [8, 14, 16])
def test_counts_saturate_and_never_wrap(bits: int) -> None:
    full = 2**bits - 1
    assert (counts_of(200.0, bits) == 0).all()
    assert (counts_of(5000.0, bits) == full).all()
    for size in (1e4, 1e9, 1e30):
        assert (counts_of(300.0, bits, noises=(Given(size=size),)) == full).all()
        assert (counts_of(300.0, bits, noises=(Given(size=-size),)) == 0).all()


def test_counts_are_rounded_to_the_nearest_and_halves_to_even() -> None:
    gain = 255 / float(radiance("lwir", 350.0) - radiance("lwir", 250.0))
    wanted = np.array([[9.6, 10.0, 10.4, 10.6, 200.49, 200.51]])
    light = (wanted / gain + radiance("lwir", 250.0)).astype(np.float32)
    np.testing.assert_array_equal(sensor(8, 0.0).expose(light, 0), [[10, 10, 10, 11, 200, 201]])
    halves = np.array([[0.5, 1.5, 2.5, 100.5, 101.5, -0.5, 255.5]], np.float32)
    np.testing.assert_array_equal(sensor(8).response.counts(halves), [[0, 2, 2, 100, 102, 0, 255]])


def test_one_netd_of_noise_is_one_netd_of_temperature() -> None:
    """At 300 K a unit of noise moves the count as far as netd_mk more of scene temperature does."""
    by_noise = counts_of(300.0, 16, 200.0, (Given(size=1.0),)).astype(int) - counts_of(300.0, 16, 200.0)
    by_scene = counts_of(300.2, 16, 200.0).astype(int) - counts_of(300.0, 16, 200.0)
    assert by_noise.mean() > 100
    np.testing.assert_allclose(by_noise, by_scene, atol=1)


def test_noise_of_counts_is_the_stated_sigma() -> None:
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    response = NetdSensor().response(SensorSettings("mwir", 14, 500.0, (220.0, 400.0)))
    camera = SignalChain(response, (White(),), 30.0, 1)
    found = camera.expose(light, 0).astype(np.float64)
    gain = (2**14 - 1) / float(radiance("mwir", 400.0) - radiance("mwir", 220.0))
    variance = (0.5 * slope("mwir", 300.0) * gain) ** 2 + 1 / 12  # rounding adds 1/12
    assert found.var() == pytest.approx(variance, rel=4.5 * np.sqrt(2 / N))
    np.testing.assert_allclose(camera.variance(light, 0), variance, rtol=1e-6)
    assert found.mean() == pytest.approx(camera.mean(light, 0)[0, 0], abs=4.5 * np.sqrt(variance / N))


def test_patterns_add_up_and_broadcast() -> None:
    rng = np.random.default_rng(1)
    light = np.full((24, 40), radiance("lwir", 300.0), np.float32)
    patterns = [rng.normal(0, 3, shape) for shape in ((24, 40), (24, 1), (1, 40))]
    noises = tuple(Given(values=tuple(map(tuple, pattern.tolist()))) for pattern in patterns)
    gain = (2**14 - 1) / float(radiance("lwir", 350.0) - radiance("lwir", 250.0))
    mean = gain * float(radiance("lwir", 300.0) - radiance("lwir", 250.0))
    expected = mean + gain * 0.1 * slope("lwir", 300.0) * np.asarray(sum(patterns))
    np.testing.assert_allclose(sensor(14, 100.0, noises).expose(light, 0), expected, atol=0.51)


def test_expose_changes_no_input() -> None:
    light = np.full((4, 5), radiance("lwir", 300.0), np.float32)
    light.flags.writeable = False
    before = light.copy()
    camera = sensor(noises=(White(),))
    camera.expose(light, 0)
    camera.variance(light, 0)
    np.testing.assert_array_equal(light, before)


def test_without_netd_there_is_no_noise() -> None:
    np.testing.assert_array_equal(counts_of(300.0, netd_mk=0.0, noises=(Given(size=3.0),)), counts_of(300.0))


def test_variance_is_infinite_where_counts_are_clipped() -> None:
    light = np.array([[radiance("lwir", kelvin) for kelvin in (200.0, 300.0, 400.0)]], np.float32)
    np.testing.assert_array_equal(np.isinf(sensor().variance(light, 0)), [[True, False, True]])
