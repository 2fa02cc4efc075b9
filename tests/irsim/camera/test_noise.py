"""Noise terms: the contract of every kind, and white, fixed-pattern, odd-even and 3-D noise."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any, cast

import even_noise
import numpy as np
import pytest
from pydantic_core import PydanticCustomError
from scipy import stats

from irsim.camera import NOISES, ar1, bad_pixels, drift, noise, noise_base
from irsim.camera import response as response_module
from irsim.camera.ar1 import Ar1
from irsim.camera.noise import FixedPattern, Noise3d, OddEven, Shot, White
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.types import Floats

SHAPE = (256, 256)
N = SHAPE[0] * SHAPE[1]
RATE_HZ = 30.0
LEVEL = 2e6
"""Electrons of every pixel before noise."""

REQUIRED: dict[str, dict[str, Any]] = {
    "ar1": {"rho": 0.9},
    "bad_pixels": {"dead": 0.01, "hot": 0.01, "blinking": 0.05},
}
"""Keys without which a kind cannot be built, or has too little effect for a test."""

ZERO: dict[str, dict[str, Any]] = {
    "fixed_pattern": {"pixel": 0, "column": 0, "row": 0},
    "noise_3d": {"tvh": 0},
    "drift": {"pixel": 0, "column": 0, "row": 0},
    "bad_pixels": {"dead": 0, "hot": 0, "blinking": 0},
}
"""Keys that make a kind silent, where it is not ratio: 0."""

BUILT_IN = ("white", "shot", "fixed_pattern", "ar1", "noise_3d", "drift", "odd_even", "bad_pixels")
WITH_ZERO = [word for word in NOISES.kinds if word in ZERO or "ratio" in NOISES.kinds[word].model_fields]
"""Kinds with a silent value."""


def at(index: int, shape: tuple[int, int] = SHAPE, seed: int = 1, rate_hz: float = RATE_HZ) -> FrameContext:
    return FrameContext(index, shape, rate_hz, seed)


def build(word: str, **fields: Any) -> Noise:
    found = NOISES.parse({"kind": word, **REQUIRED.get(word, {}), **fields})
    assert isinstance(found, Noise)
    return found


@lru_cache
def response() -> Response:
    return ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))


def effect(term: Noise, frame: FrameContext) -> Floats:
    return even_noise.effect(term, frame, response(), LEVEL)


def light(shape: tuple[int, int] = (24, 40)) -> Floats:
    return np.full(shape, radiance("mwir", 300.0), np.float32)


def clear_caches() -> None:
    """Forget all frames, as a new process."""
    kept = ar1._process, drift._process, drift._deviation, bad_pixels._telegraph, noise._line_block
    for each in (*kept, noise_base.gaussian_pattern):
        each.cache_clear()


# Every kind: a new one must pass without a change here


@pytest.mark.parametrize("word", NOISES.kinds)
def test_every_kind_has_a_finite_effect(word: str) -> None:
    done = np.stack([effect(build(word), at(500, (24, 40), seed)) for seed in range(5)])
    assert np.isfinite(done).all()
    assert np.abs(done).max() > 0.1


@pytest.mark.parametrize("word", NOISES.kinds)
def test_variance_terms_are_constant_where_stationary(word: str) -> None:
    term, frames = build(word), [at(0), at(9), at(500, rate_hz=25.0), FrameContext(500, SHAPE, RATE_HZ, 1, 400, 2)]
    is_constant = len({term.variance_terms(frame, True) for frame in frames}) == 1
    assert is_constant == term.stationary if word in BUILT_IN else is_constant or not term.stationary


@pytest.mark.parametrize("word", NOISES.kinds)
def test_compiled_and_plain_exposures_agree(word: str) -> None:
    chain = SignalChain(response(), (build(word, id="one"), build("fixed_pattern", id="other")), 50.0, 1)
    found = chain.expose(light(), 5)
    assert np.ptp(found) > 0
    clear_caches()
    with pytest.MonkeyPatch.context() as patch:
        for module in (ar1, noise, response_module):
            patch.setattr(module, "COMPILED", False)
        plain = SignalChain(response(), chain.noises, 50.0, 1).expose(light(), 5)
    assert np.abs(found.astype(int) - plain).max() <= 1
    assert (found == plain).mean() > 0.98


@pytest.mark.parametrize("word", NOISES.kinds)
def test_any_image_size_and_numpy_frame_numbers(word: str) -> None:
    chain = SignalChain(response(), (build(word),), 50.0, 1)
    for shape in ((10, 12), (20, 12), (20, 24)):
        alone = SignalChain(response(), chain.noises, 50.0, 1).expose(light(shape), 7)
        np.testing.assert_array_equal(chain.expose(light(shape), cast(int, np.int64(7))), alone)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_frame_alone_is_the_frame_in_sequence(word: str) -> None:
    term = build(word)
    frames = [0, 1, 2, 3, 127, 128, 255, 256, 257, 700]
    in_order = {index: effect(term, at(index, (16, 20))) for index in range(701)}
    for order in (frames[::-1], frames[::2] + frames[1::2]):
        for index in order:
            np.testing.assert_array_equal(effect(term, at(index, (16, 20))), in_order[index])
    for index in frames:
        clear_caches()
        np.testing.assert_array_equal(effect(term, at(index, (16, 20))), in_order[index])


@pytest.mark.parametrize("word", NOISES.kinds)
def test_numbers_are_addressed_by_seed_and_name(word: str) -> None:
    """Over 100 scenes, products with another seed or name average out; the address of white noise has no name."""
    term, other, frame = build(word), build(word, id="other"), at(300, (16, 20))
    first, renamed = (
        np.stack([effect(each, replace(frame, seed=seed)) for seed in range(101)]) for each in (term, other)
    )
    np.testing.assert_array_equal(effect(build(word), frame), first[1])
    if np.ptp(first, axis=0).any():  # not a kind without random numbers
        square, is_white = (first**2).mean(), term.temporal_sigma(frame) > 0 or term.counts_electrons
        assert abs((first[1:] * first[:-1]).mean()) < 0.45 * square
        assert is_white or abs((first * renamed).mean()) < 0.45 * square


@pytest.mark.parametrize("word", WITH_ZERO)
def test_zero_values_are_silent(word: str) -> None:
    term = build(word, **ZERO.get(word, {"ratio": 0}))
    assert not effect(term, at(3, (24, 40))).any()
    assert not np.any(term.variance(np.full((24, 40), LEVEL, np.float32), response(), at(3, (24, 40)), True))


@pytest.mark.parametrize("word", NOISES.kinds)
def test_variance_is_the_mean_square_over_seeds(word: str) -> None:
    """Over 300 scenes, each pixel's mean square about the noiseless signal.

    Its sd is sqrt((kurtosis - 1) / 300) of it: chi-square of normal noise, more of noise in few frames.
    """
    shape, seeds = (16, 20), 300
    term = build(word, **({"dead": 0, "hot": 0, "blinking": 0} if word == "bad_pixels" else {}))
    effects = np.stack([effect(term, at(200, shape, seed)) for seed in range(seeds)])
    squares = np.mean(effects**2, axis=0)
    kurtosis = max(3.0, float(stats.kurtosis(effects, axis=None, fisher=False)))
    variance = term.variance(np.full(shape, LEVEL, np.float32), response(), at(200, shape), True)
    expected = np.broadcast_to(np.asarray(variance) / response().noise ** 2, shape)
    np.testing.assert_allclose(squares, expected, rtol=5.5 * np.sqrt((kurtosis - 1) / seeds))


@pytest.mark.parametrize("word", NOISES.kinds)
def test_temporal_variance_is_that_over_frames(word: str) -> None:
    """A kind with a long memory varies less within a sequence; slow drift counts as fixed."""
    shape, frames = (16, 20), range(100)
    fast = {"ar1": {"rho": 0.2}, "bad_pixels": {"blink_ratio": 10, "on_s": 0.05, "off_s": 0.05, "dead": 0.0}}
    term = build(word, **fast.get(word, {}))
    variance = term.variance(np.full(shape, LEVEL, np.float32), response(), at(9, shape), False)
    expected = np.mean(np.asarray(variance) / response().noise ** 2)
    found = [np.var([effect(term, at(k, shape, seed)) for k in frames], axis=0).mean() for seed in (1, 2, 3)]
    if word in BUILT_IN and word not in ("drift", "bad_pixels"):
        np.testing.assert_allclose(found, expected, rtol=0.05, atol=1e-9)
    elif expected:
        assert np.mean(found) < 1.3 * expected
        assert word not in BUILT_IN or np.mean(found) > 0.7 * expected


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_term_survives_its_dump(word: str) -> None:
    term = build(word, id="mine")
    assert NOISES.parse({"kind": word, **term.model_dump()}) == term


@pytest.mark.parametrize("word", sorted(set(BUILT_IN) - {"shot"}))
def test_wrong_sigmas_are_refused(word: str) -> None:
    key = next(iter(ZERO.get(word, {"ratio": 0})))
    for sigma in (-1001.0, 1001.0, float("nan"), "1"):
        with pytest.raises(PydanticCustomError):
            build(word, **{key: sigma})


def test_an_unknown_kind_lists_those_allowed() -> None:
    with pytest.raises(PydanticCustomError, match=r"unknown noise kind 'whit'; allowed: white.*did you mean 'white'"):
        NOISES.parse({"kind": "whit"})


# White noise of several terms is one draw


def test_white_terms_add_up_and_are_independent() -> None:
    """Together they have the sum of variances; between frames only the correlation of AR(1) is left."""
    terms = (White(ratio=1.5, id="white"), Noise3d(tvh=2.5, id="terms"), Ar1(ratio=2.0, rho=0.8, id="memory"))
    chain = SignalChain(response(), (*terms, Shot(id="shot")), 50.0, 1)
    correlated = (2.0 * response().noise / response().gain) ** 2
    seen = np.stack([chain.expose(light(SHAPE), index).ravel() for index in range(20, 24)])
    variance = chain.variance(light(SHAPE), 20).mean()
    np.testing.assert_allclose(seen.var(axis=1) / variance, 1, atol=4.5 * np.sqrt(2 / N))
    mean = chain.mean(light(SHAPE), 20).mean()
    np.testing.assert_allclose(seen.mean(axis=1) - mean, 0, atol=4.5 * np.sqrt(variance / N))
    found = np.asarray(np.corrcoef(seen))
    for one in range(4):
        for other in range(one):
            expected = correlated / variance * 0.8 ** (one - other)
            assert found[one, other] == pytest.approx(expected, abs=4.5 / np.sqrt(N))


def test_a_term_switched_off_leaves_the_other_numbers() -> None:
    """White noise of ratios 3 and 4 is, pixel by pixel, 5 times that of ratio 1; with electrons, too."""
    made = replace(response(), noise=3e5, gain=1e3)

    def seen(*terms: Noise) -> Floats:
        chain = SignalChain(made, terms, 50.0, 1)
        return chain.expose(light(), 5) - chain.mean(light(), 5)

    both = seen(White(ratio=0.3, id="one"), Noise3d(tvh=0.4, id="terms"))
    np.testing.assert_allclose(both, 5 * seen(Noise3d(tvh=0.1, id="other")), atol=3.1)
    np.testing.assert_allclose(seen(Shot(), White(ratio=0.5)), both, atol=3.1)


def test_white_terms_keep_their_variance_in_the_dark() -> None:
    """Below 200 electrons the electrons are Poisson numbers and the normal part is added to them."""
    dark = replace(response(), linear=0.0, root=0.0, zero=50.0, gain=1.0, offset=1000.0, noise=30.0, read=20.0)
    chain, nothing = SignalChain(dark, (Shot(), White()), 50.0, 1), np.zeros(SHAPE, np.float32)
    seen = chain.expose(nothing, 5)
    assert seen.mean() == pytest.approx(1050, abs=0.6)
    assert seen.var() / chain.variance(nothing, 5).mean() == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))


# Sigmas; a sample's variance has the standard error sigma² sqrt(2 / n)


def test_fixed_pattern_is_constant_and_has_its_sigmas() -> None:
    term = FixedPattern(pixel=0.5, column=2.0, row=1.0)
    pattern = term.fixed_pattern(at(0, (400, 500))).astype(np.float64)
    np.testing.assert_array_equal(pattern, term.fixed_pattern(at(77, (400, 500))))
    columns, rows = pattern.mean(axis=0), pattern.mean(axis=1)
    pixels = pattern - columns - rows[:, None] + pattern.mean()
    # A mean over a column of 400 pixels keeps 1/400 of the pixels' variance, one over a row 1/500.
    assert columns.var(ddof=1) == pytest.approx(2.0**2 + 0.5**2 / 400, rel=4.5 * np.sqrt(2 / 500))
    assert rows.var(ddof=1) == pytest.approx(1.0**2 + 0.5**2 / 500, rel=4.5 * np.sqrt(2 / 400))
    assert pixels.var() == pytest.approx(0.5**2 * (399 / 400) * (499 / 500), rel=4.5 * np.sqrt(2 / pattern.size))


def test_a_redrawn_pattern_changes_with_each_correction() -> None:
    def pattern(term: FixedPattern, number: int) -> Floats:
        return term.fixed_pattern(replace(at(700), corrections=number, last_correction=500 * number))

    first, second = (pattern(FixedPattern(redrawn=True), number) for number in (0, 1))
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3
    assert second.std() == pytest.approx(first.std(), rel=0.15)
    np.testing.assert_array_equal(pattern(FixedPattern(), 0), pattern(FixedPattern(), 1))


def test_odd_and_even_lines_differ() -> None:
    for along in ("rows", "columns"):
        done = effect(OddEven.model_validate({"ratio": 4.0, "along": along}), at(0))
        lines = done if along == "rows" else done.T
        np.testing.assert_allclose(lines[::2], 4, atol=1e-3)
        np.testing.assert_allclose(lines[1::2], -4, atol=1e-3)


# 3-D noise

TERMS = {"t": 0.7, "v": 1.1, "h": 0.6, "tv": 0.9, "th": 0.5, "vh": 1.3, "tvh": 2.0}


@pytest.mark.parametrize("term", TERMS)
def test_each_3d_term_has_its_sigma_along_its_axes_only(term: str) -> None:
    """The mean square of n numbers over its expectation is a chi-square of n degrees of freedom."""
    noise_3d = Noise3d.model_validate({**dict.fromkeys(TERMS, 0), term: TERMS[term]})
    cube = np.stack([effect(noise_3d, at(index, (20, 30))) for index in range(40)])
    for axis, name in enumerate("tvh"):
        assert (np.ptp(cube, axis=axis).max() > 0.01) == (name in term)
    count = math.prod({"t": 40, "v": 20, "h": 30}[name] for name in term)
    low, high = (stats.chi2.ppf(p, count) / count for p in (5e-4, 1 - 5e-4))
    assert low < (cube**2).mean() / TERMS[term] ** 2 < high
