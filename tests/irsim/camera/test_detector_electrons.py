"""Electrons: how many there are, their noise, what a well holds and what it spills."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import constants, integrate, stats

from irsim.camera.bloom import Bloom
from irsim.camera.camera import Camera
from irsim.camera.noise import Shot, poisson
from irsim.camera.noise_base import FrameContext
from irsim.camera.presets import Preset
from irsim.camera.sensor import ElectronSensor, SensorSettings, matched_sensor, photon_radiance, photon_slope
from irsim.camera.signal_chain import SignalChain
from irsim.config.base import dump
from irsim.physics.radiometry import radiance, temperature
from irsim.types import Band, Floats

INSB: Band = (3.4, 4.9)
SHAPE = (256, 256)
N = SHAPE[0] * SHAPE[1]


def photons_by_quad(band: tuple[float, float], kelvin: float) -> float:
    """2 c / lambda^4 / (exp(hc / lambda k T) - 1), integrated over the band by QUADPACK: 1/s/m2/sr."""
    exponent = constants.h * constants.c / constants.k / kelvin

    def density(wavelength: float) -> float:
        return float(2 * constants.c / wavelength**4 / math.expm1(exponent / wavelength))

    return float(integrate.quad(density, band[0] * 1e-6, band[1] * 1e-6, epsrel=1e-11)[0])


def sensor(bits: int = 14, band: Band = INSB, seed: int = 1, **fields: float) -> SignalChain:
    response = ElectronSensor.model_validate(fields).response(SensorSettings(band, bits, 0.0, (220.0, 400.0)))
    return SignalChain(response, (Shot(),), 30.0, seed)


def light_of(camera: SignalChain, electrons: float, shape: tuple[int, int] = SHAPE) -> Floats:
    """The light that gives so many electrons: S = a L + b sqrt(L) + zero solved for sqrt(L)."""
    response = camera.response
    root = math.sqrt(response.root**2 + 4 * response.linear * (electrons - response.zero)) - response.root
    return np.full(shape, (root / (2 * response.linear)) ** 2, np.float32)


# How many


@pytest.mark.parametrize("band", [INSB, (3.0, 5.0), (7.7, 9.3), (8.0, 12.0)])
@pytest.mark.parametrize("kelvin", [220.0, 300.0, 600.0])
def test_photon_radiance_is_planck_over_photon_energy(band: tuple[float, float], kelvin: float) -> None:
    assert photon_radiance(band, kelvin) == pytest.approx(photons_by_quad(band, kelvin), rel=1e-9)
    step = 0.01
    rise = (photons_by_quad(band, kelvin + step) - photons_by_quad(band, kelvin - step)) / (2 * step)
    assert photon_slope(band, kelvin) == pytest.approx(rise, rel=1e-6)


def test_cooled_insb_has_the_electrons_and_the_netd_of_the_design() -> None:
    """3.4-4.9 um, F/4, 15 um, 10 ms, 400 e- read noise, QE x optics .68: 2.58 Me- and 17.7 mK at 300 K."""
    camera = sensor()
    electrons = camera.response.signal(np.full((1, 1), radiance(INSB, 300.0), np.float32))
    by_hand = (15e-6) ** 2 * math.pi / (4 * 4**2 + 1) * 0.68 * 10e-3 * photons_by_quad((3.4, 4.9), 300.0)
    assert electrons[0, 0] == pytest.approx(by_hand, rel=1e-6)
    assert electrons[0, 0] == pytest.approx(2.58e6, rel=2e-3)
    assert camera.response.netd_mk == pytest.approx(17.7, abs=0.05)


@pytest.mark.parametrize(("band", "tolerance"), [((3.0, 5.0), 0.021), (INSB, 0.015), ((8.0, 12.0), 0.004)])
def test_the_curve_of_electrons_follows_planck(band: tuple[float, float], tolerance: float) -> None:
    kelvin = np.linspace(250.0, 400.0, 16)
    camera = sensor(band=band)
    found = camera.response.signal(radiance(band, kelvin).astype(np.float32)[None])[0]
    factor = ElectronSensor().flux_factor()
    expected = [factor * photons_by_quad(band, each) for each in kelvin]
    np.testing.assert_allclose(found, expected, rtol=tolerance)
    # Its slope at 300 K, on which NETD rests, is Planck's.
    near = camera.response.signal(radiance(band, np.array([[298.0, 302.0]])).astype(np.float32))[0].astype(float)
    rise = factor * (photons_by_quad(band, 302.0) - photons_by_quad(band, 298.0))
    assert near[1] - near[0] == pytest.approx(rise, rel=2e-3)


@pytest.mark.parametrize(
    ("band", "above"), [((3.0, 5.0), (0.045, 0.12, 0.16, 0.18)), ((8.0, 12.0), (0.008, 0.019, 0.024, 0.027))]
)
def test_of_hot_bodies_the_curve_makes_too_many(band: tuple[float, float], above: tuple[float, ...]) -> None:
    for kelvin, expected in zip((500.0, 1000.0, 2000.0, 6000.0), above, strict=True):
        electrons = ElectronSensor().flux_factor() * photons_by_quad(band, kelvin)
        assert sensor(band=band).response.at(float(radiance(band, kelvin))) == pytest.approx(
            electrons * (1 + expected), rel=0.005
        )


def test_electrons_grow_with_area_time_aperture_and_share() -> None:
    light = np.full((1, 1), radiance(INSB, 290.0), np.float32)

    def electrons(**fields: float) -> float:
        return float(sensor(14, INSB, 1, **fields).response.signal(light)[0, 0])

    base = electrons()
    assert electrons(pitch_um=30.0) / base == pytest.approx(4)
    assert electrons(integration_ms=5.0) / base == pytest.approx(0.5)
    assert electrons(f_number=2.0) / base == pytest.approx((4 * 16 + 1) / (4 * 4 + 1))
    assert electrons(quantum_efficiency=0.4) / base == pytest.approx(0.5)
    assert electrons(dark_me_s=20.0) - base == pytest.approx(0.2e6, rel=1e-5)


# Noise


def test_photon_transfer_has_the_slope_of_the_gain() -> None:
    """Variance against mean in counts: slope 1 / gain, intercept (read noise / gain)^2 + 1/12."""
    camera = sensor(read_noise_e=400.0)
    gain = 7e6 / (2**14 - 1)
    means, variances = [], []
    for level in np.linspace(0.1e6, 6.5e6, 12):
        counts = camera.expose(light_of(camera, level), int(level)).astype(np.float64)
        means.append(counts.mean())
        variances.append(counts.var())
        assert counts.mean() == pytest.approx(level / gain, abs=0.1)
    weights = 1 / np.array(variances)  # a variance's sd is proportional to it
    slope, intercept = np.polyfit(means, variances, 1, w=weights)
    assert slope == pytest.approx(1 / gain, rel=0.005)
    assert intercept == pytest.approx((400 / gain) ** 2 + 1 / 12, abs=0.08)


@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir"])
def test_netd_measured_on_frames_is_the_stated_one(preset: str) -> None:
    """Sigma of the difference of two frames at 300 K, over sqrt 2, by the mean's rise from 299 to 301 K."""
    camera = Camera.model_validate({"preset": preset, "noise": [{"kind": "shot"}]})
    read = camera.sensor(3)
    cold, here, warm = (np.full(SHAPE, radiance(camera.band, kelvin), np.float32) for kelvin in (299.0, 300.0, 301.0))
    first, second = (read.expose(here, index).astype(np.float64) for index in (0, 1))
    rise = float((read.mean(warm, 0) - read.mean(cold, 0)).mean()) / 2
    measured = (first - second).std() / math.sqrt(2) / rise * 1e3
    assert measured == pytest.approx(camera.netd(), rel=4.5 / math.sqrt(2 * N))


@pytest.mark.parametrize("level", [0.0, 3.0, 50.0, 199.0, 201.0, 5000.0])
def test_mean_and_variance_of_electrons_are_poissons_at_any_level(level: float) -> None:
    camera = sensor(bits=16, read_noise_e=0.0, gain_e=1.0)
    counts = camera.expose(light_of(camera, level), 0).astype(np.float64)
    assert counts.mean() == pytest.approx(level, abs=4.5 * math.sqrt(level / N) + 1e-9)
    rounding = 1 / 12 if level >= 200 else 0  # below, they are whole already
    sd = math.sqrt((2 + 1 / max(level, 1)) / N)
    assert counts.var() == pytest.approx(level + rounding, rel=4.5 * sd, abs=1e-9)


def test_few_electrons_have_poissons_own_shape() -> None:
    camera = sensor(bits=16, read_noise_e=0.0, gain_e=1.0)
    counts = camera.expose(light_of(camera, 3.0), 0).ravel()
    seen = np.bincount(counts, minlength=14)[:14]
    expected = stats.poisson(3.0).pmf(np.arange(14)) * N
    assert ((seen - expected) ** 2 / expected).sum() < stats.chi2(13).ppf(0.9999)


def test_poisson_numbers_are_the_quantiles() -> None:
    rng = np.random.default_rng(2)
    means, uniform = rng.uniform(0, 250, 4000), rng.random(4000)
    means[:3], uniform[:3] = (0.0, 1e-9, 250.0), (1 - 2**-53, 0.5, 1 - 2**-53)
    np.testing.assert_array_equal(poisson(means, uniform)[3:], stats.poisson.ppf(uniform, means)[3:])
    assert poisson(means, uniform)[:2].tolist() == [0, 0]
    assert 250 + 7 * math.sqrt(250) < poisson(means, uniform)[2] < 250 + 10 * math.sqrt(250)


def test_a_dark_pixel_changes_no_other_pixel() -> None:
    """Each pixel's noise is its own, whatever its neighbours see."""
    camera = sensor()
    light = light_of(camera, 1e6, (40, 50))
    changed = light.copy()
    changed[10:12, 20:25] = light_of(camera, 50.0, (2, 5))
    same = np.ones(light.shape, bool)
    same[10:12, 20:25] = False
    np.testing.assert_array_equal(camera.expose(light, 4)[same], camera.expose(changed, 4)[same])


def test_variance_of_counts_is_shot_and_read_noise_and_rounding() -> None:
    camera = sensor(read_noise_e=900.0)
    light = np.linspace(0.5, 3.0, 500, dtype=np.float32)[None]
    electrons = camera.response.signal(light).astype(np.float64)
    gain = 7e6 / (2**14 - 1)
    expected = (electrons + 900**2) / gain**2 + 1 / 12
    np.testing.assert_allclose(camera.variance(light, 0), expected, rtol=1e-6)
    frames = np.stack([camera.expose(light, index) for index in range(400)]).astype(np.float64)
    ratio = ((frames - camera.mean(light, 0)) ** 2).mean(axis=0) / expected
    assert ratio.mean() == pytest.approx(1, abs=4.5 * math.sqrt(2 / (400 * 500)))


# The well


def test_a_full_well_is_the_highest_count_and_has_only_read_noise() -> None:
    camera = sensor(read_noise_e=1000.0, gain_e=1000.0)
    hot = np.full((60, 80), radiance(INSB, 500.0), np.float32)
    counts = camera.expose(hot, 0).astype(np.float64)
    assert counts.mean() == pytest.approx(7000, abs=0.1)
    assert counts.var() == pytest.approx(1 + 1 / 12, rel=4.5 * math.sqrt(2 / counts.size))
    assert np.isinf(camera.variance(hot, 0)).all()
    assert (sensor().expose(hot, 0) >= 2**14 - 8).all()  # read noise of 0.94 counts
    offset = sensor(offset=500.0)
    assert offset.expose(np.zeros((60, 80), np.float32), 0).mean() == pytest.approx(500, abs=1)
    assert offset.response.counts(np.full((1, 1), 7e6, np.float32))[0, 0] == 2**14 - 1


def hot_spot() -> Floats:
    signal = np.full((31, 41), 100.0, np.float32)
    signal[15, 20] = 1000 + 3 * 900 + 3 * 900 + 60
    return signal


@pytest.mark.parametrize("along", ["columns", "rows"])
def test_bloom_fills_the_line_and_loses_nothing(along: str) -> None:
    """6,660 - 1,000 above the well, half each way: 2,730 fill three neighbours by 900 each, and 30 go further."""
    signal = hot_spot() + 0
    signal[15, 20] = 1000 + 2 * (3 * 900 + 30)
    total = signal.sum(dtype=np.float64)
    Bloom(along=along).spill(signal, 1000.0)  # type: ignore[arg-type]  # one of its words, to mypy any str
    line = signal[:, 20] if along == "columns" else signal[15]
    middle = 15 if along == "columns" else 20
    np.testing.assert_allclose(line[middle - 3 : middle + 4], 1000)
    np.testing.assert_allclose([line[middle - 4], line[middle + 4]], 130)
    assert signal.sum(dtype=np.float64) == pytest.approx(total)
    assert (np.delete(signal, 20, axis=1) if along == "columns" else np.delete(signal, 15, axis=0)).max() == 100


def test_bloom_all_around_falls_off_and_spills_its_share() -> None:
    signal = hot_spot()
    excess = float(signal[15, 20]) - 1000
    before = signal.sum(dtype=np.float64)
    Bloom(along="around", length_px=1.5, fraction=0.05).spill(signal, 1000.0)
    assert before - signal.sum(dtype=np.float64) == pytest.approx(0.95 * excess, rel=1e-4)
    added = signal - 100
    assert added[15, 21] == added[15, 19] == added[14, 20] == added[16, 20]
    assert added[15, 22] / added[15, 21] == pytest.approx(math.exp(-1 / 1.5), rel=1e-4)
    assert added[16, 21] / added[15, 21] == pytest.approx(math.exp(-(math.sqrt(2) - 1) / 1.5), rel=1e-4)


@pytest.mark.parametrize(("side", "times"), [(3, 30.0), (41, 3.0)])
def test_bloom_all_around_flows_on_past_full_pixels_and_loses_nothing(side: int, times: float) -> None:
    """The second spot is wider than charge goes at once, 9 px from a full pixel's middle."""
    signal = np.full((161, 161), 100.0, np.float32)
    spot = slice(80 - side // 2, 81 + side // 2)
    signal[spot, spot] = times * 1000.0
    before = signal.sum(dtype=np.float64)
    Bloom(along="around", length_px=1.5).spill(signal, 1000.0)
    assert signal.sum(dtype=np.float64) == pytest.approx(before, rel=1e-5)
    assert signal.max() == 1000.0
    assert (signal == 1000.0).sum() > side**2 + 0.5 * (times - 1) * side**2 / 0.9
    added = signal - 100.0
    for axis in (0, 1):
        middle = added.sum(axis=axis, dtype=np.float64) @ np.arange(161.0) / added.sum(dtype=np.float64)
        assert middle == pytest.approx(80.0, abs=0.25)


@pytest.mark.parametrize("along", ["columns", "rows", "around"])
def test_bloom_leaves_a_picture_without_saturation_alone(along: str) -> None:
    signal = hot_spot()
    expected = signal.copy()
    Bloom(along=along).spill(signal, 1e6)  # type: ignore[arg-type]  # one of its words, to mypy any str
    np.testing.assert_array_equal(signal, expected)
    Bloom(along=along, fraction=0.0).spill(signal, 1000.0)  # type: ignore[arg-type]  # one of its words, to mypy any str
    np.testing.assert_array_equal(signal, np.minimum(expected, 1000))


def test_a_blooming_sensor_shows_it_and_its_variance_knows_it() -> None:
    plain = sensor()
    blooming = SignalChain(plain.response, (Shot(),), 30.0, 1, bloom=Bloom())
    light = np.full((60, 80), radiance(INSB, 300.0), np.float32)
    light[30, 40] = radiance(INSB, 420.0)
    counts = blooming.expose(light, 0)
    streak = counts[25:36, 40] > 2**14 - 8
    assert streak.sum() > (plain.expose(light, 0)[25:36, 40] > 2**14 - 8).sum()
    np.testing.assert_array_equal(np.isinf(blooming.variance(light, 0))[25:36, 40], streak)
    assert float(temperature(INSB, light[30, 40])) == pytest.approx(420.0, abs=0.1)


def test_shot_noise_alone_is_the_same_frame_anywhere() -> None:
    camera = sensor()
    light = light_of(camera, 1e6, (20, 30))
    again = [camera.expose(light, index) for index in (3, 1, 3)]
    np.testing.assert_array_equal(again[0], again[2])
    assert (again[0] != again[1]).any()
    assert camera.frame_context(3, (20, 30)) == FrameContext(3, (20, 30), 30.0, 1)


@pytest.mark.parametrize("falls_off", [False, True])
def test_a_spent_light_gives_the_same_counts_as_one_that_is_kept(falls_off: bool) -> None:
    camera = sensor()
    if falls_off:
        share = np.linspace(0.5, 1, 21 * 31, dtype=np.float32).reshape(21, 31)
        camera = replace(camera, falloff=lambda index: share)
    light = light_of(camera, 1e6, (21, 31)) * np.linspace(0, 1, 31, dtype=np.float32)
    kept, spent = light.copy(), light.copy()
    np.testing.assert_array_equal(camera.expose(spent, 2, spent=True), camera.expose(kept, 2))
    np.testing.assert_array_equal(kept, light)


@pytest.mark.parametrize("sigma", [0.01, 0.5, 4.0, 300.0])
@pytest.mark.parametrize("rate_hz", [0.01, 50.0, 10_000.0])
@pytest.mark.parametrize("preset", ["cooled_mwir", "cooled_lwir"])
def test_a_detector_like_another_has_its_curve_and_may_be_written(preset: Preset, rate_hz: float, sigma: float) -> None:
    """Its sigma is the one asked for, or more where no well or pixel holds so many electrons."""
    camera = Camera(preset=preset)
    curve = camera.response().curve
    found = matched_sensor(curve, camera.band, camera.bits, rate_hz, sigma)
    alike = Camera.model_validate(
        {"band": camera.band, "bits": camera.bits, "rate_hz": rate_hz, "detector": dump(found)}
    )
    response = alike.response()
    assert response.curve == pytest.approx(curve, rel=1e-9)
    had = response.noise / response.gain
    if found.pitch_um < 1000 and found.well_me < 10_000:
        assert had == pytest.approx(sigma, rel=1e-9)
    else:
        assert sigma < 1  # no recording of these cameras is so quiet
        assert had >= sigma
