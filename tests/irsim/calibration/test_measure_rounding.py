"""Counts of few bits: pictures or a detector's own, and what rounding does to small noise."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from intervals import held
from recording_fakes import Noise
from scipy.ndimage import gaussian_filter, shift
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.measure import defects, measure_figures, measure_noise, noise_lines, perhaps_pictures
from irsim.recording.importers import import_frames

HARDLY = "hardly more than rounding to whole counts makes"


def test_pictures_of_8_bits_are_told_where_they_may_be_no_counts_of_a_detector(tmp_path: Path) -> None:
    for k in range(4):
        picture = np.random.default_rng(k).integers(90, 110, (32, 40)).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture)
    shown = tmp_path / "shown.mcap"
    import_frames(tmp_path, shown)
    told = CliRunner().invoke(app, ["noise", str(shown)])
    assert told.stdout.splitlines()[-1].startswith("note     8 bits: unless these are a detector's own counts, ")
    before = f"""
frames: 4
camera: {{size: [40, 32], bits: 8, noise: []}}
background: {{kind: recording, file: {shown}, range_k: [250, 320]}}
"""
    assert perhaps_pictures(irsim.Rendering(irsim.loads(before)))
    assert not perhaps_pictures(
        irsim.Rendering(irsim.loads("camera: {bits: 8}\nbackground: {kind: ground}\nframes: 4\n"))
    )


def test_rounding_makes_no_bad_pixels() -> None:
    """Of noise of 0.06 counts, pixels between two counts go to and fro, or lie a whole count off."""
    rng = np.random.default_rng(0)
    level = 16 + 0.5 * np.linspace(0, 1, 96)[:, None] + rng.normal(0, 0.02, (96, 128))
    frames = np.rint(level + rng.normal(0, 0.06, (60, 96, 128))).astype(np.uint8)
    assert measure_noise(frames, 30.0, top=255).rounded
    found = defects(frames, 255)
    assert not found.all.any()
    frames[20:50:7, 40, 50] += 3
    frames[:, 60, 70] += 3
    found = defects(frames, 255)
    assert found.blinking[40, 50]
    assert found.hot[60, 70]


@pytest.mark.parametrize(("sigmas", "told"), [(0.0, True), (1.0, True), (2.0, True), (4.0, False)])
@pytest.mark.parametrize("end", [0, 255])
def test_noise_that_an_end_of_the_counts_cuts_off_is_told(sigmas: float, told: bool, end: int) -> None:
    rng = np.random.default_rng(1)
    mean = 10 * sigmas if end == 0 else 255 - 10 * sigmas
    frames = np.rint(rng.normal(mean, 10, (20, 48, 48))).clip(0, 255).astype(np.uint8)
    report = measure_noise(frames, 30.0, top=255)
    assert (report.clipped > 0.02) == told
    assert any("noise is cut off" in text for _, text in noise_lines(report)) == told
    assert (report.terms.tvh.high < 9.95) == told


def test_values_about_0_are_cut_off_nowhere() -> None:
    differences = np.rint(np.random.default_rng(2).normal(0, 3, (20, 48, 48)))
    assert measure_noise(differences, 30.0).clipped == 0


@pytest.mark.sampled
@pytest.mark.parametrize(("strength", "sigma"), [(0.7, 0.1), (0.7, 0.2), (1.0, 0.3), (1.5, 0.1), (3.0, 0.3)])
def test_noise_that_rounding_hides_has_a_bound_that_holds_it(strength: float, sigma: float) -> None:
    """Texture that slides by 0.7 px a frame: of 0.1 counts the bound was 0, of 0.3 it was 0.23, and for what moves
    in the region beside it no note came."""
    rng = np.random.default_rng(5)
    wide = gaussian_filter(rng.normal(size=(96, 400)), 6)
    wide *= strength / wide.std()
    scene = np.stack([shift(wide, (0, -0.7 * k), order=1, mode="nearest")[:, 40:168] for k in range(40)]) + 20
    frames = np.rint(scene + rng.normal(0, sigma, scene.shape)).astype(np.uint8)
    report, found = measure_noise(frames, 30.0, top=255), measure_figures(frames, 30.0, top=255, passing=False)
    assert report.slides
    assert found.noise.bound
    assert found.noise.high >= sigma
    assert found.white.high < 0.5
    assert any(HARDLY in text for _, text in noise_lines(report))
    assert any(HARDLY in note for note in found.notes)


def test_before_a_camera_that_stands_noise_and_pattern_may_be_all_that_rounding_hides() -> None:
    """Pixels lie near the middle of a count: of noise and a pattern of 0.1 counts both nothing is left, as of 0."""
    rng = np.random.default_rng(7)
    level = np.full((96, 128), 20.0) + rng.normal(0, 0.1, (96, 128))
    found = measure_figures(np.rint(level + rng.normal(0, 0.1, (40, 96, 128))).astype(np.uint8), 30.0, top=255)
    assert found.noise.low == 0
    assert found.noise.high >= 0.1
    assert found.pixel is not None
    assert found.pixel.high >= 0.1
    assert any(HARDLY in note for note in found.notes)


@pytest.mark.sampled
@pytest.mark.parametrize(("sigma", "widest"), [(0.2, 2.7), (0.35, 1.25), (0.4, 0.85), (0.5, 0.08), (0.7, 0.031)])
def test_an_interval_holds_the_noise_wherever_between_two_counts_the_mean_lies(sigma: float, widest: float) -> None:
    found = []
    for phase in range(12):
        drawn = np.random.default_rng(phase).normal(1000 + phase / 12, sigma, (40, 48, 48))
        found.append(measure_figures(np.rint(drawn).astype(np.uint16), 30.0, passing=False).noise)
    held(found, sigma, widest=widest)


@pytest.mark.filterwarnings("error")
def test_pictures_that_are_all_at_an_end_of_the_counts_have_a_fit() -> None:
    scene = "{frames: 12, camera: {size: [48, 48], range_k: [300, 400]}, background: {kind: ground, mean_k: 280}}"
    found = irsim.fit(irsim.loads(scene)).figures
    assert found.texture is None
    assert found.noise.low == 0 < found.noise.high


def test_a_fit_says_what_of_it_no_scenario_can_say() -> None:
    told = irsim.fit(Noise(size=(12, 12), has_truth=False)).notes
    assert any("irsim render refuses this: the fit:" in note and "12 is out of range" in note for note in told)
