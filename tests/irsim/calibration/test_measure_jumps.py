"""Frames that show something else, as a shutter or a splash screen, spoil no figures."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import pytest

import irsim
from irsim.measure.jumps import jumps
from irsim.types import Floats

FILMS = ["birds_crossing", "drone_treeline", "sky_airplane_cirrus"]
REAL = Path(__file__).resolve().parents[4] / "shared" / "real"

SCENE = """
frames: 60
seed: {seed}
camera: {{preset: {preset}, size: [96, 80]}}
background: {{kind: ground, spread_k: {spread_k}}}
"""


@lru_cache
def drawn(preset: str, spread_k: float) -> Floats:
    scenario = irsim.loads(SCENE.format(seed=1, preset=preset, spread_k=spread_k))
    return np.stack([frame.image for frame, _ in irsim.frames(scenario)])


def shut(frames: Floats, first: int, count: int, sigma: float) -> Floats:
    """Frames of which some show the inside of a shutter, with noise of so many counts."""
    rng = np.random.default_rng(0)
    shown = frames.copy()
    inside = frames.mean() + 200 + rng.normal(0, sigma, (count, *frames.shape[1:]))
    shown[first : first + count] = np.rint(inside)
    return shown


@pytest.mark.parametrize("preset", ["cooled_mwir", "uncooled_lwir"])
@pytest.mark.parametrize("spread_k", [0, 2])
@pytest.mark.parametrize("sigma", [0, 4])
@pytest.mark.parametrize(
    ("first", "count", "cuts"), [(0, 1, [1]), (0, 3, [3]), (40, 1, [40, 41]), (40, 3, [40, 43]), (59, 1, [59])]
)
def test_what_a_shutter_shows_is_another_picture(
    preset: str, spread_k: float, sigma: float, first: int, count: int, cuts: list[int]
) -> None:
    assert jumps(list(shut(drawn(preset, spread_k), first, count, sigma))) == cuts


@pytest.mark.sampled
@pytest.mark.parametrize(("preset", "spread_k", "sigma"), [("cooled_mwir", 0, 0), ("uncooled_lwir", 2, 4)])
@pytest.mark.parametrize(("first", "count", "used"), [(0, 3, (3, 60)), (40, 1, (0, 40)), (59, 1, (0, 59))])
def test_what_a_shutter_shows_is_left_out(
    preset: str, spread_k: float, sigma: float, first: int, count: int, used: tuple[int, int]
) -> None:
    frames = drawn(preset, spread_k)
    found = irsim.measure_noise(shut(frames, first, count, sigma), 30.0)
    assert (found.stretch.index[0], found.stretch.index[-1] + 1) == used
    assert found.terms == irsim.measure_noise(frames[slice(*used)], 30.0).terms
    (sentence,) = [text for text in found.stretch.left_out(10) if "another" in text]
    assert sentence.startswith("the picture becomes another at frame")
    assert sentence.endswith(
        f"figures are those of frames {10 + used[0]} to {9 + used[1]}, the longest stretch without such a break"
    )


@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")
@pytest.mark.parametrize("name", ["raw14_lwir", "raw14_mwir", "raw16_lepton"])
def test_no_recording_of_a_real_sensor_is_cut(name: str) -> None:
    with np.load(REAL / name / "frames.npz") as file:
        assert jumps(list(file[file.files[0]])) == []


def film(name: str) -> list[Floats]:
    video = cv2.VideoCapture(str(REAL / name / "frames.mp4"))
    frames: list[Floats] = []
    while (read := video.read())[0]:
        frames.append(read[1][..., 0].astype(np.float64))
    return frames


@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")
@pytest.mark.parametrize("name", FILMS)
def test_a_compressed_film_is_cut_where_another_begins_and_nowhere_else(name: str) -> None:
    frames = film(name)
    other = film(FILMS[FILMS.index(name) - 1])
    assert jumps(frames) == []
    assert jumps(frames[:60] + other[:40]) == [60]


@pytest.mark.sampled
@pytest.mark.parametrize("rho", [0.0, 0.9, 1.0])
def test_a_level_that_scatters_or_wanders_makes_no_jumps(rho: float) -> None:
    """White, remembering and walking levels, far above the noise of pixels, of 50 recordings each."""
    for seed in range(50):
        rng = np.random.default_rng(seed)
        level = rng.normal(0, 20, 300)
        for k in range(1, 300):
            level[k] += rho * level[k - 1]
        assert jumps(list(rng.normal(0, 1, (300, 16, 16)) + level[:, None, None])) == [], seed


def noise(count: int, side: int = 32) -> Floats:
    return np.random.default_rng(0).normal(0, 1, (count, side, side))


@pytest.mark.parametrize(("count", "cut"), [(29, True), (30, False)])
def test_lone_frames_are_how_the_scene_goes_on_where_they_are_a_tenth(count: int, cut: bool) -> None:
    """Of 300 frames; a fifth of the 299 changes is 59.8."""
    frames = noise(300)
    lone = 5 + 10 * np.arange(count)
    frames[lone] += 100
    assert jumps(list(frames)) == (sorted([*lone, *(lone + 1)]) if cut else [])


@pytest.mark.parametrize(("count", "lone"), [(12, 5), (12, 0), (9, 4), (6, 0)])
def test_one_frame_of_a_short_recording_is_told(count: int, lone: int) -> None:
    frames = noise(count)
    frames[lone] += 100
    assert jumps(list(frames)) == [k for k in (lone, lone + 1) if k]


def test_three_changes_of_nine_frames_are_too_many() -> None:
    frames = noise(9)
    frames[4] += 100
    frames[6:] += 100
    assert jumps(list(frames)) == []


@pytest.mark.parametrize(("count", "beyond"), [(301, 12.013), (31, 13.333), (11, 24.0)])
def test_a_change_is_a_jump_beyond_so_many_usual_ones(count: int, beyond: float) -> None:
    """A level that goes up and down by 1 in each frame, and once by more: 12 (1 + (10 / m)^2) of m changes."""
    level = np.arange(count) % 2.0
    frames = np.broadcast_to(level[:, None, None], (count, 16, 16)).copy()
    last = count - 1
    down_or_up = level[last] - level[last - 1]
    for share, found in ((0.98, []), (1.02, [last])):
        frames[last] = level[last - 1] + share * beyond * down_or_up
        assert jumps(list(frames)) == found, share


@pytest.mark.parametrize(("count", "unseen", "seen"), [(60, 1.3, 1.8), (12, 2.1, 3.5)])
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_a_level_that_is_off_is_seen_from_so_much_noise_on(count: int, unseen: float, seen: float, rho: float) -> None:
    """In temporal noise of a pixel, as it changes from frame to frame: 12 (1 + (10 / m)^2) 0.67 sqrt(2) / 8 = 1.5."""
    frames = noise(count, 64)
    for k in range(1, count):
        frames[k] += rho * frames[k - 1]
    pair = np.sqrt(np.square(np.diff(frames, axis=0)).mean() / 2)
    for level, found in ((unseen, []), (seen, [6, 7])):
        shown = frames.copy()
        shown[6] += level * pair
        assert jumps(list(shown)) == found, level


@pytest.mark.parametrize("unit", [1, 257])
def test_where_cells_stand_still_a_jump_is_beyond_five_changes_of_a_pixel(unit: int) -> None:
    """Noise of 0.2 counts, also where a film of 8 bits was spread over 16."""
    frames = np.rint(np.random.default_rng(0).normal(100, 0.2, (60, 64, 64)))
    for shift, found in ((4, []), (6, [30, 31]), (50, [30, 31])):
        shown = frames.copy()
        shown[30] += shift
        assert jumps(list((shown * unit).astype(np.uint16))) == found, shift


@pytest.mark.sampled
@pytest.mark.parametrize("count", [4, 6, 12])
def test_short_recordings_of_tiny_pictures_hold_no_jumps(count: int) -> None:
    """One cell, in 1,500 recordings each: a fixed 12 times the usual change found 27 in 3,000 of 4 frames; of 13 or 14
    by Poisson's law two or more are found but in 2 of 10^5 draws."""
    rng = np.random.default_rng(count)
    found = [seed for seed in range(1500) if jumps(list(rng.normal(1000, 4, (count, 12, 12))))]
    assert len(found) <= 1


def test_pictures_that_often_change_are_how_the_scene_goes_on() -> None:
    """Every fifth frame is exposed for longer."""
    frames = np.random.default_rng(0).normal(0, 1, (60, 32, 32))
    frames[::5] += 100
    assert jumps(list(frames)) == []


def test_key_frames_of_a_still_film_are_no_jumps() -> None:
    rng = np.random.default_rng(0)
    frames = np.repeat(rng.integers(90, 110, (5, 64, 64)), 12, axis=0)
    frames[np.arange(60), 3, rng.integers(0, 64, 60)] += 1
    assert jumps(list(frames)) == []


def test_key_frames_of_a_film_that_hardly_changes_are_no_jumps() -> None:
    """A pixel in 16 changes by a count, and most cells by a net one in 64; at each key frame all by 7."""
    rng = np.random.default_rng(0)
    frames = np.repeat(rng.integers(90, 110, (5, 64, 64)), 12, axis=0)
    frames += (rng.random(frames.shape) < 0.03) * rng.choice([-1, 1], frames.shape)
    assert jumps(list(frames)) == []
