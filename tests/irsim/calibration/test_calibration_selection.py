"""Noise is measured in a flat, still window; motion, scene and smoothed noise are distinguished."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from calibration_clips import noise_frames
from recording_fakes import Noise

from irsim.calibration import flattest, measure_noise
from irsim.calibration.motion import motion, scene_slides, scene_terms
from irsim.calibration.selection import may_be_pictures, parse_region, read_frames, scenario_keys, target_mask
from irsim.errors import InputError


@dataclass(frozen=True)
class WithText(Noise):
    """Random pictures of 8 bits with a scenario text."""

    count: int = 16
    size: tuple[int, int] = (64, 48)
    bits: int = 8
    has_truth: bool = False
    text: str = ""

    @property
    def scenario_text(self) -> str:
        return self.text


def test_scenario_keys() -> None:
    assert scenario_keys(WithText(text="like: cloud\nframes: 3")) == {"like": "cloud", "frames": 3}
    assert scenario_keys(WithText(text="- 1")) == scenario_keys(Noise()) == {}
    assert not may_be_pictures(WithText(text="background: {kind: sky}"))
    assert may_be_pictures(WithText(text="background: {kind: recording}"))
    with pytest.raises(InputError, match="noise:1:"):
        scenario_keys(WithText(text="a: [1"))


def test_the_flattest_window_avoids_texture_targets_and_clipped_counts() -> None:
    frames = noise_frames(1, (20, 96, 128), tvh=2.0, v=10.0, h=10.0)
    frames[:, :, :48] += 50 * np.sin(np.arange(48) / 3)
    region = flattest(frames, 65535.0)
    assert region.x >= 40
    taken = np.zeros((96, 128), np.bool_)
    taken[:, 90:] = True
    region = flattest(frames, 65535.0, taken)
    assert not taken[region.rows, region.columns].any()
    counts = frames.round().astype(np.uint16)
    counts[:, :, 80:] = 1023
    region = flattest(counts, 1023.0)
    assert region.x + region.w <= 88


def test_a_window_with_motion_is_not_selected() -> None:
    frames = noise_frames(1, (40, 96, 128), tvh=5.0)
    frames[:, :, :64] += 4 * np.sin(np.arange(64)[None, None, :] / 4 + np.arange(40)[:, None, None])
    report = measure_noise(frames, 30.0)
    assert report.region.x >= 56
    assert not report.together


def test_smoothed_noise_is_no_motion() -> None:
    rng = np.random.default_rng(1)
    smoothed = [cv2.GaussianBlur(rng.normal(0, 10, (64, 64)), (0, 0), 0.8) for _ in range(40)]
    frames = np.stack(smoothed).astype(np.float64)
    found = motion(frames)
    assert found.together
    assert not found.moving
    assert not motion(rng.normal(0, 10, (40, 64, 64))).together


def test_scene_and_fixed_pattern() -> None:
    rng = np.random.default_rng(1)
    assert scene_terms(rng.normal(0, 1, (64, 64)) + rng.normal(0, 1, (64, 1)) + rng.normal(0, 1, 64)) == ()
    assert scene_terms(rng.normal(0, 1, (64, 64)) + np.linspace(0, 3, 64)[:, None]) == ("v",)
    blurred = np.asarray(cv2.GaussianBlur(rng.normal(0, 9, (64, 64)), (0, 0), 1), np.float64)
    assert scene_terms(blurred) == ("v", "h", "vh")


@pytest.mark.parametrize(("speed", "slides"), [(0.0, False), (0.05, True), (1.7, True)])
def test_a_sliding_scene_is_seen(speed: float, slides: bool) -> None:
    rng = np.random.default_rng(2)
    wide = cv2.GaussianBlur(rng.normal(0, 40, (96, 200)), (0, 0), 2)
    shifts = (np.array([[1, 0, -speed * k], [0, 1, 0]], np.float32) for k in range(40))
    frames = np.stack([cv2.warpAffine(wide, shift, (200, 96))[:, 100 : 100 + 96] for shift in shifts])
    assert scene_slides(frames + rng.normal(0, 1, frames.shape)) == slides


def test_a_crossing_target_is_no_sliding_scene() -> None:
    rows, columns = np.mgrid[:90, :90]
    frames = noise_frames(1, (20, 90, 90), tvh=2.0) + 40 * np.sin(rows / 7) * np.cos(columns / 9)
    for k in range(20):
        frames[k, 40:50, 3 * k : 3 * k + 12] += 300
    assert not scene_slides(frames)


def test_regions_and_frames_out_of_range_are_one_clear_error() -> None:
    assert parse_region("1, 2,8,9", (64, 48)) == (1, 2, 8, 9)
    for text, message in (("1,2,3", "is no region"), ("a,1,9,9", "is no region"), ("60,0,9,9", "does not fit")):
        with pytest.raises(InputError, match=f"{message}; allowed: x,y,w,h in whole px inside 64x48"):
            parse_region(text, (64, 48))
    with pytest.raises(InputError, match=r"noise: there are no frames 9:9; allowed: one or more of its 7"):
        read_frames(Noise(), range(9, 9))


def test_target_boxes_are_masked_with_a_margin() -> None:
    mask = target_mask(Noise(), 0, 7)
    assert mask is not None
    assert mask[7, 10]
    assert mask[7, 10 + 8]
    assert not mask[22, 30]
    assert target_mask(Noise(has_truth=False), 0, 7) is None
