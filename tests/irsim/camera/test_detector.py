"""Noise terms: the contract of every kind, and white and fixed ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any, Literal, cast, get_args, get_origin

import even_noise
import numpy as np
import pytest
from pydantic_core import PydanticCustomError

from irsim import rng
from irsim.camera import NOISES, ar1, bad_pixels, drift, noise_3d, process, shot, terms
from irsim.camera import response as response_module
from irsim.camera import temporal_sigma as grain
from irsim.camera.ar1 import Ar1
from irsim.camera.noise import FixedPattern, Noise3d, Shot, White
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.types import Floats

SHAPE = (256, 256)
RATE_HZ = 30.0
N = SHAPE[0] * SHAPE[1]

NEEDED: dict[str, dict[str, Any]] = {"ar1": {"rho": 0.9}, "bad_pixels": {"dead": 0.01, "hot": 0.01, "blinking": 0.05}}
"""What a kind cannot be built without, or does too little without."""

BENIGN: dict[str, dict[str, Any]] = {
    "fixed_pattern": {"pixel": 0, "column": 0, "row": 0},
    "noise_3d": {"tvh": 0},
    "drift": {"pixel": 0, "column": 0, "row": 0},
    "bad_pixels": {"dead": 0, "hot": 0, "blinking": 0},
}
"""What makes a kind silent, where it is not ratio: 0."""

ALWAYS = {"shot"}
"""Kinds without a silent value: light comes in grains."""

NO_DRAWS = {"odd_even"}
"""Kinds that are the same in all scenes."""


def at(index: int, shape: tuple[int, int] = SHAPE, seed: int = 1, rate_hz: float = RATE_HZ) -> FrameContext:
    return FrameContext(index, shape, rate_hz, seed)


def build(word: str, **fields: Any) -> Noise:
    found = NOISES.parse({"kind": word, **NEEDED.get(word, {}), **fields})
    assert isinstance(found, Noise)
    return found


@lru_cache
def response() -> Response:
    return ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))


LEVEL = 2e6
"""Electrons of every pixel before noise."""


def effect(noise: Noise, frame_context: FrameContext) -> Floats:
    return even_noise.effect(noise, frame_context, response(), LEVEL)


# Every kind of noise


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_noise_does_something_finite(word: str) -> None:
    done = effect(build(word), at(500, (24, 40)))
    assert np.isfinite(done).all()
    assert done.std() > 0.1


def ways() -> Iterator[tuple[str, dict[str, str]]]:
    """Each kind as it is, and with every other word that its keys may hold."""
    for word, kind in NOISES.kinds.items():
        yield word, {}
        for key, value in kind.model_fields.items():
            if get_origin(value.annotation) is Literal:
                yield from ((word, {key: other}) for other in get_args(value.annotation) if other != value.default)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_share_is_the_same_in_all_frames_where_it_says_so_and_only_there(word: str) -> None:
    noise, moments = build(word), [at(0), at(9), at(500, rate_hz=25.0), FrameContext(500, SHAPE, RATE_HZ, 1, 400, 2)]
    shares = {noise.share(frame_context, True) for frame_context in moments}
    assert (len(shares) == 1) == noise.stationary


@pytest.mark.parametrize(("word", "keys"), list(ways()))
@pytest.mark.parametrize("before", [True, False])
def test_every_way_of_a_noise_is_exposed_alike_by_compiled_loops_and_plain_ones(
    word: str, keys: dict[str, str], before: bool
) -> None:
    one, other = build(word, id="one", **keys), build("fixed_pattern", id="other")
    sensor = SignalChain(response(), (one, other) if before else (other, one), 50.0, 1)
    light = np.full((24, 40), radiance("mwir", 300.0), np.float32)
    found = sensor.expose(light, 5)
    assert np.ptp(found) > 0
    forget()
    with pytest.MonkeyPatch.context() as patch:
        for module in (rng, process, grain, shot, response_module):
            patch.setattr(module, "COMPILED", False)
        plain = SignalChain(response(), sensor.noises, 50.0, 1).expose(light, 5)
    assert np.abs(found.astype(int) - plain).max() <= 1
    assert (found == plain).mean() > 0.98


@pytest.mark.parametrize("counted", [False, True])
def test_noises_that_are_new_in_each_frame_add_up_and_share_nothing(counted: bool) -> None:
    """Drawn in one number, they have the variance of all; from frame to frame that of what has memory is left."""
    memory = Ar1(ratio=2.0, rho=0.8, id="memory")
    noises = (White(ratio=1.5, id="white"), Noise3d(tvh=2.5, id="terms"), memory)
    sensor = SignalChain(response(), (*noises, Shot(id="shot")) if counted else noises, 50.0, 1)
    light, lasting = (
        np.full(SHAPE, radiance("mwir", 300.0), np.float32),
        (2.0 * response().noise / response().gain) ** 2,
    )
    seen = np.stack([sensor.expose(light, index).ravel() for index in range(20, 24)])
    variance = sensor.variance(light, 20).mean()
    np.testing.assert_allclose(seen.var(axis=1) / variance, 1, atol=4.5 * np.sqrt(2 / N))
    np.testing.assert_allclose(seen.mean(axis=1) - sensor.mean(light, 20).mean(), 0, atol=4.5 * np.sqrt(variance / N))
    correlations = np.asarray(np.corrcoef(seen))
    for one in range(4):
        for other in range(one):
            assert correlations[one, other] == pytest.approx(
                lasting / variance * 0.8 ** (one - other), abs=4.5 / np.sqrt(N)
            )


def test_a_noise_of_any_name_shares_nothing_with_the_grain() -> None:
    """What lasts is drawn apart from it, also where it is called as the grain is."""
    sensor = SignalChain(response(), (Ar1(rho=0.9, id="white"), Noise3d()), 50.0, 1)
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    for index in range(4):
        seen = sensor.expose(light, index)
        assert seen.var() / sensor.variance(light, index).mean() == pytest.approx(1, abs=4.5 * np.sqrt(2 / N)), index


def test_electrons_are_counted_once() -> None:
    with pytest.raises(ValueError, match="at most"):
        SignalChain(response(), (Shot(id="one"), Shot(id="other")), 50.0, 1).expose(np.ones((4, 5), np.float32), 0)


@pytest.mark.parametrize("word", sorted(set(NOISES.kinds)))
def test_a_sensor_takes_pictures_of_any_size_and_frame_numbers_of_numpy(word: str) -> None:
    noise, level, number = build(word), radiance("mwir", 300.0), cast(int, np.int64(7))
    sensor = SignalChain(response(), (noise,), 50.0, 1)
    for rows, columns in ((10, 12), (20, 12), (20, 24)):
        light = np.full((rows, columns), level, np.float32)
        alone = SignalChain(response(), (noise,), 50.0, 1).expose(light, 7)
        np.testing.assert_array_equal(sensor.expose(light, number), alone)


def test_a_noise_that_is_switched_off_leaves_the_others_their_numbers() -> None:
    """White noise of ratio 3 and 4 is, pixel by pixel, 5 times what one of ratio 1 is; with electrons, too."""
    light, made = np.full((24, 40), radiance("mwir", 300.0), np.float32), replace(response(), noise=3e5, gain=1e3)

    def seen(*noises: Noise) -> Floats:
        sensor = SignalChain(made, noises, 50.0, 1)
        return sensor.expose(light, 5) - sensor.mean(light, 5)

    both = seen(White(ratio=0.3, id="one"), Noise3d(tvh=0.4, id="terms"))
    np.testing.assert_allclose(both, 5 * seen(Noise3d(tvh=0.1, id="other")), atol=3.1)
    np.testing.assert_allclose(seen(Shot(), White(ratio=0.5)), both, atol=3.1)


@pytest.mark.parametrize("word", ["white", "noise_3d", "ar1"])
def test_what_is_drawn_with_electrons_alone_or_with_others_keeps_its_variance_in_the_dark(word: str) -> None:
    """Below 200 electrons the number of electrons is a Poisson one: what is normal is drawn beside it."""
    dark = replace(response(), linear=0.0, root=0.0, zero=50.0)
    noise, light = build(word, id="one"), np.zeros(SHAPE, np.float32)
    sensor = SignalChain(replace(dark, gain=1.0, offset=1000.0, noise=30.0, read=20.0), (Shot(), noise), 50.0, 1)
    seen = sensor.expose(light, 5)
    assert seen.mean() == pytest.approx(1050, abs=0.6)
    assert seen.var() / sensor.variance(light, 5).mean() == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_picture_may_be_exposed_step_by_step(word: str) -> None:
    noises = [
        build(word, id="one"),
        build("fixed_pattern", id="other"),
        build("ar1" if word == "shot" else word, id="two"),
    ]
    sensor = SignalChain(response(), noises, 50.0, 1)
    light = np.full((24, 40), radiance("mwir", 300.0), np.float32)
    for steps in range(sensor.steps + 1):
        begun = sensor.step(light.copy(), 5, 0, steps, spent=True)
        before = begun.copy()
        np.testing.assert_array_equal(sensor.expose(begun, 5, steps=steps), sensor.expose(light, 5))
        np.testing.assert_array_equal(begun, before)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_frame_alone_is_the_frame_in_sequence(word: str) -> None:
    noise = build(word)
    frames = [0, 1, 2, 3, 127, 128, 255, 256, 257, 700]
    in_order = {index: effect(noise, at(index, (16, 20))) for index in range(701)}
    for order in (frames, frames[::-1], frames[::2] + frames[1::2]):
        for index in order:
            np.testing.assert_array_equal(effect(noise, at(index, (16, 20))), in_order[index])
    for index in frames:
        forget()
        np.testing.assert_array_equal(effect(noise, at(index, (16, 20))), in_order[index])


def forget() -> None:
    """As a new process: nothing kept from earlier frames."""
    for kept in (
        ar1._process,
        drift._process,
        drift._deviation,
        bad_pixels._telegraph,
        noise_3d._lines,
        terms.staying,
    ):
        kept.cache_clear()


@pytest.mark.parametrize("word", sorted(set(NOISES.kinds) - NO_DRAWS))
def test_seed_and_name_address_a_noise(word: str) -> None:
    """All but grain, which has the numbers of its frame."""
    noise, other = build(word), build(word, id="other")
    first, grainy = effect(noise, at(3000)), noise.grain(at(3000)) > 0 or noise.needs_electrons
    for second in (effect(noise, at(3000, seed=2)), effect(noise if grainy else other, at(2000 if grainy else 3000))):
        # 0.3: column and row terms are few numbers spread over many pixels.
        assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3
    np.testing.assert_array_equal(first, effect(build(word), at(3000)))


@pytest.mark.parametrize("word", sorted(set(NOISES.kinds) - ALWAYS))
def test_benign_values_are_silent(word: str) -> None:
    noise = build(word, **BENIGN.get(word, {"ratio": 0}))
    assert not effect(noise, at(3, (24, 40))).any()
    assert not np.any(noise.variance(np.full((24, 40), LEVEL, np.float32), response(), at(3, (24, 40)), True))


@pytest.mark.parametrize("word", NOISES.kinds)
def test_variance_is_that_of_the_noise_in_every_pixel(word: str) -> None:
    """Over 600 scenes, each pixel's mean square about the noiseless signal; chi-square: sd sqrt(2 / 600) of it."""
    shape, seeds = (16, 20), 600
    noise = build(word, **({"dead": 0, "hot": 0, "blinking": 0} if word == "bad_pixels" else {}))
    squares = np.mean([effect(noise, at(2000, shape, seed)) ** 2 for seed in range(seeds)], axis=0)
    variance = noise.variance(np.full(shape, LEVEL, np.float32), response(), at(2000, shape), True)
    expected = np.broadcast_to(np.asarray(variance) / response().noise ** 2, shape)
    np.testing.assert_allclose(squares, expected, rtol=5.5 * np.sqrt(2 / seeds))
    # The mean over pixels is surer where pixels are independent; rows, columns and drift leave 100s of draws.
    np.testing.assert_allclose(squares.mean(), expected.mean(), rtol=0.03)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_variance_without_what_stays_is_that_over_frames(word: str) -> None:
    shape, frames = (16, 20), 500
    noise = build(word, **({"rho": 0.2} if word == "ar1" else {}))
    kwargs = {"blink_ratio": 10, "on_s": 0.05, "off_s": 0.05, "dead": 0.0}
    if word == "bad_pixels":
        noise = build(word, **kwargs)
    seen = np.stack([effect(noise, at(index, shape)) for index in range(frames)])
    variance = noise.variance(np.full(shape, LEVEL, np.float32), response(), at(9, shape), False)
    expected = np.broadcast_to(np.asarray(variance) / response().noise ** 2, shape)
    if word == "drift":  # so slow that it stays
        assert not expected.any()
    else:
        np.testing.assert_allclose(seen.var(axis=0), expected, rtol=0.45, atol=1e-9)
        np.testing.assert_allclose(seen.var(axis=0).mean(), expected.mean(), rtol=0.05, atol=1e-9)


@pytest.mark.parametrize("word", NOISES.kinds)
def test_a_noise_survives_its_dump(word: str) -> None:
    noise = build(word, id="mine")
    assert NOISES.parse({"kind": word, **noise.model_dump()}) == noise


@pytest.mark.parametrize("word", sorted(set(NOISES.kinds) - ALWAYS))
@pytest.mark.parametrize("sigma", [-1001.0, 1001.0, float("nan"), "1"])
def test_a_sigma_that_cannot_be_is_refused(word: str, sigma: Any) -> None:
    field = next(iter(BENIGN.get(word, {"ratio": 0})))
    with pytest.raises(PydanticCustomError):
        build(word, **{field: sigma})


@pytest.mark.parametrize("word", sorted(set(NOISES.kinds) - ALWAYS - {"odd_even"}))
def test_a_sigma_below_0_is_refused_where_it_has_no_sign(word: str) -> None:
    field = next(iter(BENIGN.get(word, {"ratio": 0})))
    with pytest.raises(PydanticCustomError):
        build(word, **{field: -0.1})


def test_a_correction_that_redraws_leaves_another_pattern_of_the_same_size() -> None:
    noise = FixedPattern(redrawn=True)
    first, second = (noise.pattern(replace(at(700), corrections=number, corrected=500 * number)) for number in (0, 1))
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3
    assert second.std() == pytest.approx(first.std(), rel=0.15)
    stays = FixedPattern()
    np.testing.assert_array_equal(stays.pattern(at(3)), stays.pattern(replace(at(700), corrections=1)))


# Sigmas; a sample's variance has the standard error sigma^2 sqrt(2 / n)


def test_white_has_the_ratio_as_sigma_and_no_memory() -> None:
    first, second = (even_noise.pattern(White(ratio=2.5), at(index, SHAPE, 1)) for index in (0, 1))
    assert first.var() / 2.5**2 == pytest.approx(1, abs=4.5 * np.sqrt(2 / N))
    assert abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 4.5 / np.sqrt(N)


def test_fixed_pattern_stays_and_has_its_three_sigmas() -> None:
    noise = FixedPattern(pixel=0.5, column=2.0, row=1.0)
    pattern = noise.pattern(at(0, (400, 500), 1)).astype(np.float64)
    np.testing.assert_array_equal(pattern, noise.pattern(at(77, (400, 500), 1)))
    columns, rows = pattern.mean(axis=0), pattern.mean(axis=1)
    pixels = pattern - columns - rows[:, None] + pattern.mean()
    # A mean over a column of 400 pixels keeps 1/400 of the pixels' variance, one over a row 1/500.
    assert columns.var(ddof=1) == pytest.approx(2.0**2 + 0.5**2 / 400, rel=4.5 * np.sqrt(2 / 500))
    assert rows.var(ddof=1) == pytest.approx(1.0**2 + 0.5**2 / 500, rel=4.5 * np.sqrt(2 / 400))
    assert pixels.var() == pytest.approx(0.5**2 * (399 / 400) * (499 / 500), rel=4.5 * np.sqrt(2 / pattern.size))


def test_an_unknown_noise_says_what_is_allowed() -> None:
    with pytest.raises(PydanticCustomError, match=r"unknown noise kind 'whit'; allowed: white.*did you mean 'white'"):
        NOISES.parse({"kind": "whit"})
