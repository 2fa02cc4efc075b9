"""Which level of a blinking pixel is its own: that of the pixels around it, if most say so."""

from __future__ import annotations

import numpy as np
import pytest
from intervals import held

import irsim
from irsim.measure import Measured, measure_figures
from irsim.measure.own_level import high_is_away
from irsim.measure.telegraph import telegraph
from irsim.measure.two_levels import two_levels
from irsim.types import Floats

SEEDS = range(4)
EVEN, TEXTURED = "{kind: ground, spread_k: 0}", "{kind: ground, spread_k: 3}"


def times_s(on: float, off: float, seed: int, pattern: float, background: str, share: float) -> list[Measured]:
    """Mean times away from their own level and on it of pixels that jump by 30 NETD."""
    scene = f"""
    frames: 160
    seed: {seed}
    camera:
      size: [96, 80]
      rate_hz: 30
      noise:
        - {{kind: white}}
        - {{kind: fixed_pattern, pixel: {pattern}, row: {pattern}, column: {pattern}}}
        - {{kind: bad_pixels, dead: 0, hot: 0, blinking: {share}, cluster: 1, blink_ratio: 30,
           on_s: {on}, off_s: {off}}}
    background: {background}
    """
    frames = np.stack([frame.image for frame, _ in irsim.frames(irsim.loads(scene))])
    flaws = measure_figures(frames, 30.0, passing=False).flaws
    assert flaws.on_frames is not None
    assert flaws.off_frames is not None
    return [each.map(lambda periods: periods / 30) for each in (flaws.on_frames, flaws.off_frames)]


@pytest.mark.sampled
@pytest.mark.parametrize(("on", "off"), [(0.5, 0.1), (0.1, 0.5), (0.3, 0.3)])
@pytest.mark.parametrize("pattern", [pytest.param(0.0, marks=pytest.mark.slow), 2.0])
def test_times_away_may_be_the_longer_ones(on: float, off: float, pattern: float) -> None:
    """The shorter was said to be on."""
    told = [times_s(on, off, seed, pattern, EVEN, 0.01) for seed in SEEDS]
    for found, true in zip(zip(*told, strict=True), (on, off), strict=True):
        held(list(found), true)
        assert np.median([each.value for each in found]) == pytest.approx(true, rel=0.15)
    if on != off:
        assert max(each.high / each.low for both in told for each in both) < 2


@pytest.mark.sampled
@pytest.mark.parametrize(("on", "off"), [(0.5, 0.1), (0.1, 0.5)])
def test_texture_does_not_turn_them(on: float, off: float) -> None:
    """Where it hides which level is their own, either interval holds both."""
    told = [times_s(on, off, seed, 0.3, TEXTURED, 0.01) for seed in SEEDS]
    for found, true in zip(zip(*told, strict=True), (on, off), strict=True):
        assert all(each.low < true * 1.15 and each.high > true / 1.15 for each in found)


def test_a_few_do_not_tell() -> None:
    for both in (times_s(0.5, 0.1, seed, 0.3, EVEN, 0.0006) for seed in SEEDS):  # five
        assert both[0].value < both[1].value
        assert (both[0].low, both[0].high) == (both[1].low, both[1].high)
        assert both[0].low < 0.13
        assert both[0].high > 0.4


def telling(seed: int, right: float, pixels: int) -> float:
    """The mean time on that is told of pixels that are on for 20 of 25 frames, with so many of them told rightly."""
    rng = np.random.default_rng(seed)
    high = rng.random((100, pixels)) < 0.8
    turned = rng.random(pixels) < 0.5
    told = np.where(turned, -1.0, 1.0) * np.where(rng.random(pixels) < right, 1, -1)
    found = telegraph(high ^ turned, np.ones(99), told)
    assert found is not None
    return found.on.value / found.off.value


def test_a_vote_by_chance_is_none() -> None:
    assert all(telling(seed, 0.9, 60) > 1 for seed in range(20))
    assert all(telling(seed, 0.1, 60) < 1 for seed in range(20))
    assert sum(telling(seed, 0.5, 60) > 1 for seed in range(60)) <= 4  # 1 in 160 each: more are 1 in 10^4


@pytest.mark.parametrize("odd", [0.0, 300.0])
def test_what_stands_beside_is_compared_on_its_own_column(odd: float) -> None:
    frames: Floats = np.random.default_rng(1).normal(1000, 1, (60, 40, 41)) + odd * (np.arange(41) % 2)
    places = np.zeros((40, 41), np.bool_)
    places[[5, 12, 30], [6, 21, 33]] = True
    frames[10:20, places] += [100, -100, 100]
    frames[20:, 30, 33] += 100
    frames[:10, 0, 0] += 3
    told = high_is_away(frames.mean(axis=0), places, two_levels(frames[:, places]))
    assert told.tolist() == [1, -1, 1]
    near = np.zeros_like(places)
    near[0, 0] = True
    rough = 5 * np.random.default_rng(2).standard_normal((40, 41))
    assert not high_is_away(frames.mean(axis=0) + rough, near, two_levels((frames + rough)[:, near])).any()
