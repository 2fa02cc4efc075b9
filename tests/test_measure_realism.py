"""Textures of known spectrum are measured as made; real sequences are told from noise and from each other."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import irsim
from irsim.cli import app
from irsim.errors import InputError
from irsim.loader import examples
from irsim.measure import CLASSES, Texture, backdrops, classes_of, judge, texture
from irsim.types import Floats, Look

REAL = Path(__file__).resolve().parents[2] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")


def power_law(beta: float, seed: int, squeeze: float = 1.0) -> Floats:
    """A Gaussian field whose 2-D power spectrum is (fx^2 + (squeeze fy)^2)^(-beta/2)."""
    radius = np.hypot.outer(squeeze * np.fft.fftfreq(512), np.fft.rfftfreq(512))
    radius[0, 0] = np.inf
    noise = np.fft.rfft2(np.random.default_rng(seed).normal(size=(512, 512)))
    picture: Floats = np.fft.irfft2(noise * radius ** (-beta / 2))[:256, :320]
    scaled: Floats = 128 + 30 * (picture - picture.mean()) / picture.std()
    return scaled


def white(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(128, 30, (256, 320))


@pytest.mark.parametrize("beta", [1.5, 2.2, 3.0, 4.0])
def test_a_power_law_gives_its_exponent(beta: float) -> None:
    found = texture(np.stack([power_law(beta, seed) for seed in range(9)]))
    assert found.beta == pytest.approx(beta, abs=0.15)
    assert found.beta_x == pytest.approx(beta, abs=0.35)
    assert found.beta_y == pytest.approx(beta, abs=0.35)
    assert abs(found.bend) < 0.4
    assert found.spread == pytest.approx(30)


def test_a_blur_bends_the_spectrum_as_its_transfer_function_says() -> None:
    """White noise under a Gaussian of sigma s: log P = -4 pi^2 s^2 f^2, so that its slope at f is 8 pi^2 s^2 f^2."""
    found = texture(np.stack([cv2.GaussianBlur(white(seed), (0, 0), 2) for seed in range(9)]))
    low, high = 4 / 256, 0.2
    f = np.geomspace(low, high, 400)
    log_power = -4 * np.pi**2 * 4 * f**2
    expected = [-np.polyfit(np.log(f[half]), log_power[half], 1)[0] for half in (slice(200, None), slice(200))]
    assert found.bend == pytest.approx(expected[0] - expected[1], rel=0.25)


@pytest.mark.parametrize("like", CLASSES)
@pytest.mark.parametrize("blur", [0, 1, 1.5, 2, 2.5, 3, 4, 8])
def test_white_and_blurred_noise_is_no_class(like: str, blur: float) -> None:
    blurred = [cv2.GaussianBlur(white(seed), (0, 0), blur) if blur else white(seed) for seed in range(3)]
    stretched = [128 + 40 * (p - p.mean()) / p.std() for p in blurred]
    assert not all(verdict.inside for verdict in judge(texture(np.stack(stretched)), like))


@lru_cache
def of_scene(name: str) -> Texture:
    """As the command looks at it."""
    return texture(backdrops(irsim.open_source(name), 9))


CLAIMS = {name: irsim.load(path).like for name, path in examples().items()}


@pytest.mark.parametrize("name", [name for name, like in CLAIMS.items() if like])
def test_a_shipped_scene_is_like_what_it_claims(name: str) -> None:
    like = CLAIMS[name]
    assert like is not None
    assert not [verdict for verdict in judge(of_scene(name), like) if not verdict.inside]


def test_sky_trees_and_ground_are_claimed() -> None:
    assert {"cloud", "ground", "treeline"} <= set(CLAIMS.values())
    assert set(CLASSES) == set(get_args(Look))


@pytest.mark.parametrize(("name", "neighbours"), [("sky", []), ("clouds", []), ("treeline", []), ("ground", ["city"])])
def test_a_scene_is_not_like_other_classes(name: str, neighbours: list[str]) -> None:
    """Ground and city overlap in real recordings, too."""
    assert not set(classes_of(of_scene(name))) - {CLAIMS[name], *neighbours}


def test_a_target_is_no_background() -> None:
    """The jet's heat, which this AGC leaves out, would lessen beta by 0.1."""
    keys = ["frames=60", "camera.agc={kind: linear, tails: [0.005, 0.05]}"]
    beside, without = (irsim.open_source("sky", [*keys, f"without={off}"]) for off in ("[]", "[jet]"))
    found, expected = (texture(backdrops(source, 9)) for source in (beside, without))
    for figure in ("beta", "beta_x", "beta_y"):
        assert getattr(found, figure) == pytest.approx(getattr(expected, figure), abs=0.05)


@real
@pytest.mark.parametrize(
    ("name", "like", "others"),
    [
        ("sky_airplane_cirrus", "cloud", ["trees", "ground", "city", "horizon"]),
        ("drone_treeline", "treeline", ["trees", "ground", "city"]),
        ("birds_crossing", "trees", ["cloud", "horizon"]),
    ],
)
def test_real_sequences_are_of_their_class(name: str, like: str, others: list[str]) -> None:
    capture = cv2.VideoCapture(str(REAL / name / "frames.mp4"))
    frames = [np.asarray(capture.read()[1])[..., 0] for _ in range(300)]
    classes = classes_of(texture(np.stack(frames[::37])))
    assert like in classes
    assert not set(others) & set(classes)


def test_even_and_small_pictures_are_one_clear_error() -> None:
    with pytest.raises(InputError, match="even"):
        texture(np.full((2, 64, 64), 7, np.uint8))
    with pytest.raises(InputError, match="64x64"):
        texture(np.zeros((2, 40, 64), np.uint8))


def test_the_command_says_so_by_its_status() -> None:
    good = CliRunner().invoke(app, ["realism", "clouds", "--like", "cloud", "--json"])
    assert good.exit_code == 0, good.output
    told = json.loads(good.stdout)
    assert "cloud" in told["classes"]
    assert told["ranges"]["bend"]["inside"]
    bad = CliRunner().invoke(app, ["realism", "clouds", "--like", "trees"])
    assert bad.exit_code == 1
    assert "OUTSIDE" in bad.stdout
    alone = CliRunner().invoke(app, ["realism", "clouds"])
    assert alone.exit_code == 0
    assert "looks like: " in alone.stdout
    none = CliRunner().invoke(app, ["realism", "clouds", "--like", "cheese"])
    assert isinstance(none.exception, InputError)
    assert "allowed: cloud, horizon" in str(none.exception)
