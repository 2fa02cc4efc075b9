"""Textures of known spectrum have their figures; real sequences and cameras are of their class or sort alone."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from calibration_clips import rendered
from typer.testing import CliRunner

import irsim
from irsim.calibration import CAMERAS, Estimate, Figures, compare_noise, compare_texture, measure_figures
from irsim.calibration.background import background_pictures
from irsim.calibration.background_classes import texture_figures, unevenness
from irsim.calibration.realism import noise_figures
from irsim.cli.app import app
from irsim.config.yaml_text import read_yaml
from irsim.errors import InputError
from irsim.recording.importers import import_frames
from irsim.scenario.catalog import examples
from irsim.types import Floats

CLOUDS = ["clouds", "frames=8", "camera.size=[160, 128]"]
PRESET = "frames: 100\ncamera: {preset: PRESET, size: [128, 96]}\nbackground: {kind: ground, spread_k: 0}\n"
CLAIMS = {name: read_yaml(path).value.get("like") for name, path in examples().items()}


def power_law(beta: float, seed: int) -> Floats:
    """Return a Gaussian field with a 2-D power spectrum ~ f^-beta."""
    radius = np.hypot.outer(np.fft.fftfreq(512), np.fft.rfftfreq(512))
    radius[0, 0] = np.inf
    noise = np.fft.rfft2(np.random.default_rng(seed).normal(size=(512, 512)))
    picture: Floats = np.fft.irfft2(noise * radius ** (-beta / 2))[:256, :320]
    scaled: Floats = 128 + 30 * (picture - picture.mean()) / picture.std()
    return scaled


def white(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(128, 30, (256, 320))


@pytest.mark.parametrize("beta", [1.5, 3.0])
def test_a_power_law_has_its_exponent(beta: float) -> None:
    found = texture_figures(np.stack([power_law(beta, seed) for seed in range(9)]))
    assert found.beta == pytest.approx(beta, abs=0.15)
    assert found.beta_x == pytest.approx(beta, abs=0.35)
    assert found.beta_y == pytest.approx(beta, abs=0.35)
    assert abs(found.bend) < 0.4
    assert found.spread == pytest.approx(30)


def test_unevenness_of_texture_in_half_of_the_picture() -> None:
    """Tiles have a standard deviation of 0 or of s, as many of each: mean and deviation are s / 2."""
    picture = white(1)
    assert unevenness(picture) == pytest.approx(1 / math.sqrt(2 * 32**2), rel=0.2)
    picture[:128] = 128
    assert unevenness(picture) == pytest.approx(1.0, abs=0.01)


def test_a_blur_bends_the_spectrum_by_its_transfer_function() -> None:
    """White noise under a Gaussian of sigma s: log P = -4 pi^2 s^2 f^2."""
    found = texture_figures(np.stack([cv2.GaussianBlur(white(seed), (0, 0), 2) for seed in range(9)]))
    f = np.geomspace(4 / 256, 0.2, 400)
    log_power = -4 * np.pi**2 * 4 * f**2
    expected = [-np.polyfit(np.log(f[half]), log_power[half], 1)[0] for half in (slice(200, None), slice(200))]
    assert found.bend == pytest.approx(expected[0] - expected[1], rel=0.25)


@pytest.mark.parametrize("blur", [0, 2])
def test_white_and_blurred_noise_is_of_no_class_or_camera(blur: float) -> None:
    blurred = [cv2.GaussianBlur(white(seed), (0, 0), blur) if blur else white(seed) for seed in range(3)]
    stretched = [128 + 40 * (p - p.mean()) / p.std() for p in blurred]
    assert compare_texture(texture_figures(np.stack(stretched))).fitting == ()
    frames = np.random.default_rng(0).normal(1000, 20, (30, 64, 80))
    if blur:
        frames = np.stack([np.asarray(cv2.GaussianBlur(frame, (0, 0), 1), np.float64) for frame in frames])
    assert compare_noise(measure_figures(frames, 30.0, points=False)).fitting == ()


@pytest.mark.parametrize("name", ["clouds", "ground"])
def test_a_shipped_scene_looks_like_its_claim_alone(name: str) -> None:
    found = texture_figures(background_pictures(irsim.open_source(name), 9))
    assert compare_texture(found).fitting == (CLAIMS[name],)


@pytest.mark.parametrize(
    ("preset", "rate_hz", "sort"),
    [("cooled_mwir", 50.0, "cooled"), ("uncooled_lwir", 30.0, "uncooled")],
)
def test_presets_are_of_their_sort_alone(preset: str, rate_hz: float, sort: str) -> None:
    compared = compare_noise(measure_figures(rendered(PRESET.replace("PRESET", preset)), rate_hz, points=False), sort)
    assert [v for v in compared.verdicts if not v.inside and v.figure != "level"] == []
    assert not set(compared.fitting) - {sort}


def figures() -> Figures:
    """Return figures of white noise."""
    frames = np.random.default_rng(1).normal(100, 1, (20, 32, 32)).round().astype(np.uint16)
    return measure_figures(frames, 30.0, points=False)


def test_the_interval_of_rows_covers_odd_and_even_ones() -> None:
    """sqrt(3^2 + 4^2) is 5; from below 0 to above it the least is the rows' own."""
    base = replace(figures(), noise=Estimate(1.0, 1.0, 1.0), row=Estimate(3.0, 2.0, 5.0))
    found = [
        noise_figures(replace(base, even_rows=even))["row"]
        for even in (Estimate(-4.0, -12.0, -1.5), Estimate(-4.0, -12.0, 1.5), None)
    ]
    assert [(row.value, row.low, row.high) for row in found] == [(5.0, 2.5, 13.0), (5.0, 2.0, 13.0), (3.0, 2.0, 5.0)]


def test_a_correlation_is_at_most_one() -> None:
    memory, frames, alone = Estimate(2.15, 1.77, 2.34), Estimate(10.7, 7.5, 12.9), Estimate(0.0, 0.0, 0.31)
    found = noise_figures(replace(figures(), white=alone, memory=memory, memory_frames=frames))["correlation"]
    assert found.value == pytest.approx(math.exp(-1 / 10.7))
    assert found.low == pytest.approx(1.77**2 / (1.77**2 + 0.31**2) * math.exp(-1 / 7.5))
    assert found.high == pytest.approx(math.exp(-1 / 12.9))


def test_the_command_judges_texture_by_its_status() -> None:
    good = CliRunner().invoke(app, ["realism", *CLOUDS, "--like", "cloud", "--json"])
    assert good.exit_code == 0, good.output
    found = json.loads(good.stdout)
    assert "cloud" in found["classes"]
    assert found["ranges"]["bend"]["inside"]
    bad = CliRunner().invoke(app, ["realism", *CLOUDS, "--like", "trees"])
    assert bad.exit_code == 1
    assert "OUTSIDE" in bad.stdout
    assert bad.stdout.splitlines()[-1] == "its noise cannot be judged: the scene moves; allowed: a still camera"
    assert bad.stdout.splitlines()[0] == "figure      measured  allowed for trees"
    for option, allowed in (("--like", "cloud, horizon"), ("--camera", ", ".join(CAMERAS))):
        none = CliRunner().invoke(app, ["realism", "clouds", option, "cheese"])
        assert isinstance(none.exception, InputError)
        assert str(none.exception).startswith(f"{option} 'cheese': no such")
        assert f"allowed: {allowed}" in str(none.exception)


def test_the_command_judges_noise_by_its_status(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text(PRESET.replace("PRESET", "uncooled_lwir"))
    good = CliRunner().invoke(app, ["realism", str(scene), "--json"])
    assert good.exit_code == 0, good.output
    found = json.loads(good.stdout)
    assert found["cameras"] == ["uncooled"]
    assert "correlation" in found["outside"]["cooled"]
    bad = CliRunner().invoke(app, ["realism", str(scene), "--camera", "cooled"])
    assert bad.exit_code == 1
    assert "its noise is like: uncooled" in bad.stdout


def test_noise_of_a_moving_scene_is_not_judged() -> None:
    reason = "its noise cannot be judged: the scene moves; allowed: a still camera"
    required = CliRunner().invoke(app, ["realism", *CLOUDS, "--camera", "cooled"])
    assert isinstance(required.exception, InputError)
    assert str(required.exception) == f"clouds: {reason}"
    assert required.stdout == ""


@pytest.mark.parametrize(
    ("side", "frames", "options", "expected"),
    [
        (96, 1, ["--camera", "cooled"], "1 frame is too few to measure noise; allowed: at least 4"),
        (16, 12, ["--like", "cloud"], "16x16 px are too few for a spectrum; allowed: at least 64x64"),
        (6, 12, ["--camera", "cooled"], "a picture of 6x6 px is too small to be measured; allowed: at least 8x8"),
        (96, 12, [], "its noise is not judged: pictures of 8 bits hold no sensor's noise"),
    ],
)
def test_pictures_of_8_bits_are_judged_or_refused_in_a_line(
    side: int, frames: int, options: list[str], expected: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    for k in range(frames):
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), rng.integers(0, 256, (side, side), np.uint8))
    recording = tmp_path / "eight.mcap"
    import_frames(tmp_path, recording)
    done = CliRunner().invoke(app, ["realism", str(recording), *options])
    assert done.exit_code == (1 if options else 0)
    assert expected in (str(done.exception) if isinstance(done.exception, InputError) else done.stdout)
