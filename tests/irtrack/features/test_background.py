"""Background model, its registration, and the foreground before it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from textures import counts, texture

from irtrack.features.background import BackgroundModel
from irtrack.features.foreground import local_foreground, peaks

CORNER = (slice(0, 1), slice(0, 1))


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (0.4, -0.3), (-5.0, 2.6)], ids=str)
def test_shift_and_gain_of_the_camera_are_found(dx: float, dy: float) -> None:
    ground = texture(1)
    matrix = np.array([[1, 0, dx], [0, 1, dy]])
    moved = cv2.warpAffine(ground, matrix, ground.shape[::-1], flags=cv2.INTER_CUBIC)
    inner = (slice(15, -15), slice(15, -15))
    first, second = counts(ground)[inner], counts(10 + 0.9 * moved)[inner]
    model, frame = BackgroundModel.initial(first, CORNER).register(second, True)
    assert frame.moved == pytest.approx((dx, dy), abs=0.1)
    assert model.gain == pytest.approx(0.9, abs=0.03)
    assert max(abs(s) for s in frame.shift) <= 0.5  # the canvas goes along by whole pixels
    off = np.abs(frame.picture - frame.mean)[10:-10, 10:-10]
    assert np.median(off) < 1.5  # of ground of 25


def test_noise_alone_does_not_move_a_still_camera() -> None:
    rng = np.random.default_rng(2)
    first, second = (counts(100 + 6 * rng.standard_normal((120, 160))) for _ in range(2))
    _, frame = BackgroundModel.initial(first, CORNER).register(second, True)
    assert frame.moved == (0, 0)


def test_the_best_shift_of_noise_is_no_jump() -> None:
    """An even sky: 32 frames of noise, the model learned from up to three before."""
    rng = np.random.default_rng(5)
    even = np.zeros((96, 128), np.float32)
    for _ in range(8):
        model = BackgroundModel.initial(counts(50 + 3.5 * rng.standard_normal(even.shape)), CORNER)
        for _ in range(4):
            model, frame = model.register(counts(50 + 3.5 * rng.standard_normal(even.shape)), True)
            assert max(map(abs, frame.moved)) < 1.1
            model = model.updated(frame, even, 0.1, None)


def test_the_model_is_a_running_mean() -> None:
    """1 / (n + 1) until that is below the rate: 100, then 103 and 106 at rates 1/2 and 1/3 make 103."""
    target = (slice(10, 14), slice(10, 14))
    model = BackgroundModel.initial(np.full((30, 40), 100, np.uint8), target)
    none = np.zeros((30, 40), np.float32)
    for grey in (103, 106):
        _, frame = model.register(np.full((30, 40), grey, np.uint8), False)
        model = model.updated(frame, none, 0.1, target)
    assert model.mean[0, 0] == pytest.approx(103)
    assert np.all(model.mean[target] == pytest.approx(100))  # filled from its edge, and not updated
    _, frame = model.register(np.full((30, 40), 106, np.uint8), False)
    assert frame.known[0, 0]
    assert not frame.known[target].any()
    # The first observation of a pixel is its mean.
    assert model.updated(frame, none, 0.1, None).mean[12, 12] == pytest.approx(106)


def test_a_peak_lies_between_pixels() -> None:
    y, x = np.mgrid[:40, :50]
    at = (20.3, 15.8)
    sure = np.clip(4 - np.hypot(x - at[0], y - at[1]), 0, 1).astype(np.float32)
    centers, heights = peaks(local_foreground(0.5 + sure / 2, (2.0, 2.0)), (2, 2), 0.05, 10)
    assert centers == pytest.approx(np.array([at]), abs=0.1)
    assert 0.5 < heights[0] < 1
    assert len(peaks(local_foreground(np.full((40, 50), 0.5, np.float32), (2.0, 2.0)), (2, 2), 0.05, 10)[0]) == 0
