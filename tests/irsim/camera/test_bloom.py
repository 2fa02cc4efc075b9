"""Blooming: where spilled charge goes, and the variance of the pixels that receive it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from irsim.camera.bloom import Bloom, bloom_variance
from irsim.camera.drift import Drift
from irsim.camera.noise import Shot
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.types import Floats

INSB = (3.4, 4.9)
TOP, GAIN = 1000.0, 0.01**2


def hot_spot(excess: float = 5460.0) -> Floats:
    signal = np.full((31, 41), 100.0, np.float32)
    signal[15, 20] = TOP + excess
    return signal


def bloom(along: Any, **fields: float) -> Bloom:
    return Bloom.model_validate({"along": along, **fields})


@pytest.mark.parametrize("along", ["columns", "rows"])
def test_charge_fills_the_line_and_none_is_lost(along: str) -> None:
    """5,460 above the well, half each way: 2,730 fill three neighbours by 900 each, and 30 go on."""
    signal = hot_spot()
    total = signal.sum(dtype=np.float64)
    bloom(along).spill(signal, TOP)
    line, middle = (signal[:, 20], 15) if along == "columns" else (signal[15], 20)
    np.testing.assert_allclose(line[middle - 3 : middle + 4], TOP)
    np.testing.assert_allclose([line[middle - 4], line[middle + 4]], 130)
    assert signal.sum(dtype=np.float64) == pytest.approx(total)
    assert (np.delete(signal, 20, axis=1) if along == "columns" else np.delete(signal, 15, axis=0)).max() == 100


def test_charge_around_falls_off_exponentially() -> None:
    signal = hot_spot()
    before = signal.sum(dtype=np.float64)
    bloom("around", length_px=1.5, fraction=0.05).spill(signal, TOP)
    assert before - signal.sum(dtype=np.float64) == pytest.approx(0.95 * 5460, rel=1e-4)
    added = signal - 100
    assert added[15, 21] == added[15, 19] == added[14, 20] == added[16, 20]
    assert added[15, 22] / added[15, 21] == pytest.approx(math.exp(-1 / 1.5), rel=1e-4)
    assert added[16, 21] / added[15, 21] == pytest.approx(math.exp(-(math.sqrt(2) - 1) / 1.5), rel=1e-4)


@pytest.mark.parametrize(("side", "times"), [(3, 30.0), (41, 3.0)])
def test_charge_around_passes_full_pixels_and_none_is_lost(side: int, times: float) -> None:
    """The second spot is wider than the kernel, which reaches 9 px."""
    signal = np.full((161, 161), 100.0, np.float32)
    spot = slice(80 - side // 2, 81 + side // 2)
    signal[spot, spot] = times * TOP
    before = signal.sum(dtype=np.float64)
    bloom("around", length_px=1.5).spill(signal, TOP)
    assert signal.sum(dtype=np.float64) == pytest.approx(before, rel=1e-5)
    assert signal.max() == TOP
    assert (signal == TOP).sum() > side**2 + 0.5 * (times - 1) * side**2 / 0.9
    added = signal - 100.0
    for axis in (0, 1):
        middle = added.sum(axis=axis, dtype=np.float64) @ np.arange(161.0) / added.sum(dtype=np.float64)
        assert middle == pytest.approx(80.0, abs=0.25)


@pytest.mark.parametrize("along", ["columns", "rows", "around"])
def test_unsaturated_pictures_are_unchanged(along: str) -> None:
    signal, expected = hot_spot(), hot_spot()
    bloom(along).spill(signal, 1e6)
    np.testing.assert_array_equal(signal, expected)
    bloom(along, fraction=0.0).spill(signal, TOP)
    np.testing.assert_array_equal(signal, np.minimum(expected, TOP))


# In the signal chain


def chain(bloom: Bloom | None, gain: float = 0.02) -> SignalChain:
    response = ElectronSensor().response(SensorSettings(INSB, 14, 0.0, (220.0, 400.0)))
    drift = Drift(pixel=0, column=0, row=0, gain=gain, age_s=1e5)
    return SignalChain(response, (Shot(), drift), 30.0, 1, bloom=bloom)


def spot_light(*kelvin: float) -> Floats:
    light = np.full((60, 80), radiance(INSB, 300.0), np.float32)
    for each in kelvin:
        light[30, 40] = radiance(INSB, each)
    return light


def test_spilled_charge_varies_as_the_light_it_comes_from() -> None:
    """450 and 650 run each way, 1,100 in all, of which the next pixel but one gets 100."""
    signal = np.zeros((30, 1), np.float32)
    signal[[10, 11], 0] = 1900.0, 2300.0
    found = bloom_variance(signal, GAIN, 0.0, TOP, Bloom())
    assert found is not None
    (rows, _), squares = found
    expected = GAIN * (1900.0**2 + 2300.0**2) / 4
    assert squares[[8 - rows.start, 13 - rows.start], 0] == pytest.approx([expected] * 2, rel=0.01)


def test_blooming_adds_no_variance_without_spill_or_drift() -> None:
    assert bloom_variance(np.full((9, 9), 100.0, np.float32), GAIN, 0.0, TOP, Bloom()) is None
    np.testing.assert_array_equal(chain(Bloom()).variance(spot_light(), 3), chain(None).variance(spot_light(), 3))
    drifting, stable = (chain(Bloom(), gain).variance(spot_light(440.0), 3, fixed=False) for gain in (0.02, 0.0))
    np.testing.assert_array_equal(drifting, stable)
