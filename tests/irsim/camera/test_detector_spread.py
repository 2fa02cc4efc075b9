"""How much pixels vary that hold what others have spilled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irsim.camera.bloom import Bloom, Direction, bloom_variance
from irsim.camera.drift import Drift
from irsim.camera.noise import Shot
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.types import Floats

INSB = (3.4, 4.9)
TOP, GAIN = 1000.0, 0.01**2


def blooming(bloom: Bloom | None, gain: float = 0.02) -> SignalChain:
    response = ElectronSensor().response(SensorSettings(INSB, 14, 0.0, (220.0, 400.0)))
    drift = Drift(pixel=0, column=0, row=0, gain=gain, age_s=1e5)
    return SignalChain(response, (Shot(), drift), 30.0, 1, bloom=bloom)


def spots(*kelvin: float) -> Floats:
    light = np.full((36, 36), radiance(INSB, 300.0), np.float32)
    for number, each in enumerate(kelvin):
        first = 11 + 12 * number
        light[first : first + 2, first : first + 2] = radiance(INSB, each)
    return light


@pytest.mark.sampled
@pytest.mark.parametrize("along", ["columns", "rows", "around"])
def test_variance_is_that_of_counts_over_seeds_where_others_have_spilled(along: Direction) -> None:
    """The spill of a spot ends within a picture, or fills single pixels beyond by half. At its very end few draws of
    many reach a pixel, and how far varies by pixels: there 600 of them tell little, and the median is held."""
    sensor, light = blooming(Bloom(along=along, length_px=1.5)), spots(400.0, 440.0)
    mean, variance = sensor.mean(light, 3), sensor.variance(light, 3)
    taken = [replace(sensor, seed=seed).expose(light, 3).astype(np.float64) for seed in range(600)]
    square = np.mean([(each - mean) ** 2 for each in taken], axis=0)
    alone = replace(sensor, bloom=None).variance(spots(), 3)
    receiving = np.isfinite(variance) & (variance > 1.3 * alone)
    assert receiving.sum() >= 2
    assert np.median(square[receiving] / variance[receiving]) == pytest.approx(1, abs=0.1)
    elsewhere = np.isfinite(variance) & ~receiving
    assert (square[elsewhere] / variance[elsewhere]).mean() == pytest.approx(1, abs=0.02)


def test_what_one_pixel_spills_varies_as_its_light_does() -> None:
    """All around, a neighbour gets the same share of all that is spilled: w, and has w^2 of what that varies by."""
    signal = np.full((41, 41), 100.0, np.float32)
    signal[20, 20] = 3000.0
    bloom = Bloom(along="around", length_px=3.0)
    held = signal.copy()
    bloom.spill(held, TOP)
    found = bloom_variance(signal, GAIN, 0.0, TOP, bloom)
    assert found is not None
    region, squares = found
    share = (held[region] - signal[region]) / 2000.0
    expected = GAIN * ((share * 3000.0) ** 2 + 100.0**2)
    beside = share > 0
    assert beside.sum() > 1000
    np.testing.assert_allclose(squares[beside], expected[beside], rtol=0.25)  # by the chance of their own gains
    assert (squares[beside] / expected[beside]).mean() == pytest.approx(1, abs=0.01)


def test_what_two_spill_onto_one_adds_up_in_squares() -> None:
    signal = np.full((30, 1), 0.0, np.float32)
    signal[[10, 11], 0] = 1900.0, 2300.0  # 450 and 650 each way: 1,100, of which the next pixel but one gets 100
    found = bloom_variance(signal, GAIN, 0.0, TOP, Bloom())
    assert found is not None
    (rows, _), squares = found
    variance = dict(zip(range(rows.start, rows.stop), squares[:, 0].tolist(), strict=True))
    expected = GAIN * (1900.0**2 + 2300.0**2) / 4
    assert variance[8] == pytest.approx(expected, rel=0.01)
    assert variance[13] == pytest.approx(expected, rel=0.01)


def test_what_changes_from_frame_to_frame_only_is_as_it_was() -> None:
    light = spots(440.0)
    drifting, steady = blooming(Bloom()), blooming(Bloom(), 0.0)
    np.testing.assert_array_equal(drifting.variance(light, 3, fixed=False), steady.variance(light, 3, fixed=False))


def test_where_nothing_spills_there_is_nothing_to_tell() -> None:
    signal = np.full((9, 9), 100.0, np.float32)
    assert bloom_variance(signal, GAIN, 0.0, TOP, Bloom()) is None
    np.testing.assert_array_equal(blooming(Bloom()).variance(spots(), 3), blooming(None).variance(spots(), 3))
