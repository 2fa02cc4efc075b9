"""`change_kalman` on a target that passes behind a bar."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from textures import counts, texture
from tracker_scenes import follow

from irsim.types import Box, Frame
from irtrack.registry.table import make


def hiding(seed: int, pan: float = 0.0) -> tuple[list[Frame], list[tuple[float, float]], list[bool]]:
    """A spot no brighter than its ground, hidden behind a bar for some frames; another beside it that is not."""
    wide = texture(seed, 120, 260)
    rng = np.random.default_rng([seed, 1])
    y, x = np.mgrid[:120, :160]
    frames, at, seen = [], [], []
    for k in range(60):
        left = pan * k
        picture = cv2.warpAffine(wide, np.array([[1.0, 0, -20 - left], [0, 1, 0]]), (160, 120), flags=cv2.INTER_CUBIC)
        cx, cy = 30 + 1.5 * k, 50.0
        for row in (cy, cy + 25):
            picture = np.where(np.hypot(x - cx + left, y - row) < 4.5, 135.0, picture)
        bar = (np.abs(x - 75 + left) < 10) & (np.abs(y - 50) < 9)
        picture = np.where(bar, 60.0, picture)
        frames.append(Frame(counts(picture + 2 * rng.standard_normal(picture.shape)), k, k / 30, 8))
        at.append((cx - left, cy))
        seen.append(abs(cx - 75) > 15)
    return frames, at, seen


@pytest.mark.parametrize("pan", [0.0, 0.7], ids=["still", "panned"])
def test_the_target_is_found_again_after_occlusion(pan: float) -> None:
    frames, at, seen = hiding(0, pan)
    estimates = follow(make("change_kalman"), frames, Box(*at[0], 9, 9))
    errors = np.hypot(*(np.array([e.center for e in estimates]) - at[1:]).T)
    assert errors[np.array(seen[1:])].max() < 3
    hidden = [e.status for e, (x, _) in zip(estimates, at[1:], strict=True) if abs(x - 75 + pan * 30) < 2]
    assert hidden
    assert "tracking" not in hidden[1:]


def test_a_panned_scene_needs_registration() -> None:
    frames, at, _ = hiding(0, 0.7)
    estimates = follow(make("change_kalman", {"register_frames": False}), frames, Box(*at[0], 9, 9))
    assert np.hypot(*np.subtract(estimates[-1].center, at[-1])) > 5
