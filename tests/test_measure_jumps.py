"""Frames that show something else, as a shutter or a splash screen, spoil no figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import irsim
from irsim.measure.jumps import jumps
from irsim.types import Floats

EXAMPLES = sorted((Path(__file__).parents[1] / "scenarios" / "examples").glob("*.yaml"))
REAL = Path(__file__).resolve().parents[2] / "shared" / "real"

SCENE = """
frames: 60
seed: {seed}
camera: {{preset: {preset}, size: [96, 80]}}
background: {{kind: ground, spread_k: {spread_k}}}
"""


def drawn(preset: str, spread_k: float, seed: int = 1) -> Floats:
    scenario = irsim.loads(SCENE.format(seed=seed, preset=preset, spread_k=spread_k))
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
    ("first", "count", "used"), [(0, 1, (1, 60)), (0, 3, (3, 60)), (40, 1, (0, 40)), (59, 1, (0, 59))]
)
def test_what_a_shutter_shows_is_left_out(
    preset: str, spread_k: float, sigma: float, first: int, count: int, used: tuple[int, int]
) -> None:
    frames = drawn(preset, spread_k)
    found = irsim.measure_noise(shut(frames, first, count, sigma), 30.0)
    assert (found.stretch.index[0], found.stretch.index[-1] + 1) == used
    alone = irsim.measure_noise(frames[slice(*used)], 30.0)
    assert found.terms == alone.terms
    (sentence,) = [text for text in found.stretch.left_out(10) if "another" in text]
    assert sentence.startswith("the picture becomes another at frame")
    assert sentence.endswith(
        f"figures are those of frames {10 + used[0]} to {9 + used[1]}, the longest stretch without such a break"
    )


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_no_example_is_cut(path: Path) -> None:
    frames = [frame.image for frame, _ in irsim.frames(irsim.load(path), stop=60)]
    assert jumps(frames) == []


@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")
@pytest.mark.parametrize("name", ["raw14_lwir", "raw14_mwir", "raw16_lepton"])
def test_no_recording_of_a_real_sensor_is_cut(name: str) -> None:
    with np.load(REAL / name / "frames.npz") as file:
        assert jumps(list(file[file.files[0]])) == []


@pytest.mark.parametrize("rho", [0.0, 0.9, 1.0])
def test_a_level_that_scatters_or_wanders_makes_no_jumps(rho: float) -> None:
    """White, remembering and walking levels, far above the noise of pixels, of 50 recordings each."""
    for seed in range(50):
        rng = np.random.default_rng(seed)
        level = rng.normal(0, 20, 300)
        for k in range(1, 300):
            level[k] += rho * level[k - 1]
        assert jumps(list(rng.normal(0, 1, (300, 16, 16)) + level[:, None, None])) == [], seed


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
