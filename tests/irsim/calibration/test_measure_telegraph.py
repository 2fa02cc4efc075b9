"""Mean times of what goes to and fro between two levels are found, however seldom it is looked at."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import Measured, measure_figures
from irsim.measure.occupied import LEAST_LIKELY, log_occupied
from irsim.measure.telegraph import telegraph
from irsim.types import Bools, Floats


def seen(seed: int, on: float, off: float, times: Floats, pixels: int) -> Bools:
    """(T, pixels): half of them are high where they are on. Events as they come, not by the law that is fitted."""
    rng = np.random.default_rng(seed)
    drawn = np.empty((len(times), pixels), np.bool_)
    for pixel in range(pixels):
        begun = rng.random() < on / (on + off)
        count = 100 + int(4 * times[-1] / min(on, off))
        stays = rng.exponential(1, count) * np.where(np.arange(count) % 2 == begun, off, on)
        changes = np.searchsorted(np.cumsum(stays), times, side="right")
        drawn[:, pixel] = begun ^ (changes % 2 == 1)
    return drawn ^ (rng.random(pixels) < 0.5)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("on", "off", "widest"),
    [
        (0.5, 2.0, (0.65, 0.65)),
        (2.3, 4.4, (0.28, 0.28)),
        (3.0, 3.0, (0.32, 0.32)),
        (9.0, 18.0, (0.42, 0.42)),
        (20.0, 200.0, (1.1, 2.3)),
    ],
)
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_mean_times_lie_in_their_intervals(on: float, off: float, widest: tuple[float, float], lost: float) -> None:
    """Sampled runs are a third longer than 2.3 and 4.4, and pixels that stay for 200 hardly change in 200 frames."""
    found = []
    for seed in range(20):
        times = np.flatnonzero(np.random.default_rng(seed).random(200) >= lost).astype(float)
        told = telegraph(seen(seed, on, off, times, 30), np.diff(times))
        assert told is not None
        found.append(told)
    held([told.on for told in found], on, widest=widest[0])
    held([told.off for told in found], off, widest=widest[1])
    assert np.median([told.on.value for told in found]) == pytest.approx(on, rel=0.08)
    assert np.median([told.off.value for told in found]) == pytest.approx(off, rel=0.15)


@pytest.mark.parametrize(("on", "off", "widest"), [(20.0, 200.0, 1.3), (60.0, 60.0, 0.5)])
def test_how_many_stay_still_while_they_are_seen_is_told(on: float, off: float, widest: float) -> None:
    times = np.arange(60.0)
    told = []
    for seed in range(12):
        high = seen(seed, on, off, times, 400)
        found = telegraph(high, np.ones(59))
        assert found is not None
        shown = float((high[1:] != high[:-1]).any(axis=0).mean())
        told.append(Measured(found.seen.value / shown, found.seen.low / shown, found.seen.high / shown))
    held(told, 1.0, widest=widest)


def test_a_level_and_its_opposite_tell_the_same() -> None:
    high = seen(0, 3.0, 9.0, np.arange(100.0), 12)
    assert telegraph(high, np.ones(99)) == telegraph(~high, np.ones(99))


def test_what_never_changes_tells_nothing() -> None:
    assert telegraph(np.zeros((20, 3), np.bool_), np.ones(19)) is None
    assert telegraph(np.zeros((20, 0), np.bool_), np.ones(19)) is None


def blinking(seed: int) -> Floats:
    """Frames at 30 Hz whose bad pixels stay 2.4 frames on and 4.5 off."""
    scene = """
    frames: 200
    camera:
      size: [72, 64]
      netd_mk: 20
      noise:
        - {kind: white}
        - {kind: bad_pixels, dead: 0, hot: 0, blinking: 0.01, blink_ratio: 40, on_s: 0.08, off_s: 0.15}
    background: {kind: ground, spread_k: 0}
    """
    return np.stack([frame.image for frame, _ in irsim.frames(irsim.loads(scene, overrides=[f"seed={seed}"]))])


def times_of(frames: Floats, rate_hz: float, times: Floats | None = None) -> tuple[Measured, Measured]:
    flaws = measure_figures(frames, rate_hz, times=times, passing=False).flaws
    assert flaws.on_frames is not None
    assert flaws.off_frames is not None
    return flaws.on_frames, flaws.off_frames


def test_pixels_of_a_camera_blink_for_as_long_as_it_says() -> None:
    on, off = zip(*(times_of(blinking(seed), 30.0) for seed in range(6)), strict=True)
    held(list(on), 0.08 * 30, widest=0.2)
    held(list(off), 0.15 * 30, widest=0.2)


def test_times_are_in_frames_of_the_recording() -> None:
    """Of a camera that is a third as fast, and of one of whose frames three in ten were lost."""
    frames = blinking(3)
    plain = times_of(frames, 30.0)
    for found, known in zip(times_of(np.repeat(frames, 3, axis=0), 90.0), plain, strict=True):
        assert found.value == pytest.approx(3 * known.value, rel=0.001)
    kept = np.flatnonzero(np.random.default_rng(0).random(200) > 0.3)
    for found, known in zip(times_of(frames[kept], 30.0, kept / 30.0), plain, strict=True):
        assert found.value == pytest.approx(known.value, rel=0.15)


def test_how_likely_it_is_on_both_levels_so_often_is_the_sum_over_all_ways() -> None:
    passed, on, off = np.array([1.0, 1.0, 2.5, 1.0, 4.0]), 1.7, 3.2
    share = on / (on + off)
    kept = np.exp(-passed * (1 / on + 1 / off))
    often = np.zeros(7)
    for way in itertools.product((False, True), repeat=6):
        likely = share if way[0] else 1 - share
        for left, (before, after) in zip(kept, itertools.pairwise(way), strict=True):
            own = share if after else 1 - share
            likely *= own + (1 - own) * left if before == after else own * (1 - left)
        often[sum(way)] += likely
    asked = np.array([1, 2, 2, 2])
    wanted = np.log(1 - often[0] - often[6]) + 3 * np.log(often[2:5].sum())
    assert log_occupied(passed, asked, np.array([on]), np.array([off])) == pytest.approx([wanted])


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("on", "off", "frames", "most", "widest"), [(15, 60, 100, 0.3, (0.9, 1.0)), (3, 200, 300, 0.03, (0.6, 1.0))]
)
def test_times_of_pixels_that_are_found_where_they_are_long_enough_on_both_levels_lie_in_their_intervals(
    on: float, off: float, frames: int, most: float, widest: tuple[float, float]
) -> None:
    """As long as it takes for pixels of many heights; all that change taken alike, on came out too long."""
    found, alike = [], []
    for seed in range(16):
        high = seen(100 + seed, on, off, np.arange(float(frames)), 120)
        least = np.random.default_rng(seed).uniform(0, most, 120)
        share = high.mean(axis=0)
        there = np.minimum(share, 1 - share) >= least
        told = telegraph(high[:, there], np.ones(frames - 1), None, least[there])
        plain = telegraph(high[:, there], np.ones(frames - 1))
        assert told is not None
        assert plain is not None
        found.append(told)
        alike.append(plain)
    held([each.on for each in found], on, widest=widest[0])
    held([each.off for each in found], off, widest=widest[1])
    assert np.median([each.on.value for each in found]) == pytest.approx(on, rel=0.1)
    assert np.median([each.off.value for each in found]) == pytest.approx(off, rel=0.12)
    assert np.median([each.on.value for each in alike]) > 1.15 * on


def test_what_is_hardly_ever_found_is_not_made_likely_by_rounding() -> None:
    """On for a twentieth of a look every 900: nine of 60 looks come to 1e-30, rounded to 0 or below."""
    found = log_occupied(np.ones(59), np.array([9]), np.array([0.05]), np.array([900.0]))
    assert found == pytest.approx([np.log(LEAST_LIKELY)])
