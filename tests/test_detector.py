"""Noise terms and counts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from irsim.detector import NOISES, Ar1, FixedPattern, Noise, White, ar1, expose, response
from irsim.radiometry import radiance, slope

SHAPE = (256, 256)
RATE_HZ = 30.0
N = SHAPE[0] * SHAPE[1]

NEEDED: dict[str, dict[str, Any]] = {"ar1": {"rho": 0.9}}
"""What a kind cannot be built without."""

BENIGN: dict[str, dict[str, Any]] = {"fixed_pattern": {"pixel": 0, "column": 0, "row": 0}}
"""What makes a kind silent, where it is not ratio: 0."""


def build(word: str, **fields: Any) -> Noise:
    found = NOISES.parse({"kind": word, **NEEDED.get(word, {}), **fields})
    assert isinstance(found, Noise)
    return found


# Every kind of noise


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_pattern_fits_the_frame_and_is_finite(word: str) -> None:
    pattern = build(word).pattern(5, (24, 40), RATE_HZ, 1)
    assert pattern.dtype == np.float32
    assert np.broadcast_shapes(pattern.shape, (24, 40)) == (24, 40)
    assert np.isfinite(pattern).all()
    assert pattern.std() > 0.1


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_frame_alone_is_the_frame_in_sequence(word: str) -> None:
    noise = build(word)
    frames = [0, 1, 2, 3, 127, 128, 255, 256, 257, 700]
    in_order = {index: noise.pattern(index, (16, 20), RATE_HZ, 1).copy() for index in range(701)}
    for order in (frames, frames[::-1], frames[::2] + frames[1::2]):
        for index in order:
            np.testing.assert_array_equal(noise.pattern(index, (16, 20), RATE_HZ, 1), in_order[index])
    for index in frames:
        forget()
        np.testing.assert_array_equal(noise.pattern(index, (16, 20), RATE_HZ, 1), in_order[index])


def forget() -> None:
    """As a new process: nothing kept from earlier frames."""
    ar1._process.cache_clear()


@pytest.mark.parametrize("word", NOISES.kinds)
def test_seed_and_name_address_a_pattern(word: str) -> None:
    noise, other = build(word), build(word, id="other")
    first = noise.pattern(3, SHAPE, RATE_HZ, 1)
    for second in (noise.pattern(3, SHAPE, RATE_HZ, 2), other.pattern(3, SHAPE, RATE_HZ, 1)):
        # 0.3: column and row terms are few numbers spread over many pixels.
        assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3
    np.testing.assert_array_equal(first, build(word).pattern(3, SHAPE, RATE_HZ, 1))


@pytest.mark.parametrize("word", NOISES.kinds)
def test_benign_values_are_silent(word: str) -> None:
    assert not build(word, **BENIGN.get(word, {"ratio": 0})).pattern(3, (24, 40), RATE_HZ, 1).any()


@pytest.mark.parametrize("word", NOISES.kinds)
def test_what_was_given_out_does_not_change_later(word: str) -> None:
    noise = build(word)
    given = noise.pattern(3, (24, 40), RATE_HZ, 1)
    before = given.copy()
    for index in range(20):
        noise.pattern(index, (24, 40), RATE_HZ, 1)
    np.testing.assert_array_equal(given, before)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_noise_survives_its_dump(word: str) -> None:
    noise = build(word, id="mine")
    assert NOISES.parse({"kind": word, **noise.model_dump()}) == noise


@pytest.mark.parametrize("word", NOISES.kinds)
@pytest.mark.parametrize("sigma", [-0.1, 1001.0, float("nan"), "1"])
def test_a_sigma_that_cannot_be_is_refused(word: str, sigma: Any) -> None:
    field = next(iter(BENIGN.get(word, {"ratio": 0})))
    with pytest.raises(PydanticCustomError):
        build(word, **{field: sigma})


# Sigmas; a sample's variance has the standard error sigma^2 sqrt(2 / n)


def test_white_has_the_ratio_as_sigma_and_no_memory() -> None:
    first, second = (White(ratio=2.5).pattern(index, SHAPE, RATE_HZ, 1) for index in (0, 1))
    assert first.var() / 2.5**2 == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 4.5 / np.sqrt(N)


def test_fixed_pattern_stays_and_has_its_three_sigmas() -> None:
    noise = FixedPattern(pixel=0.5, column=2.0, row=1.0)
    pattern = noise.pattern(0, (400, 500), RATE_HZ, 1).astype(np.float64)
    np.testing.assert_array_equal(pattern, noise.pattern(77, (400, 500), RATE_HZ, 1))
    columns, rows = pattern.mean(axis=0), pattern.mean(axis=1)
    pixels = pattern - columns - rows[:, None] + pattern.mean()
    # A mean over a column of 400 pixels keeps 1/400 of the pixels' variance, one over a row 1/500.
    assert columns.var(ddof=1) == pytest.approx(2.0**2 + 0.5**2 / 400, rel=4.5 * np.sqrt(2 / 500))
    assert rows.var(ddof=1) == pytest.approx(1.0**2 + 0.5**2 / 500, rel=4.5 * np.sqrt(2 / 400))
    assert pixels.var() == pytest.approx(0.5**2 * (399 / 400) * (499 / 500), rel=4.5 * np.sqrt(2 / pattern.size))


# AR(1)


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.9, 0.97])
def test_ar1_has_variance_one_in_every_frame(rho: float) -> None:
    noise = Ar1(rho=rho)
    for index in (0, 1, 2, 7, 64, 127, 128, 200, 255, 256, 257, 300, 511, 512, 513, 1000):
        pattern = noise.pattern(index, SHAPE, RATE_HZ, 3)
        assert pattern.var(dtype=np.float64) == pytest.approx(1, abs=4.5 * np.sqrt(2 / N)), index
        assert pattern.mean(dtype=np.float64) == pytest.approx(0, abs=4.5 / np.sqrt(N)), index


@pytest.mark.parametrize("lag", [1, 2, 5, 20])
@pytest.mark.parametrize("rho", [0.3, 0.9, 0.97])
def test_ar1_correlation_falls_as_rho_to_the_lag_with_no_seam(rho: float, lag: int) -> None:
    noise = Ar1(rho=rho)
    # Anchors stand at multiples of 16 (rho 0.3), 256 (0.9) and 512 (0.97).
    for start in (0, 5, 100, 125, 255, 256, 257, 512 - lag, 513 - lag, 512, 1019):
        first, second = (noise.pattern(index, SHAPE, RATE_HZ, 3).ravel() for index in (start, start + lag))
        expected = rho**lag
        error = (1 - expected**2) / np.sqrt(N)  # of a sample correlation
        assert np.corrcoef(first, second)[0, 1] == pytest.approx(expected, abs=4.5 * error), start


@pytest.mark.parametrize("now", [1, 2, 64, 255, 256, 257, 300, 512])
def test_ar1_remembers_nothing_but_the_frame_before(now: int) -> None:
    noise = Ar1(rho=0.9)
    patterns = {
        index: noise.pattern(index, SHAPE, RATE_HZ, 4).astype(np.float64) for index in range(max(now - 9, 0), now + 1)
    }
    innovation = patterns[now] - 0.9 * patterns[now - 1]
    assert innovation.var() == pytest.approx(1 - 0.9**2, rel=4.5 * np.sqrt(2 / N))
    for index, earlier in patterns.items():
        if index < now:
            assert abs(np.corrcoef(innovation.ravel(), earlier.ravel())[0, 1]) < 4.5 / np.sqrt(N), index


def test_ar1_without_correlation_is_white() -> None:
    np.testing.assert_array_equal(
        Ar1(rho=0.0, id="n").pattern(9, SHAPE, RATE_HZ, 1), White(id="n").pattern(9, SHAPE, RATE_HZ, 1)
    )


def test_ar1_time_constant_is_a_rho_at_a_rate() -> None:
    # DESIGN: 1.05 s is rho 0.9 at 9 Hz and 0.97 at 30 Hz.
    noise = Ar1(time_constant_s=1.05)
    assert np.exp(-noise.decay(9.0)) == pytest.approx(0.9, abs=5e-4)
    assert np.exp(-noise.decay(30.0)) == pytest.approx(0.97, abs=2e-3)
    assert Ar1(rho=0.9).decay(30.0) == pytest.approx(-np.log(0.9))


def test_ar1_far_out_in_a_long_memory_is_quick() -> None:
    noise = Ar1(time_constant_s=1e6)
    first, second = (noise.pattern(index, SHAPE, 10_000.0, 1) for index in (9_999_998, 9_999_999))
    assert np.corrcoef(first.ravel(), second.ravel())[0, 1] > 1 - 1e-6
    assert first.var() == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))


@pytest.mark.parametrize("fields", [{}, {"rho": 0.9, "time_constant_s": 1.0}, {"rho": 1.0}, {"rho": -0.1}])
def test_ar1_wants_exactly_one_way(fields: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        Ar1.model_validate(fields)


def test_an_unknown_noise_says_what_is_allowed() -> None:
    with pytest.raises(PydanticCustomError, match=r"unknown noise kind 'whit'; allowed: white.*did you mean 'white'"):
        NOISES.parse({"kind": "whit"})


# Counts


def counts_of(kelvin: float, bits: int = 14, netd_mk: float = 40.0, patterns: tuple[Any, ...] = ()) -> Any:
    light = np.full((4, 5), radiance("lwir", kelvin), np.float32)
    return expose(light, patterns, netd_mk, "lwir", (250.0, 350.0), bits)


@pytest.mark.parametrize("bits", [8, 12, 14, 16])
def test_counts_span_the_range_of_temperatures(bits: int) -> None:
    full = 2**bits - 1
    middle = float(radiance("lwir", 250.0) + radiance("lwir", 350.0)) / 2
    light = np.array([[radiance("lwir", 250.0), middle, radiance("lwir", 350.0)]], np.float32)
    counts = expose(light, [], 40.0, "lwir", (250.0, 350.0), bits)
    assert counts.dtype == np.uint16
    np.testing.assert_allclose(counts, [[0, full / 2, full]], atol=0.51)


@pytest.mark.parametrize("bits", [8, 14, 16])
def test_counts_saturate_and_never_wrap(bits: int) -> None:
    full = 2**bits - 1
    assert (counts_of(200.0, bits) == 0).all()
    assert (counts_of(5000.0, bits) == full).all()
    for size in (1e4, 1e9):
        assert (counts_of(300.0, bits, patterns=(np.full((4, 5), size, np.float32),)) == full).all()
        assert (counts_of(300.0, bits, patterns=(np.full((4, 5), -size, np.float32),)) == 0).all()


def test_counts_are_rounded_to_the_nearest() -> None:
    gain = 255 / float(radiance("lwir", 350.0) - radiance("lwir", 250.0))
    wanted = np.array([[9.6, 10.0, 10.4, 10.6, 200.49, 200.51]])
    light = (wanted / gain + radiance("lwir", 250.0)).astype(np.float32)
    np.testing.assert_array_equal(expose(light, [], 0.0, "lwir", (250.0, 350.0), 8), [[10, 10, 10, 11, 200, 201]])


def test_one_netd_of_noise_is_one_netd_of_temperature() -> None:
    """At 300 K a unit of noise moves the count as far as netd_mk more of scene temperature does."""
    unit = np.ones((4, 5), np.float32)
    by_noise = counts_of(300.0, 16, 200.0, (unit,)).astype(int) - counts_of(300.0, 16, 200.0)
    by_scene = counts_of(300.2, 16, 200.0).astype(int) - counts_of(300.0, 16, 200.0)
    assert by_noise.mean() > 100
    np.testing.assert_allclose(by_noise, by_scene, atol=1)


def test_noise_of_counts_is_the_stated_sigma() -> None:
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    noise = White().pattern(0, SHAPE, RATE_HZ, 1)
    found = expose(light, [noise], 500.0, "mwir", (220.0, 400.0), 14).astype(np.float64)
    gain = (2**14 - 1) / float(radiance("mwir", 400.0) - radiance("mwir", 220.0))
    variance = (0.5 * slope("mwir", 300.0) * gain) ** 2 + 1 / 12  # rounding adds 1/12
    assert found.var() == pytest.approx(variance, rel=4.5 * np.sqrt(2 / N))


def test_patterns_add_up_and_broadcast() -> None:
    rng = np.random.default_rng(1)
    light = np.full((24, 40), radiance("lwir", 300.0), np.float32)
    full, row, column = (rng.normal(0, 3, shape).astype(np.float32) for shape in ((24, 40), (24, 1), (1, 40)))
    detector = response(100.0, "lwir", (250.0, 350.0), 14)
    expected = detector.gain * (light.astype(float) - detector.dark) + detector.noise * (full + row + column)
    found = expose(light, [full, row, column], 100.0, "lwir", (250.0, 350.0), 14)
    np.testing.assert_allclose(found, expected, atol=0.51)


def test_expose_changes_no_input() -> None:
    light = np.full((4, 5), radiance("lwir", 300.0), np.float32)
    pattern = np.ones((4, 5), np.float32)
    light.flags.writeable = pattern.flags.writeable = False
    before = light.copy(), pattern.copy()
    expose(light, [pattern], 40.0, "lwir", (250.0, 350.0), 14)
    np.testing.assert_array_equal(light, before[0])
    np.testing.assert_array_equal(pattern, before[1])


def test_without_netd_there_is_no_noise() -> None:
    np.testing.assert_array_equal(
        counts_of(300.0, netd_mk=0.0, patterns=(np.full((4, 5), 3.0, np.float32),)), counts_of(300.0)
    )
