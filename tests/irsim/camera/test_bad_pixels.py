"""Dead, hot and blinking pixels, their clusters and their telegraph signals."""

from __future__ import annotations

import math

import even_noise
import numpy as np
import pytest
from scipy import ndimage

from irsim.camera.bad_pixels import BadPixels, TelegraphProcess, clustered_pixels
from irsim.camera.noise_base import FrameContext
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.types import Floats

SHAPE = (120, 160)
LEVEL = 2e6


def at(index: int, shape: tuple[int, int] = SHAPE) -> FrameContext:
    return FrameContext(index, shape, 30.0, 1)


def response() -> Response:
    return ElectronSensor().response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))


def effect(noise: BadPixels, frame: FrameContext, level: float = LEVEL) -> Floats:
    return even_noise.effect(noise, frame, response(), level)


@pytest.mark.parametrize(("share", "cluster"), [(0.0, 1.0), (0.0005, 3.0), (0.05, 3.0)])
def test_the_number_of_bad_pixels_is_exact(share: float, cluster: float) -> None:
    found = clustered_pixels((200, 300), share, cluster, 1, "bad", "dead")
    assert found.size == np.unique(found).size == round(share * 60_000)
    assert not found.size or (found.min() >= 0 and found.max() < 60_000)


@pytest.mark.parametrize("cluster", [1.0, 4.0])
def test_clusters_have_their_mean_size_and_no_direction(cluster: float) -> None:
    """At a share where clusters seldom touch; neighbours in rows as many as in columns, within four sigmas."""
    picture = np.zeros((1000, 1000), bool)
    picture.reshape(-1)[clustered_pixels((1000, 1000), 0.002, cluster, 3, "bad", "hot")] = True
    assert picture.sum() / ndimage.label(picture)[1] == pytest.approx(cluster, rel=0.1)
    beside = int((picture[:, 1:] & picture[:, :-1]).sum())
    below = int((picture[1:] & picture[:-1]).sum())
    assert abs(beside - below) <= 4 * math.sqrt(beside + below)


def test_dead_pixels_do_not_respond_and_hot_ones_are_high() -> None:
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
    half.replace_counts(counts, made, at(0))
    assert set(np.unique(counts)) == {round(LEVEL / made.gain), round(0.5 * (2**14 - 1))}


def test_blinking_pixels_have_two_levels() -> None:
    noise = BadPixels(dead=0, hot=0, blinking=0.2, blink_ratio=10, on_s=0.1, off_s=0.3)
    seen = np.stack([effect(noise, at(index, (40, 60))).ravel() for index in range(300)])
    moving = np.flatnonzero(np.ptp(seen, axis=0) > 0)
    assert moving.size == pytest.approx(0.2 * 40 * 60, rel=0.02)
    assert (seen[:, moving] != 0).mean() == pytest.approx(0.25, abs=0.02)
    assert np.abs(seen[:, moving]).max(axis=0).mean() == pytest.approx(10, rel=5 / math.sqrt(moving.size))
    for column in seen[:, moving[:20]].T:
        assert np.unique(column).size == 2
    squares, level = (seen**2).mean(axis=0), np.full((40, 60), LEVEL, np.float32)
    expected = np.ravel(noise.variance(level, response(), at(3, (40, 60)), True)) / response().noise ** 2
    assert (squares[moving] / expected[moving]).mean() == pytest.approx(1, abs=0.1)


def test_variance_of_hot_pixels_is_their_height_squared() -> None:
    level, hot = np.full(SHAPE, LEVEL, np.float32), BadPixels(dead=0, hot=0.05, blinking=0)
    expected = hot.variance(level, response(), at(3), True) / response().noise ** 2
    np.testing.assert_allclose(effect(hot, at(3)) ** 2, expected, rtol=1e-3, atol=1e-3)
    assert not np.any(hot.variance(level, response(), at(3), False))


def test_a_telegraph_signal_is_markov_without_a_seam() -> None:
    """P(on at k + d | on at k) = p + (1 - p) exp(-d (1/on + 1/off)) for any k; stays of mean 12 and 36 frames."""
    address = (1, "noise", "bad", "telegraph")
    chain = TelegraphProcess(12.0, 36.0, 20_000, address)
    states = np.stack([chain.frame(index) for index in range(280)])
    decay, share = 1 / 12 + 1 / 36, 0.25
    for start in (0, 31, 32, 127, 128, 255):
        for lag in (1, 7, 20):
            now, later = states[start], states[start + lag]
            assert now.mean() == pytest.approx(share, abs=4.5 * math.sqrt(share * (1 - share) / 20_000))
            expected = share + (1 - share) * math.exp(-decay * lag)
            assert later[now].mean() == pytest.approx(expected, abs=4.5 * 0.5 / math.sqrt(now.sum())), (start, lag)
    for index in (279, 130, 7):
        np.testing.assert_array_equal(TelegraphProcess(12.0, 36.0, 20_000, address).frame(index), states[index])
    # The next state does not depend on how long a pixel was on.
    on = states[200] & states[201]
    long, short = on & states[199], on & ~states[199]
    difference = states[202][long].mean() - states[202][short].mean()
    assert abs(difference) < 4.5 * 0.5 * math.sqrt(1 / long.sum() + 1 / short.sum())
