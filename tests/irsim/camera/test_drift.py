"""Drift of offsets and gains, and the non-uniformity corrections that reset it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import even_noise
import numpy as np
import pytest

from irsim.camera.drift import Correction, Drift
from irsim.camera.noise_base import FrameContext
from irsim.camera.response import Response
from irsim.camera.sensor import ElectronSensor, SensorSettings
from irsim.camera.signal_chain import SignalChain
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.scenario.loader import loads
from irsim.types import Floats

SHAPE = (120, 160)
N = SHAPE[0] * SHAPE[1]
RATE_HZ = 30.0
PIXELS = Drift(pixel=2.0, column=0.0, row=0.0, time_constant_s=10.0)
"""Decay 1/300 a frame."""


def response(**fields: float) -> Response:
    return ElectronSensor.model_validate(fields).response(SensorSettings("mwir", 14, 40.0, (220.0, 400.0)))


def drift_at(index: int, corrected: int = 0, noise: Drift = PIXELS, level: float = 2e6) -> Floats:
    frame = FrameContext(index, SHAPE, RATE_HZ, 1)
    frame = replace(frame, last_correction=corrected, corrections=int(corrected > 0))
    return even_noise.effect(noise, frame, response(), level)


def test_drift_is_mean_reverting() -> None:
    """From frame a to b a deviation shrinks by exp(-(b - a) / 300) on average, and gains the rest anew."""
    for first, second in ((100, 160), (255, 257), (700, 1100)):
        before, after = drift_at(first), drift_at(second)
        kept = math.exp(-(second - first) / 300)
        slope = (before * after).sum() / (before**2).sum()
        sigma = math.sqrt((1 - kept**2) * 4 / (before**2).sum())
        assert slope == pytest.approx(kept, abs=4.5 * sigma + 1e-3)
        gained = after - kept * before
        assert gained.var() == pytest.approx(4 * (1 - kept**2), rel=4.5 * math.sqrt(2 / N) + 0.02)
        assert abs(np.corrcoef(gained.ravel(), before.ravel())[0, 1]) < 4.5 / math.sqrt(N)


def test_drift_starts_anew_at_a_correction() -> None:
    assert not drift_at(500, corrected=500).any()
    assert drift_at(590, corrected=500).var() == pytest.approx(4 * (1 - math.exp(-2 * 90 / 300)), rel=0.05)
    assert drift_at(590).var() == pytest.approx(4 * (1 - math.exp(-2 * 590 / 300)), rel=0.05)
    old = PIXELS.model_copy(update={"age_s": 20.0})
    assert drift_at(0, noise=old).var() == pytest.approx(4 * (1 - math.exp(-2 * 600 / 300)), rel=0.05)
    assert not drift_at(0).any()


def test_gain_drift_does_not_apply_to_dark_current() -> None:
    """Dark current is half of the signal; a time constant after a correction the square has grown to 1 - exp(-2)."""
    dark = response(dark_me_s=300.0)
    noise = Drift(pixel=0.0, column=0.0, row=0.0, gain=0.01, time_constant_s=10.0, age_s=10.0)
    light = np.full(SHAPE, radiance("mwir", 300.0), np.float32)
    chain, lit = SignalChain(dark, (noise,), RATE_HZ, 1), dark.at(float(light[0, 0])) - dark.zero
    assert lit == pytest.approx(dark.zero, rel=0.1)
    expected = (1 - math.exp(-2)) * (0.01 * lit / dark.gain) ** 2 + 1 / 12
    np.testing.assert_allclose(chain.variance(light, 0), expected, rtol=1e-5)
    assert chain.expose(light, 0).var() == pytest.approx(expected, rel=5 * math.sqrt(2 / light.size))
    np.testing.assert_allclose(chain.variance(light, 0, fixed=False), 1 / 12)


@pytest.mark.parametrize("keys", [{"pixel": 2.0}, {"pixel": 0.5, "gain": 0.002}])
def test_steps_of_drift_are_hidden_by_noise(keys: dict[str, Any]) -> None:
    """A tenth of the shot noise of 3 million electrons at most, or the process's own change in a frame."""
    noise = Drift(**({"pixel": 0.0, "column": 0.0, "row": 0.0, "time_constant_s": 300.0, "age_s": 900.0} | keys))
    shot, decay = math.sqrt(3e6), 1 / (300.0 * RATE_HZ)
    own = math.hypot(noise.pixel * response().noise, noise.gain * 3e6)
    seen = [drift_at(index, noise=noise, level=3e6) * response().noise for index in range(32)]
    steps = np.std(np.diff(seen, axis=0), axis=(1, 2))
    assert 0 < steps.max() < 1.1 * max(0.1 * max(shot, response().noise), own * math.sqrt(2 * decay))


# Corrections


def test_frames_of_corrections() -> None:
    correction = Correction(frames=(5, 20, 7), period_frames=10)
    assert [correction.last(index) for index in (0, 4, 5, 6, 7, 9, 10, 19, 20, 29, 30)] == [
        (0, 0), (0, 0), (5, 1), (5, 1), (7, 2), (7, 2), (10, 3), (10, 3), (20, 4), (20, 4), (30, 5),
    ]  # fmt: skip
    assert Correction().last(1000) == (0, 0)
    back_to_back = Correction(frames=(4, 6), freeze_frames=2)
    assert [back_to_back.shown(index) for index in range(9)] == [0, 1, 2, 3, 3, 3, 3, 3, 8]


def test_a_correction_freezes_the_picture_but_not_truth() -> None:
    text = """
frames: 20
camera: {size: [32, 24], correction: {frames: [6], period_frames: 13, freeze_frames: 3}}
background: {kind: sky}
targets: [{id: jet, shape: {kind: point, area_m2: 2}, path: {kind: straight, start: [3, 12], speed: 1}}]
"""
    scenario = loads(text)
    pairs = [Renderer(scenario).frame(index) for index in range(20)]
    for index, (frame, truth) in enumerate(pairs):
        shown = {6: 5, 7: 5, 8: 5, 13: 12, 14: 12, 15: 12}.get(index, index)
        np.testing.assert_array_equal(frame.image, pairs[shown][0].image)
        assert (frame.index, frame.time) == (index, index / 30)
        assert truth.targets[0].center[0] == pytest.approx(3 + index, abs=0.01)
    assert sum((a.image == b.image).all() for (a, _), (b, _) in pairwise(pairs)) == 6
    without = Renderer(loads(text, overrides=["without=[correction]"]))
    np.testing.assert_array_equal(without.frame(5)[0].image, pairs[5][0].image)
    assert (without.frame(6)[0].image != pairs[6][0].image).any()
