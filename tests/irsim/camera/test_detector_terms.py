"""Noise terms one by one: 3-D noise, drift, bad pixels, odd and even lines, lines and levels with memory."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import even_noise
import numpy as np
import pytest
from scipy import ndimage, stats

from irsim.camera.ar1 import Ar1, State
from irsim.camera.bad_pixels import BadPixels, TelegraphProcess, clustered_pixels
from irsim.camera.drift import Drift, DriftProcess
from irsim.camera.noise import Noise3d, OddEven
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.types import Floats

SHAPE = (120, 160)
RATE_HZ = 30.0
LEVEL = 2e6


def at(index: int, shape: tuple[int, int] = SHAPE, seed: int = 1) -> FrameContext:
    return FrameContext(index, shape, RATE_HZ, seed)


def response() -> Response:
    return ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))


def effect(noise: Noise, frame_context: FrameContext, level: float = LEVEL) -> Floats:
    return even_noise.effect(noise, frame_context, response(), level)


# 3-D noise

TERMS = {"t": 0.7, "v": 1.1, "h": 0.6, "tv": 0.9, "th": 0.5, "vh": 1.3, "tvh": 2.0}


def mean_squares(cube: Floats) -> dict[str, float]:
    """Mean squares of the seven effects of a crossed layout frames x rows x columns (Scheffe 1959, ch. 4)."""
    sizes = dict(zip("tvh", cube.shape, strict=True))
    axes = {"t": 0, "v": 1, "h": 2}

    def mean_over(names: str) -> Floats:
        return np.asarray(cube.mean(axis=tuple(axes[name] for name in names), keepdims=True))

    found = {}
    for term in TERMS:
        effect_of = np.zeros((1, 1, 1))
        for count in range(len(term) + 1):
            for part in itertools.combinations(term, count):
                others = "".join(name for name in "tvh" if name not in part)
                effect_of = effect_of + (-1) ** (len(term) - count) * mean_over(others)
        freedom = math.prod(sizes[name] - 1 for name in term)
        repeats = math.prod(sizes[name] for name in "tvh" if name not in term)
        found[term] = float((effect_of**2).sum()) * repeats / freedom
    return found


def expected_squares(sizes: dict[str, int]) -> dict[str, float]:
    """Of the effect of a term: the variances of all terms that hold it, each times its repeats."""
    return {
        term: sum(
            sigma**2 * math.prod(sizes[name] for name in "tvh" if name not in other)
            for other, sigma in TERMS.items()
            if set(term) <= set(other)
        )
        for term in TERMS
    }


def test_seven_terms_have_the_seven_sigmas() -> None:
    """Each mean square over its expectation is a chi-square of its degrees of freedom, within 99.9 %."""
    shape, frames = (64, 80), 60
    noise = Noise3d.model_validate(TERMS)
    cube = np.stack([effect(noise, at(index, shape)) for index in range(frames)])
    sizes = {"t": frames, "v": shape[0], "h": shape[1]}
    expected = expected_squares(sizes)
    for term, square in mean_squares(cube).items():
        freedom = math.prod(sizes[name] - 1 for name in term)
        low, high = (stats.chi2.ppf(p, freedom) / freedom for p in (5e-4, 1 - 5e-4))
        assert low < square / expected[term] < high, term


@pytest.mark.parametrize("term", TERMS)
def test_each_term_alone_varies_along_its_own_axes_only(term: str) -> None:
    noise = Noise3d.model_validate({**dict.fromkeys(TERMS, 0), term: 1.0})
    cube = np.stack([effect(noise, at(index, (20, 30))) for index in range(8)])
    for axis, name in enumerate("tvh"):
        assert (np.ptp(cube, axis=axis).max() > 0.01) == (name in term)


# Lines and levels with memory


@pytest.mark.parametrize(("over", "shape"), [("row", (400, 1)), ("column", (1, 300)), ("frame", (1, 1))])
def test_lines_and_levels_may_have_memory(over: str, shape: tuple[int, int]) -> None:
    noise = Ar1.model_validate({"over": over, "rho": 0.8, "ratio": 3.0})
    moments = [at(index, (400, 300)) for index in range(4000)]
    moments = moments if over == "frame" else moments[:60]
    patterns = np.stack([even_noise.pattern(noise, at(each.index, shape)) for each in moments])
    count = patterns.size * 0.2 / 1.8  # independent draws in AR(1): (1 - rho) / (1 + rho)
    assert patterns.var() == pytest.approx(9, rel=6 * math.sqrt(2 / count))
    lag = (patterns[1:] * patterns[:-1]).mean() / patterns.var()
    assert lag == pytest.approx(0.8, abs=6 * math.sqrt((1 - 0.64) / patterns.size))
    assert effect(noise, moments[3]).shape == (400, 300)


# Odd and even


@pytest.mark.parametrize("along", ["rows", "columns"])
def test_odd_and_even_lines_stand_apart(along: str) -> None:
    done = effect(OddEven.model_validate({"ratio": 4.0, "along": along}), at(0))
    even, odd = (done[::2], done[1::2]) if along == "rows" else (done[:, ::2], done[:, 1::2])
    np.testing.assert_allclose(even, 4, atol=1e-3)
    np.testing.assert_allclose(odd, -4, atol=1e-3)


# Drift

WANDERS = Drift(pixel=2.0, column=0.0, row=0.0, time_constant_s=10.0)
"""Decay 1/300 a frame."""


def drift_at(index: int, corrected: int = 0, noise: Drift = WANDERS) -> Floats:
    frame_context = replace(at(index), corrected=corrected, corrections=int(corrected > 0))
    return effect(noise, frame_context)


def test_drift_reverts_to_the_mean() -> None:
    """From age a to b the deviation shrinks by exp(-(b - a) / 300) on average, and gains the rest anew."""
    n = SHAPE[0] * SHAPE[1]
    for first, second in ((100, 160), (255, 257), (700, 1100)):
        before, after = drift_at(first), drift_at(second)
        kept = math.exp(-(second - first) / 300)
        slope = (before * after).sum() / (before**2).sum()
        spread = math.sqrt((1 - kept**2) * 4 / (before**2).sum())
        assert slope == pytest.approx(kept, abs=4.5 * spread + 1e-3)
        gained = after - kept * before
        assert gained.var() == pytest.approx(4 * (1 - kept**2), rel=4.5 * math.sqrt(2 / n) + 0.02)
        assert abs(np.corrcoef(gained.ravel(), before.ravel())[0, 1]) < 4.5 / math.sqrt(n)


def test_drift_begins_anew_at_a_correction() -> None:
    assert not drift_at(500, corrected=500).any()
    grown = 4 * (1 - math.exp(-2 * 90 / 300))
    assert drift_at(590, corrected=500).var() == pytest.approx(grown, rel=0.05)
    assert drift_at(590).var() == pytest.approx(4 * (1 - math.exp(-2 * 590 / 300)), rel=0.05)


def test_drift_may_have_begun_before_the_first_frame() -> None:
    old = WANDERS.model_copy(update={"age_s": 20.0})
    assert drift_at(0, noise=old).var() == pytest.approx(4 * (1 - math.exp(-2 * 600 / 300)), rel=0.05)
    assert not drift_at(0).any()


def test_drift_that_forgets_at_once_is_white() -> None:
    """Also long after: what lies far between two frames has no correlation that a number could hold."""
    quick = Drift(pixel=2.0, column=0.0, row=0.0, time_constant_s=1e-4, id="quick")
    one, other = drift_at(999_999, noise=quick), drift_at(1_000_000, noise=quick)
    assert one.var() == pytest.approx(4, rel=0.05)
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 4.5 / math.sqrt(one.size)


def test_gain_drifts_in_proportion_to_the_light() -> None:
    noise = Drift(pixel=0, column=0, row=0, gain=0.01, time_constant_s=10.0, age_s=1000.0)
    weak, strong = effect(noise, at(5), 1e6), effect(noise, at(5), 4e6)
    np.testing.assert_allclose(strong, 4 * weak, atol=0.01)
    assert strong.std() * response().noise / 4e6 == pytest.approx(0.01, rel=0.03)


def test_variance_of_drifting_gains_is_that_of_many_pixels() -> None:
    """Of the light's part of the signal alone: dark current, half of the signal here, passes no gain. A time constant
    after the correction the square has grown to 1 - exp(-2)."""
    dark = ElectronSensor(dark_me_s=300.0).response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))
    noise = Drift(pixel=0.0, column=0.0, row=0.0, gain=0.01, time_constant_s=10.0, age_s=10.0)
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    camera, lit = SignalChain(dark, (noise,), RATE_HZ, 1), dark.at(float(light[0, 0])) - dark.zero
    assert lit == pytest.approx(dark.zero, rel=0.1)
    expected = (1 - math.exp(-2)) * (0.01 * lit / dark.gain) ** 2 + 1 / 12
    np.testing.assert_allclose(camera.variance(light, 0), expected, rtol=1e-5)
    assert camera.expose(light, 0).var() == pytest.approx(expected, rel=5 * math.sqrt(2 / light.size))
    np.testing.assert_allclose(camera.variance(light, 0, fixed=False), 1 / 12)


def test_drift_is_smooth_from_frame_to_frame() -> None:
    """No step anywhere is larger than the process takes: variance 2 (1 - rho) = 2/300 of 4 a frame, or less."""
    seen = np.stack([drift_at(index) for index in range(600, 700)])
    steps = np.diff(seen, axis=0).var(axis=(1, 2))
    assert steps.max() < 4 * 2 / 300 * 1.1


@pytest.mark.parametrize(
    "drift", [{"pixel": 2.0}, {"gain": 0.0005}, {"gain": 0.01}, {"pixel": 0.5, "gain": 0.002}, {"pixel": 0.01}]
)
def test_drift_leaps_by_less_than_noise_hides(drift: dict[str, Any]) -> None:
    """Wherever it leaps at all, of a frame of 3 million electrons: by a tenth of their shot noise at most, or by what
    it does from one frame to the next."""
    noise = Drift(**({"pixel": 0.0, "column": 0.0, "row": 0.0, "time_constant_s": 300.0, "age_s": 900.0} | drift))
    shot, decay = math.sqrt(3e6), 1 / (300.0 * RATE_HZ)
    own = math.hypot(noise.pixel * response().noise, noise.gain * 3e6)
    seen = [effect(noise, at(index), 3e6) * response().noise for index in range(64)]
    leaps = np.std(np.diff(seen, axis=0), axis=(1, 2))
    assert leaps.max() > 0
    assert leaps.max() < 1.1 * max(0.1 * max(shot, response().noise), own * math.sqrt(2 * decay))


@pytest.mark.parametrize(
    ("drift", "frames"),
    [
        (
            {"gain": 0.0005, "time_constant_s": 600.0},
            64,
        ),  # of slow ones 4 thousandths of the time constant, rounded down
        ({"time_constant_s": 120.0, "pixel": 2.5, "column": 0.7, "row": 0.5}, 2),
        ({"gain": 0.01, "time_constant_s": 600.0}, 1),
        ({"gain": 0.001, "pixel": 1.0, "time_constant_s": 900.0}, 32),
        ({"pixel": 0.0, "column": 0.0, "row": 0.0, "time_constant_s": 1e4}, 1024),
    ],
)
def test_drift_stays_for_as_many_frames_as_nobody_notices(drift: dict[str, Any], frames: int) -> None:
    noise = Drift(**drift)
    steps = [noise._course(at(index))[2] for index in range(4 * frames)]
    assert np.array_equal(np.unique(steps, return_counts=True)[1], 4 * [frames])


def test_drift_draws_each_step_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the way to the first of them, some 12 draws; 150 of 2 frames here."""
    drawn: list[int] = []

    def between(self: DriftProcess, before: State, after: State, index: int, distance: int) -> State:
        drawn.append(index)
        return midway(self, before, after, index, distance)

    midway = DriftProcess.between
    monkeypatch.setattr(DriftProcess, "between", between)
    fast = Drift(pixel=2.0, column=0.0, row=0.0, time_constant_s=100.0, id="counted")
    for index in range(700, 1000):
        drift_at(index, corrected=600, noise=fast)
    assert 140 <= len(drawn) < 150 + 12


# Bad pixels


@pytest.mark.parametrize("share", [0.0, 0.0005, 0.005, 0.05])
@pytest.mark.parametrize("cluster", [1.0, 3.0])
def test_bad_pixels_are_as_many_as_asked_for_and_in_the_frame(share: float, cluster: float) -> None:
    found = clustered_pixels((200, 300), share, cluster, 1, "bad", "dead")
    assert found.size == np.unique(found).size == round(share * 60_000)
    assert not found.size or (found.min() >= 0 and found.max() < 60_000)


def test_bad_pixels_lie_in_clusters_of_the_mean_size() -> None:
    """At a share where clusters seldom touch, their mean size by connected regions is the one asked for."""
    for cluster in (1.0, 2.0, 4.0):
        picture = np.zeros(1000 * 1000, bool)
        picture[clustered_pixels((1000, 1000), 0.002, cluster, 3, "bad", "hot")] = True
        regions = ndimage.label(picture.reshape(1000, 1000))[1]
        assert picture.sum() / regions == pytest.approx(cluster, rel=0.1)


def test_clusters_grow_along_rows_as_along_columns() -> None:
    """Bad pixels beside each other are as many as those below each other, within four sigmas of halves."""
    picture = np.zeros((1000, 1000), bool)
    picture.reshape(-1)[clustered_pixels((1000, 1000), 0.002, 4.0, 3, "bad", "hot")] = True
    beside = int((picture[:, 1:] & picture[:, :-1]).sum())
    below = int((picture[1:] & picture[:-1]).sum())
    assert abs(beside - below) < 4 * math.sqrt(beside + below)


def test_dead_pixels_stand_still_and_hot_ones_lie_high() -> None:
    noise = BadPixels(dead=0.01, hot=0.02, blinking=0, cluster=1, hot_ratio=50)
    done = effect(noise, at(0))
    dead = done == -LEVEL / response().noise
    assert dead.sum() == round(0.01 * dead.size)
    np.testing.assert_array_equal(effect(noise, at(0), 5e6) == -5e6 / response().noise, dead)
    hot = done[(done > 1) & ~dead]
    assert hot.size == pytest.approx(0.02 * done.size, rel=0.03)  # some are dead
    assert hot.min() >= 24.9
    assert hot.mean() == pytest.approx(50, rel=0.15)
    np.testing.assert_array_equal(done, effect(noise, at(400)))
    half = BadPixels(dead=0.01, hot=0, blinking=0, dead_level=0.5)
    made = response()
    counts = made.counts(np.full(SHAPE, LEVEL, np.float32))
    half.replace(counts, made, at(0))
    assert set(np.unique(counts)) == {round(LEVEL / made.gain), round(0.5 * (2**14 - 1))}


def test_blinking_pixels_jump_between_two_levels() -> None:
    noise = BadPixels(dead=0, hot=0, blinking=0.08, blink_ratio=10, on_s=0.4, off_s=1.2)
    seen = np.stack([effect(noise, at(index, (60, 80))).ravel() for index in range(1000)])
    moving = np.flatnonzero(np.ptp(seen, axis=0) > 0)
    assert moving.size == pytest.approx(0.08 * 60 * 80, rel=0.02)
    on = seen[:, moving] != 0
    assert on.mean() == pytest.approx(0.25, abs=0.01)
    heights = np.abs(seen[:, moving]).max(axis=0)
    assert heights.mean() == pytest.approx(10, rel=5 / math.sqrt(moving.size))
    for column in seen[:, moving[:20]].T:
        assert np.unique(column).size == 2


def test_variance_about_the_mean_holds_what_bad_pixels_lie_off() -> None:
    """Hot pixels their height's square, exactly; blinking ones, whose mean is off too, that in their time on."""
    shape, frames = (60, 80), 1000
    level = np.full(shape, LEVEL, np.float32)
    hot = BadPixels(dead=0, hot=0.05, blinking=0)
    seen = effect(hot, at(3, shape))
    expected = hot.variance(level, response(), at(3, shape), True) / response().noise ** 2
    np.testing.assert_allclose(seen**2, expected, rtol=1e-3, atol=1e-3)
    assert not np.any(hot.variance(level, response(), at(3, shape), False))

    blinking = BadPixels(dead=0, hot=0, blinking=0.08, blink_ratio=10, on_s=0.1, off_s=0.3)
    squares = np.mean([effect(blinking, at(index, shape)) ** 2 for index in range(frames)], axis=0)
    expected = np.asarray(blinking.variance(level, response(), at(3, shape), True)) / response().noise ** 2
    np.testing.assert_array_equal(squares > 0, expected > 0)
    assert (squares[expected > 0] / expected[expected > 0]).mean() == pytest.approx(1, abs=0.03)


def test_a_telegraph_has_exponential_stays_and_no_seam() -> None:
    """P(on at k + d | on at k) = p + (1 - p) exp(-d (1/on + 1/off)), wherever k stands; stays of mean 12 and 36."""
    chain = TelegraphProcess(12.0, 36.0, 20_000, (1, "noise", "bad", "telegraph"))
    states = np.stack([chain.frame(index) for index in range(560)])
    decay, share = 1 / 12 + 1 / 36, 0.25
    assert chain.ends.period == 4, "blocks of 32 frames"
    for start in (0, 3, 31, 32, 63, 64, 100, 127, 128, 255, 256, 500):
        for lag in (1, 2, 7, 20):
            now, later = states[start], states[start + lag]
            assert now.mean() == pytest.approx(share, abs=4.5 * math.sqrt(share * (1 - share) / 20_000))
            expected = share + (1 - share) * math.exp(-decay * lag)
            assert later[now].mean() == pytest.approx(expected, abs=4.5 * 0.5 / math.sqrt(now.sum())), (start, lag)
    for index in (559, 130, 7):
        alone = TelegraphProcess(12.0, 36.0, 20_000, (1, "noise", "bad", "telegraph")).frame(index)
        np.testing.assert_array_equal(alone, states[index])
    # The chain has no memory but the frame before: what it does next does not depend on how long it was on.
    on = states[200] & states[201]
    long, short = on & states[199], on & ~states[199]
    difference = states[202][long].mean() - states[202][short].mean()
    assert abs(difference) < 4.5 * 0.5 * math.sqrt(1 / long.sum() + 1 / short.sum())
