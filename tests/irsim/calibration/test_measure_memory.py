"""What noise is made of in time: white noise, AR(1) noise and a random walk, told apart by their cosines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from intervals import held

from irsim.measure.cosines import Cosines
from irsim.measure.interval import exactly
from irsim.measure.memory import Memory, temporal, time_freedom
from irsim.measure.mixture import Mixture, fit_mixture, parts_at
from irsim.rng import stream
from irsim.types import Floats, Indices

SIDE = 32
GAPS = np.array([0, 1, 2, 3, 5, 6, 7, 8, 9, 13, 14, 15, 16, 17, 18, 19, 22, 23, 24, 25, 26, 27, 30, 31])


def drawn(seed: int, times: int, white: float, correlated: float, frames: float, walk: float) -> Floats:
    """(times, 32, 32) of fixed pattern, white noise, AR(1) noise that lasts for `frames`, and a walk; variances."""
    random = stream(seed, "noise")
    shape = (SIDE, SIDE)
    rho = math.exp(-1 / frames)
    lasting, walked = random.normal(0, math.sqrt(correlated), shape), random.normal(100, 5, shape)
    found = np.empty((times, *shape))
    for frame in found:
        frame[:] = lasting + walked + random.normal(0, math.sqrt(white), shape)
        lasting = rho * lasting + random.normal(0, math.sqrt(correlated * (1 - rho**2)), shape)
        walked = walked + random.normal(0, math.sqrt(walk), shape)
    return found


@pytest.mark.parametrize("number", [np.arange(40), GAPS], ids=["each", "gaps"])
def test_what_modes_hold_is_the_diagonal_of_their_covariance(number: Indices) -> None:
    cosines = Cosines.of(number)
    apart = np.abs(np.subtract.outer(number, number))
    for decay in (0.01, 0.3):
        whole = cosines.basis @ np.exp(-decay * apart) @ cosines.basis.T
        np.testing.assert_allclose(cosines.remembered(decay), np.diag(whole), rtol=1e-9)
    walk = cosines.basis @ np.minimum.outer(number, number) @ cosines.basis.T
    np.testing.assert_allclose(cosines.walked(), np.diag(walk), rtol=1e-9)
    np.testing.assert_allclose(cosines.basis[1:] @ np.ones(len(number)), 0, atol=1e-12)
    for decay in (0.01, 0.3):
        left = np.exp(-decay * number)
        whole = cosines.basis @ (np.exp(-decay * apart) - np.outer(left, left)) @ cosines.basis.T
        np.testing.assert_allclose(cosines.grown(decay), np.diag(whole), rtol=1e-7, atol=1e-9)
    whole = cosines.basis @ np.ones_like(apart) @ cosines.basis.T
    np.testing.assert_allclose(cosines.fixed(), np.diag(whole), atol=1e-12)


@pytest.mark.parametrize("number", [np.arange(40), GAPS + 5], ids=["each", "gaps"])
def test_the_constant_mode_holds_the_frames_times_the_variance_of_their_mean(number: Indices) -> None:
    ages, apart = number - number[0], np.abs(np.subtract.outer(number, number))
    lasting = np.exp(-0.1 * apart)
    grown = lasting - np.exp(-0.1 * np.add.outer(ages, ages))
    covariances = (np.eye(len(number)), lasting, grown, np.minimum.outer(ages, ages), np.ones_like(apart))
    (found,) = parts_at(math.log(0.1), Cosines.of(number).constant)
    np.testing.assert_allclose(found / len(number), [each.mean() for each in covariances], rtol=1e-12)


@pytest.mark.parametrize("number", [np.arange(40), GAPS + 5], ids=["each", "gaps"])
@pytest.mark.parametrize("rho", [0.0, 0.9, 0.998])
def test_freedom_is_that_of_the_centred_correlation_matrix(number: Indices, rho: float) -> None:
    sigmas = {name: exactly(1.0) for name in ("white", "time_constant_s", "walk", "left", "fixed")}
    memory = Memory(**sigmas, correlated=exactly(3.0), total=exactly(10**0.5), rho=exactly(rho), age_s=math.inf)
    count = len(number)
    centring = np.eye(count) - 1 / count
    matrix = 0.9 * rho ** np.abs(np.subtract.outer(number, number)) + 0.1 * np.eye(count)
    centred = centring @ matrix @ centring
    expected = np.trace(centred) ** 2 / np.trace(centred @ centred)
    assert time_freedom(memory, number) == pytest.approx(expected, rel=1e-10)


def test_many_modes_are_put_together_by_their_means() -> None:
    number = np.arange(700)
    cosines = Cosines.of(number)
    assert cosines.sizes.sum() == 700
    assert len(cosines.sizes) < 200
    values = stream(1, "values").normal(size=(700, 3))
    each = np.square(cosines.basis @ values)
    last = slice(cosines.starts[-1], None)
    np.testing.assert_allclose(cosines.squares(values)[-1], each[last].mean(axis=0))
    whole = np.diag(cosines.basis @ np.exp(-0.2 * np.abs(np.subtract.outer(number, number))) @ cosines.basis.T)
    assert cosines.remembered(0.2)[-1] == pytest.approx(whole[last].mean())


def mixed(white: float, correlated: float, frames: float, walk: float, freedom: float = 1000.0) -> Mixture:
    """Of modes whose mean squares are what they are expected to be, in blocks that differ by chance about them."""
    cosines = Cosines.of(np.arange(120))
    expected = white * cosines.white() + correlated * cosines.remembered(1 / frames) + walk * cosines.walked()
    expected += 4 * cosines.fixed()
    blocks = stream(3, "blocks").chisquare(freedom / 36, (36, len(expected))) / (freedom / 36)
    return fit_mixture(expected * blocks / blocks.mean(axis=0), freedom, cosines)


@pytest.mark.parametrize("walk", [0.0, 0.02])
def test_modes_give_what_they_were_mixed_of(walk: float) -> None:
    best = mixed(0.5, 2.0, 10.0, walk).best
    white, lasting, grown, walked, _ = best.variances
    assert (white, lasting + grown, walked) == pytest.approx((0.5, 2.0, walk), rel=2e-3, abs=1e-9)
    assert math.exp(-best.log_decay) == pytest.approx(10, rel=2e-3)


def test_intervals_shrink_with_the_root_of_what_was_seen() -> None:
    few, many = (mixed(0.5, 2.0, 10.0, 0.02, freedom).measured(lambda v, _: v[0]) for freedom in (500.0, 8000.0))
    assert (few.high - few.low) / (many.high - many.low) == pytest.approx(4, rel=0.25)


def test_a_walk_alone_is_none_that_is_forgotten() -> None:
    """Nobody can tell it from memory that is longer than any that is looked for."""
    found = mixed(0.5, 0.0, 10.0, 0.02)
    assert found.slowest
    assert found.walks
    assert found.best.variances == pytest.approx((0.5, 0, 0, 0.02, 4), rel=0.01)


def test_noise_that_was_always_there_has_no_age() -> None:
    """Whatever it forgets in, 1 to 8 frames; of 40 recordings one may be unlikely to have been."""
    ages = [
        memory.age_s
        for frames in (1.0, 2.0, 4.0, 8.0)
        for seed in range(10)
        if (memory := temporal(drawn(seed, 60, 0.36, 0.64, frames, 0.0), 25.0).memory) is not None
    ]
    assert len(ages) == 40
    assert sum(math.isfinite(age) for age in ages) <= 6


def test_a_strong_fixed_pattern_hides_no_walk() -> None:
    """Of 1e-4 a frame beside a pattern of 1e4 in variance: what modes hold of both differs by 10^8 and more."""
    cosines = Cosines.of(np.arange(600))
    expected = cosines.white() + 1e-4 * cosines.walked() + 1e4 * cosines.fixed()
    walks = []
    for seed in range(20):
        blocks = stream(seed, "blocks").chisquare(30 * cosines.sizes, (36, len(expected))) / (30 * cosines.sizes)
        walks.append(fit_mixture(expected * blocks, 1080, cosines).measured(lambda variances, _: variances[3]))
    held(walks, 1e-4)


def test_memory_is_the_same_in_any_unit() -> None:
    frames = drawn(0, 60, 0.36, 0.64, 12.0, 0.0)
    found, small = temporal(frames, 25.0), temporal(1e-9 * frames, 25.0)
    assert [r.value for r in small.correlation] == pytest.approx([r.value for r in found.correlation], rel=1e-3)
    assert found.memory is not None
    assert small.memory is not None
    assert small.memory.correlated.value == pytest.approx(1e-9 * found.memory.correlated.value, rel=1e-3)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("times", "walk"),
    [
        *((40, 0.0), (40, 0.01), (120, 0.01)),
        *(pytest.param(*each, marks=pytest.mark.slow) for each in ((120, 0.0), (300, 0.01))),
    ],
)
def test_what_noise_is_made_of_lies_in_its_intervals(times: int, walk: float) -> None:
    truth = {"white": 0.6, "correlated": 0.8, "total": 1, "rho": math.exp(-1 / 12), "fixed": 5}
    truth["walk"] = math.sqrt(walk * 25)
    found = [temporal(drawn(seed, times, 0.36, 0.64, 12.0, walk), 25.0).memory for seed in range(30)]
    for name, true in truth.items():
        held([getattr(memory, name) for memory in found], true)
