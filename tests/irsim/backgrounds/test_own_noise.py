"""What covers recorded frames hides what is seen in them; their noise goes on over it, as strong as it was."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from irsim.backgrounds.recorded import MEDIAN_OF_NOISE, folded, recorded_noise
from irsim.recording import open_recording, record
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario
from irsim.types import Floats

SIZE = (96, 64)
NETD_MK = 50.0
FRAMES = 6
BAR = {"kind": "bar", "center_px": (48.0, 32.0), "size_px": (50.0, 40.0), "range_m": 100.0}
COVERED = np.s_[:, 15:49, 26:70]
"""Well within the bar."""
APART = np.s_[:, :9, :]
"""Flat, and far from all that is there."""

POINT = {
    "id": "point",
    "shape": {"kind": "point", "contrast_k": 20.0, "area_m2": 0.5},
    "path": {"kind": "straight", "start": (50.0, 30.0), "range_m": 2000.0},
}
PLATE = {
    "id": "plate",
    "shape": {"kind": "hot_spot", "size_m": (15.0, 9.0), "temperature_k": 320.0},
    "path": {"kind": "straight", "start": (48.0, 32.0), "range_m": 2000.0},
}


def scene(background: dict[str, Any], **keys: Any) -> Scenario:
    camera = {"size": SIZE, "bits": 14, "range_k": (250.0, 350.0), "netd_mk": NETD_MK, "ifov_mrad": 0.5, "psf_px": 0.4}
    return Scenario.model_validate({"frames": FRAMES, "camera": camera, "background": background, **keys})


def footage(folder: Path, seed: int = 0, *targets: dict[str, Any]) -> Path:
    """Flat ground of 290 K with things on it."""
    ground = {"kind": "ground", "mean_k": 290.0, "spread_k": 0.0}
    return record(Rendering(scene(ground, seed=seed, targets=list(targets))), folder / "own.mcap")


def counts(frames: Any) -> Floats:
    return np.array([frame.image for frame in frames], np.float64)


def before_and_after(file: Path) -> tuple[Floats, Floats]:
    """Frames of the footage, and those with a bar before it, (frames, rows, cols)."""
    barred = scene({"kind": "recording", "file": str(file)}, occluders=[BAR])
    return counts(open_recording(file).frames()), counts(Rendering(barred).frames())


@pytest.mark.parametrize("thing", [POINT, PLATE], ids=["point", "edges"])
def test_what_covers_a_thing_of_the_footage_hides_it(tmp_path: Path, thing: dict[str, Any]) -> None:
    own, barred = before_and_after(footage(tmp_path, 0, thing))
    noise = own[APART].std()
    assert np.abs(own[COVERED] - np.median(own[APART])).max() > 50 * noise
    off = barred[COVERED] - np.median(barred[COVERED])
    assert np.abs(off).max() < 4.5 * noise
    assert off.std() == pytest.approx(noise, rel=0.06)


@pytest.mark.parametrize("seed", range(4))
def test_the_noise_on_what_covers_is_as_strong_as_the_footages(tmp_path: Path, seed: int) -> None:
    own, barred = before_and_after(footage(tmp_path, seed))
    off = (barred[COVERED] - barred[COVERED].mean()) / own[COVERED].std()
    assert off.std() == pytest.approx(1, abs=0.05)
    # A normal distribution has 68.3 % within 1 sigma and 95.4 % within 2; one pixel in nine is the median itself.
    assert (np.abs(off) < 1).mean() == pytest.approx(0.683, abs=0.06)
    assert (np.abs(off) < 2).mean() == pytest.approx(0.954, abs=0.01)
    # It is the pixel's own, so that it goes on in time as it did.
    assert np.corrcoef(off.ravel(), own[COVERED].ravel())[0, 1] > 0.9


def test_what_is_not_covered_stays_the_footage(tmp_path: Path) -> None:
    elsewhere = {**POINT, "path": {"kind": "straight", "start": (10.0, 8.0), "range_m": 2000.0}}
    own, barred = before_and_after(footage(tmp_path, 0, elsewhere))
    free = np.ones(SIZE[::-1], bool)
    free[8:56, 19:77] = False
    assert np.array_equal(barred[:, free], own[:, free])
    assert not np.array_equal(barred, own)


def drawn(deviation: float, seed: int, shape: tuple[int, int] = (256, 256)) -> npt.NDArray[np.uint16]:
    noise = np.random.default_rng(seed).normal(8000.3, deviation, shape)
    return np.rint(noise).astype(np.uint16)


@pytest.mark.parametrize("deviation", [0.2, 0.5, 0.8, 1.5, 4.0, 40.0, 400.0])
def test_noise_finer_or_coarser_than_counts_is_kept(deviation: float) -> None:
    for seed in range(3):
        image = drawn(deviation, seed)
        noise = recorded_noise(image, 16383)
        assert noise.std() == pytest.approx(image.std(), rel=0.08)


def test_the_median_of_noise_is_that_of_drawn_noise() -> None:
    image = drawn(400.0, 1, (1000, 1000))
    middle = np.lib.stride_tricks.sliding_window_view(image, (3, 3)).reshape(998, 998, 9)
    off = np.abs(image[1:-1, 1:-1] - np.median(middle, axis=-1))
    assert np.median(off) / 400.0 == pytest.approx(MEDIAN_OF_NOISE, rel=0.01)


def test_clipped_pixels_do_not_say_how_strong_noise_is() -> None:
    """Two thirds of the frame are bars or clipped sky; on the rest noise is kept."""
    image = drawn(5.0, 0)
    image[:100], image[-71:] = 0, 16383
    noise = recorded_noise(image, 16383)
    assert noise[102:-73].std() == pytest.approx(5, rel=0.06)
    assert not noise[:99].any()


@pytest.mark.parametrize("level", [0, 700, 16383])
def test_footage_without_noise_gets_none(level: int) -> None:
    image = np.full((40, 50), level, np.uint16)
    image[20, 20] = 9000
    assert np.abs(recorded_noise(image, 16383)).max() < 1


def test_what_stands_out_is_folded_without_a_jump() -> None:
    """As it is up to 7, back to -3.5, then to and fro: 14 becomes 0, 17.5 -3.5, 24.5 3.5, 28 0."""
    off = np.array([0, 3, 7, 8, 10.5, 14, 17.5, 21, 24.5, 28], np.float32)
    into = np.array([0, 3, 7, 6, 3.5, 0, -3.5, 0, 3.5, 0])
    np.testing.assert_allclose(folded(off, 7.0), into, atol=1e-6)
    np.testing.assert_allclose(folded(-off, 7.0), -into, atol=1e-6)
    fine = np.linspace(-100, 100, 20001)
    np.testing.assert_allclose(np.abs(np.diff(folded(fine, 7.0))), 0.01, atol=0.0101)
    # Evenly spread, it has the deviation of the noise, of which 7 is 3.5.
    assert folded(fine[np.abs(fine) > 10.5], 7.0).std() == pytest.approx(2, rel=0.03)
