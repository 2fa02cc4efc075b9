"""Hu's moments against OpenCV, and the search by histogram and moments."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from tracker_scenes import blob, follow

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.features.moments import USED, hu, invariants_around, log_hu, moment_likeness
from irtrack.features.window import Window
from irtrack.registry.table import make


def test_invariants_equal_opencv() -> None:
    rng = np.random.default_rng(1)
    for shape in ((10, 14), (7, 7), (40, 28)):
        pixels = rng.random(shape) ** 3 * 100
        theirs = cv2.HuMoments(cv2.moments(pixels.astype(np.float32)))[:USED, 0]
        np.testing.assert_allclose(hu(pixels), theirs, rtol=1e-4, atol=1e-9)


def test_map_of_invariants_equals_single_windows() -> None:
    """Windows partly and wholly outside the frame too; a scaled pattern keeps its invariants."""
    rng = np.random.default_rng(2)
    image = rng.integers(0, 255, (30, 40), np.uint8)
    window = Window(9, 7, (0.0, 0.0))
    found = invariants_around(image, window, (2, 1), 4, 100.0, 1.0)
    padded = np.zeros((60, 70))
    padded[15:45, 15:55] = np.maximum(image.astype(float) - 100, 0)
    for dy, dx in ((0, 0), (4, 4), (8, 3)):
        y, x = 15 + 1 - 4 + dy, 15 + 2 - 4 + dx
        np.testing.assert_allclose(found[dy, dx], log_hu(padded[y : y + 7, x : x + 9]), rtol=1e-9)
    assert np.isfinite(invariants_around(image, window, (500, 500), 2, 0.0, 1.0)).all()
    y, x = np.mgrid[-20:21, -20:21]
    small, large = (np.exp(-(x**2) / (2 * s * s) - y**2 / (2 * (0.6 * s) ** 2)) for s in (3.0, 5.0))
    assert moment_likeness(log_hu(large)[:2], log_hu(small)[:2]) > 0.9


def test_moments_tell_apart_what_histograms_do_not() -> None:
    """Two pairs of spots, opposite and at right angles, have one kernel histogram; the search starts midway."""
    y, x = np.mgrid[:60, :80]

    def pair(cx: float, offsets: tuple[tuple[int, int], ...]) -> np.ndarray:
        spots: np.ndarray = np.sum([np.exp(-((x - cx - a) ** 2 + (y - 30 - b) ** 2) / 3) for a, b in offsets], axis=0)
        return spots

    target, other = pair(33, ((4, 0), (-4, 0))), pair(46, ((4, 0), (0, 4)))
    right = dict.fromkeys(("both", "histogram"), 0)
    for seed in range(12):
        noise = np.random.default_rng(seed).standard_normal((2, *x.shape))
        frames = [
            Frame(np.clip(np.rint(60 + 120 * picture + 2 * n), 0, 255).astype(np.uint8), k, k / 30, 8)
            for k, (picture, n) in enumerate(zip((target, target + other), noise, strict=True))
        ]
        for cues in right:
            tracker = make("histogram_moments", {"cues": cues, "shift": False})
            state = tracker.init(frames[0], Box(33, 30, 13, 13), stream(0, 0))
            _, found = tracker.step(replace(state, center=np.array([39.5, 30])), frames[1], stream(0, 1))
            right[cues] += abs(found.center[0] - 33) < 2
    assert right["both"] >= 11
    assert right["histogram"] <= 9


def test_finds_its_target_again_after_a_step_beyond_mean_shift() -> None:
    """A step of 8 px on each axis: the exhaustive search reaches it, mean shift alone does not overlap it."""
    scene = blob(4, count=6, speed=0.0)
    frames = [
        Frame(np.roll(f.image, (8 * (k > 2), 8 * (k > 2)), (0, 1)), k, f.time, 8) for k, (f, _) in enumerate(scene)
    ]
    x, y = scene[0][1]
    ends = [follow(make("histogram_moments", {"reach": reach}), frames, Box(x, y, 8, 6))[-1].center for reach in (0, 8)]
    assert np.hypot(ends[1][0] - x - 8, ends[1][1] - y - 8) < 1.5
