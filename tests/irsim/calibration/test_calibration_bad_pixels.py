"""Dead, hot and blinking pixels are found, light and texture are not, and good pixels replace bad ones."""

from __future__ import annotations

import numpy as np
import pytest
from calibration_clips import noise_frames, rendered
from scipy.special import ndtr

from irsim.calibration import find_bad_pixels
from irsim.calibration.bad_pixel_figures import bad_pixel_figures
from irsim.calibration.bad_pixels import patch, unstable_pixels
from irsim.types import Bools, Floats

SHAPE = (60, 64, 80)
SCENE = """\
frames: 60
camera:
  size: [160, 128]
  psf_px: 0.5
  bits: 14
  noise: [{kind: white}, {kind: bad_pixels, dead: 0.002, hot: 0.002, blinking: 0.002, cluster: 1.0}]
background: {kind: ground, spread_k: 0.5}
targets:
  - id: a
    shape: {kind: point, area_m2: 0.02, temperature_k: 700}
    path: {kind: straight, start: [20.3, 60.2], speed: 1.3, heading_deg: 10, range_m: 2000}
"""


def telegraph(rng: np.random.Generator, count: int, on: float, off: float) -> Bools:
    """Return states over time of a pixel with exponential dwell times of these means, frames."""
    state = np.zeros(count, np.bool_)
    high = rng.random() < on / (on + off)
    for k in range(count):
        state[k] = high
        if rng.random() < 1 / (on if high else off):
            high = not high
    return state


def masks(found: Bools) -> set[tuple[int, int]]:
    return {(int(row), int(column)) for row, column in np.argwhere(found)}


def test_each_kind_is_found_where_it_is() -> None:
    frames = noise_frames(1, SHAPE, tvh=2.0, v=8.0, h=8.0, vh=1.0).round()
    frames[:, 10, 10] += 200
    frames[:, 30, 0] += 200
    frames[:, 50, 70] = 0
    frames[:, 20, 40] = frames[0, 20, 40]
    frames[15:40, 40, 20] += 60
    found = find_bad_pixels(frames.astype(np.uint16))
    assert masks(found.hot) == {(10, 10), (30, 0)}
    assert masks(found.dead) == {(50, 70), (20, 40)}
    assert masks(found.blinking) == {(40, 20)}
    assert found.judged.all()


def test_noise_alone_has_no_bad_pixels() -> None:
    assert not find_bad_pixels(noise_frames(1, (30, 128, 160), tvh=2.0, vh=1.0)).all.any()


def spot(row: float, column: float, sigma: float) -> Floats:
    """Return a unit point of light, integrated over pixels."""
    down, across = (np.diff(ndtr((np.arange(n + 1) - 0.5 - at) / sigma)) for n, at in ((64, row), (80, column)))
    return np.asarray(np.outer(down, across))


def test_points_and_edges_of_light_are_no_bad_pixels() -> None:
    sigma = 0.5
    frames = noise_frames(2, SHAPE, tvh=2.0)
    frames += 3000 * spot(20.2, 50.4, sigma) + 500 * (np.arange(80) > 60)
    frames += 2000 * np.sin(np.arange(60) / 4)[:, None, None] * spot(40.0, 20.3, sigma)
    for k in range(60):
        frames[k] += 2000 * spot(20 + 0.7 * k, 5 + k, sigma)
    assert not find_bad_pixels(frames).all.any()


def test_frozen_pixels_need_enough_frames() -> None:
    rng = np.random.default_rng(1)
    frames = rng.normal(100, 0.6, (40, 48, 48)).round().astype(np.uint16)
    frames[:, 5, 5] = 100
    found = find_bad_pixels(frames)
    assert found.frozen_from is not None
    assert masks(found.dead) == ({(5, 5)} if found.frozen_from <= 40 else set())
    assert find_bad_pixels(rng.normal(100.0, 0.05, (40, 48, 48)).round().astype(np.uint16)).frozen_from is None


def test_saturated_pixels_are_not_judged() -> None:
    frames = noise_frames(1, SHAPE, tvh=2.0).round()
    frames[:, :, :20] = 4095
    found = find_bad_pixels(frames.astype(np.uint16), 4095)
    assert not found.judged[:, :18].any()
    assert not found.all.any()


def test_dwell_times_and_heights_lie_in_their_intervals() -> None:
    rng = np.random.default_rng(3)
    frames = noise_frames(3, (400, 64, 80), tvh=2.0)
    places = [(int(row), int(column)) for row in range(4, 62, 10) for column in range(4, 78, 12)]
    jumps = 30 + rng.exponential(40, len(places))
    for (row, column), jump in zip(places, jumps, strict=True):
        frames[:, row, column] += jump * telegraph(rng, 400, 8.0, 30.0)
    found = find_bad_pixels(frames)
    assert len(masks(found.blinking) & set(places)) >= 0.95 * len(places)
    figures = bad_pixel_figures(frames, np.ones(399), found)
    for measured, true in ((figures.on_frames, 8.0), (figures.off_frames, 30.0), (figures.jump, float(jumps.mean()))):
        assert measured is not None
        assert measured.low <= true <= measured.high
    assert figures.blinking.low <= len(places) / (64 * 80) <= figures.blinking.high
    assert (figures.dead.value, figures.hot_height, figures.dead_level) == (0, None, None)


def test_bad_pixels_of_a_rendered_camera() -> None:
    """A passing target adds none, and those in a mask of targets are left out."""
    found, planted = find_bad_pixels(rendered(SCENE)), 0.002 * 160 * 128
    for mask in (found.dead, found.hot):
        assert 0.56 * planted <= mask.sum() <= 1.5 * planted
    assert 0.3 * planted <= found.blinking.sum() <= 1.5 * planted
    taken = np.zeros((128, 160), np.bool_)
    taken[:64] = True
    assert found.without(taken).all.sum() == found.all[64:].sum()


def test_a_good_pixel_replaces_a_bad_one_at_the_level_of_its_lines() -> None:
    frames = noise_frames(4, (40, 48, 48), tvh=1.0, h=20.0)
    bad = np.zeros((48, 48), np.bool_)
    bad[10:12, 20] = bad[30, 0] = True
    frames[:, bad] = 0
    whole = patch(frames, bad)
    columns = np.median(frames[:, :9], axis=(0, 1))
    assert whole[:, 10, 20].mean() == pytest.approx(columns[20], abs=2)
    assert whole[:, 30, 0].mean() == pytest.approx(columns[0], abs=2)
    np.testing.assert_array_equal(whole[:, ~bad], frames[:, ~bad])
    assert patch(frames, np.zeros_like(bad)) is frames
    counts = frames.clip(0).round().astype(np.uint16)
    assert patch(counts, bad).dtype == np.uint16


def test_faintly_blinking_pixels_are_left_out_of_flat_noise() -> None:
    frames = noise_frames(5, (60, 48, 48), tvh=2.0)
    frames[::7, 20, 20] += 15
    assert masks(unstable_pixels(frames)) == {(20, 20)}
    assert not unstable_pixels(noise_frames(6, (60, 48, 48), tvh=2.0)).any()
