"""Optical flow of points, and sizes that follow the target by `optical_flow` and `camshift_kalman`."""

from __future__ import annotations

import numpy as np
import pytest
from tracker_scenes import follow

from irsim.types import Box, Frame
from irtrack.features.optical_flow import forward_backward, scale_change
from irtrack.trackers.camshift import CamShiftKalman
from irtrack.trackers.optical_flow import OpticalFlow


def texture(dx: float, dy: float) -> np.ndarray:
    """(60, 80) smooth waves, moved by (dx, dy) px."""
    y, x = np.mgrid[:60, :80]
    waves = np.sin((x - dx) / 3) + np.cos((y - dy) / 4) + np.sin((x - dx + y - dy) / 5)
    return np.asarray(np.rint(128 + 40 * waves), np.uint8)


def test_points_follow_the_picture_forward_and_back() -> None:
    points = np.array([[20.0, 20.0], [40.0, 30.0], [60.0, 41.5]])
    moved, errors = forward_backward(texture(0, 0), texture(2.3, -1.4), points, 9, 2)
    assert moved - points == pytest.approx(np.tile([2.3, -1.4], (3, 1)), abs=0.1)
    assert errors.max() < 0.1
    # A point whose neighbourhood changes does not return.
    other = texture(0, 0)
    other[20:, 30:] = np.random.default_rng(0).integers(0, 255, (40, 50))
    _, errors = forward_backward(texture(0, 0), other, np.array([[10.0, 8.0], [50.0, 40.0]]), 9, 2)
    assert errors[0] < 0.1
    assert errors[1] > 1


def test_scale_change_by_hand() -> None:
    """Distances 3, 4, 5 become 6, 8, 15: ratios 2, 2, 3, the median 2."""
    before = np.array([[0.0, 0], [3, 0], [0, 4]])
    assert scale_change(before, 2 * before) == 2
    assert scale_change(before, before + 7) == 1
    assert scale_change(before[:1], before[:1]) == 1


def growing(seed: int, rate: float) -> tuple[list[Frame], list[tuple[float, float, float, float]]]:
    """A hot body with a warm core that grows by `rate` a frame, and its boxes (cx, cy, w, h)."""
    rng = np.random.default_rng(seed)
    v, u = np.mgrid[:120, :160]
    frames, boxes = [], []
    for k in range(25):
        scale = (1 + rate) ** k
        cx, cy, w, h = 60 + 1.5 * k, 60.0, 16 * scale, 12 * scale
        rim = np.hypot((u - cx) / w, (v - cy) / h)
        body = 100 * np.clip((0.5 - rim) * w + 0.5, 0, 1) + 50 * np.exp(-(((u - cx) / w - 0.1) ** 2) * 30 - rim**2 * 20)
        image = np.clip(60 + body + 4 * rng.standard_normal(u.shape), 0, 255).astype(np.uint8)
        frames.append(Frame(image, k, k / 30, 8))
        boxes.append((cx, cy, w, h))
    return frames, boxes


@pytest.mark.parametrize("tracker", [CamShiftKalman(resize=0.5), OpticalFlow(scale=True)])
@pytest.mark.parametrize("rate", [0.015, -0.01])
def test_sizes_follow_the_target(tracker: CamShiftKalman | OpticalFlow, rate: float) -> None:
    frames, boxes = growing(0, rate)
    last = follow(tracker, frames, Box(*boxes[0]))[-1]
    assert last.size == pytest.approx(boxes[-1][2:], rel=0.15)
    assert np.hypot(*np.subtract(last.center, boxes[-1][:2])) < 2


def test_camshift_predicts_through_occlusion() -> None:
    """A wider body as cold as the background crosses for six frames: the track goes on along its course."""
    frames, boxes = growing(0, 0.0)
    for k in range(12, 18):
        image = frames[k].image.copy()
        image[40:80, 50:120] = 60
        frames[k] = Frame(image, k, k / 30, 8)
    found = follow(CamShiftKalman(), frames, Box(*boxes[0]))
    assert all(estimate.status != "tracking" for estimate in found[12:17])
    assert np.hypot(*np.subtract(found[16].center, boxes[17][:2])) < 4
    assert found[-1].status == "tracking"
    assert np.hypot(*np.subtract(found[-1].center, boxes[-1][:2])) < 1.5


def test_flow_follows_a_target_that_deforms_unless_checked() -> None:
    """One pattern fades into another, which the first patch does not match; then the target turns back."""
    y, x = np.mgrid[:60, :120]
    frames = []
    for k in range(41):
        at, turn = 30 + 2 * (22 - abs(22 - k)), min(k / 15, np.pi / 2)
        u, v = x - at, y - 30
        pattern = np.cos(turn) * np.sin(u / 2) * np.sin(v / 2) + np.sin(turn) * np.cos(u / 2) * np.cos(v / 2)
        inside = np.hypot(u / 9, v / 7) < 1
        frames.append(Frame(np.rint(120 + 60 * pattern * inside).astype(np.uint8), k, k / 30, 8))
    free, checked = (follow(OpticalFlow(check=check), frames, Box(30, 30, 14, 10))[-1] for check in (False, True))
    assert np.hypot(*np.subtract(free.center, (38, 30))) < 1
    assert free.status != "tracking"
    assert np.hypot(*np.subtract(checked.center, (38, 30))) > 3
