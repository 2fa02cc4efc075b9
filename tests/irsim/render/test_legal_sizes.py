"""Largest sizes that a scenario may have: time and memory follow the frames that are drawn."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import irsim
from irsim.geometry import sprite
from irsim.motion.curves import Spline
from irsim.render import exposure
from irsim.types import Truth

SCENE = """
frames: {frames}
camera: {{size: [64, 48], smear: {{time_ms: 30}}, rate_hz: 30, motion: [{{kind: jitter}}]}}
background: {{kind: sky}}
targets:
- {{id: one, shape: {{kind: point, area_m2: 4}}, path: {{kind: {path}, start: [32, 24], {more}}}}}
"""


def peak_mb(work: Callable[[], Any]) -> float:
    """Return the largest memory that Python and numpy hold at once during the work, MB."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 2**20
    finally:
        tracemalloc.stop()


def frames_of(frames: int, path: str = "singer", more: str = "") -> list[tuple[np.ndarray, Truth | None]]:
    source = irsim.Rendering(irsim.loads(SCENE.format(frames=frames, path=path, more=more)))
    return [(frame.image, truth) for frame, truth in source.pairs()]


def assert_equal(one: list[tuple[np.ndarray, Truth | None]], other: list[tuple[np.ndarray, Truth | None]]) -> None:
    for (image, truth), (wanted, wanted_truth) in zip(one, other, strict=True):
        assert (image == wanted).all()
        assert truth == wanted_truth


def test_one_frame_of_many_takes_no_memory_for_all() -> None:
    source = irsim.Rendering(irsim.loads(SCENE.format(frames=1_000_000, path="straight", more="speed: 0")))
    assert peak_mb(lambda: source.frame(0)) < 60


def test_frames_do_not_depend_on_the_frames_computed_before(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = frames_of(21)
    monkeypatch.setattr(exposure, "FIRST_FRAMES", 4)
    monkeypatch.setattr("irsim.render.frame.FIRST_FRAMES", 4)
    assert_equal(frames_of(21), whole)


def test_a_streak_far_past_the_picture_takes_no_memory() -> None:
    assert peak_mb(lambda: frames_of(2, "straight", "speed: 20000, heading_deg: 45")) < 60


def test_a_streak_is_drawn_as_a_whole_one(monkeypatch: pytest.MonkeyPatch) -> None:
    more = "speed: 300, heading_deg: 40"
    short = frames_of(2, "straight", more)
    monkeypatch.setattr(sprite, "_MANY_PICTURES", 1000)
    assert_equal(short, frames_of(2, "straight", more))


def test_a_spline_of_many_points() -> None:
    knots = np.cumsum(np.random.default_rng(1).uniform(0.5, 2, 10_000))
    points = np.random.default_rng(2).normal(0, 10, (10_000, 2))
    at = np.linspace(knots[0], knots[-1], 5001)
    wanted = CubicSpline(knots, points, bc_type="natural")(at)
    assert np.abs(Spline(knots, points).at(at) - wanted).max() < 1e-9
    assert peak_mb(lambda: Spline(knots, points)) < 10


def test_frames_that_double_again_and_again_are_refused() -> None:
    faults = ", ".join(f"{{kind: duplicate, id: d{k}, rate: 1}}" for k in range(80))
    text = SCENE.format(frames=100, path="straight", more="speed: 1").replace("motion:", f"faults: [{faults}], motion:")
    with pytest.raises(irsim.InputError, match="more than 20000000 frames arrive"):
        irsim.loads(text)
