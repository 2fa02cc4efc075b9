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
from irsim.cli.app import app
from irsim.config.yaml_file import read
from irsim.errors import InputError
from irsim.geometry.random_fields import spectral
from irsim.measure import CLASSES, Texture, backdrops, check_class, check_sort, judge, judge_classes, texture
from irsim.measure.realism import Verdict
from irsim.measure.spectrum import unevenness
from irsim.recording import Recording, open_recording
from irsim.recording.importers import import_frames
from irsim.scenario.loader import examples
from irsim.types import BackgroundClass, Floats

REAL = Path(__file__).resolve().parents[4] / "shared" / "real"
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


def test_texture_in_half_of_the_picture_is_as_uneven_as_can_be_told_by_hand() -> None:
    """Tiles have a standard deviation of 0 or of s, as many of each: their mean is s / 2, and so is their deviation."""
    picture = white(1)
    assert unevenness(picture) == pytest.approx(1 / np.sqrt(2 * 32**2), rel=0.2)  # of a sample's standard deviation
    picture[:128] = 128
    assert unevenness(picture) == pytest.approx(1.0, abs=0.01)


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


def test_a_city_whose_spectrum_falls_faster_along_x_than_along_y_is_none() -> None:
    """Over all directions it falls as that of a city; along one axis 0.35 beyond real ones' 2.2 and 2.4 is let pass."""
    fields = (spectral((512, 512), 3, (3.2, 2.4), 60, 1.0, seed, "field")[:256, :320] for seed in range(3))
    found = texture(np.stack([128 + 33 * field / field.std() for field in fields]))
    assert [each.figure for each in judge(found, "city") if not each.inside] == ["beta_x", "beta_y"]


@lru_cache
def of_scene(name: str) -> Texture:
    """As the command looks at it."""
    return texture(backdrops(irsim.open_source(name), 9))


CLAIMS = {name: read(path).value.get("like") for name, path in examples().items()}


@pytest.mark.sampled
@pytest.mark.parametrize("name", [name for name, like in CLAIMS.items() if like])
def test_a_shipped_scene_is_like_what_it_claims(name: str) -> None:
    like = CLAIMS[name]
    assert like is not None
    assert not [verdict for verdict in judge(of_scene(name), like) if not verdict.inside]


def test_sky_trees_and_ground_are_claimed() -> None:
    assert {"cloud", "ground", "treeline"} <= set(CLAIMS.values())
    assert set(CLASSES) == set(get_args(BackgroundClass))


LONGER = "hiding", "platform"


@pytest.mark.sampled
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in LONGER else []) for name in CLAIMS]
)
def test_a_shipped_scene_is_like_no_class_that_it_does_not_claim(name: str) -> None:
    """Ground is not city, a sea is neither trees nor a tree line, a sky over the horizon has no tree line."""
    assert set(judge_classes(of_scene(name)).fitting) <= {CLAIMS[name]}


SLOWER = [pytest.param(name, marks=pytest.mark.slow) for name in ("clouds", "ground", "treeline", "countryside")]


@pytest.mark.parametrize("name", ["sky", *SLOWER])
def test_over_seeds_a_scene_lies_within_what_real_recordings_have(name: str) -> None:
    """The median of ten seeds, in ranges that are not widened."""
    seeds = (backdrops(irsim.open_source(name, seed=seed), 2) for seed in range(1, 11))
    found = texture(np.concatenate(list(seeds)))
    real = CLASSES[str(CLAIMS[name])]
    for figure in set(real.ranges()) - {"bend"}:
        low, high = getattr(real, figure)
        assert low <= getattr(found, figure) <= high, figure


def test_a_target_is_no_background() -> None:
    """The jet's heat, which this AGC leaves out, would lessen beta by 0.1."""
    keys = ["frames=60", "camera.agc={kind: linear, tails: [0.005, 0.05]}"]
    beside, without = (irsim.open_source("sky", [*keys, f"without={off}"]) for off in ("[]", "[jet]"))
    found, expected = (texture(backdrops(source, 9)) for source in (beside, without))
    for figure in ("beta", "beta_x", "beta_y"):
        assert getattr(found, figure) == pytest.approx(getattr(expected, figure), abs=0.05)


def sequence(name: str, truth: bool, folder: Path) -> Recording:
    """A real sequence, with or without its truth."""
    at = REAL / name
    return open_recording(
        import_frames(at / "frames.mp4", folder / f"{name}.mcap", truth=at / "gt.csv" if truth else None)
    )


@pytest.mark.sampled
@real
@pytest.mark.parametrize(
    ("name", "truth", "classes"),
    [
        ("sky_airplane_cirrus", True, {"cloud", "treeline"}),
        ("sky_airplane_cirrus", False, {"cloud", "treeline"}),
        ("drone_treeline", True, {"treeline"}),
        ("drone_treeline", False, {"treeline", "cloud"}),
        ("birds_crossing", True, {"trees"}),
        ("birds_crossing", False, {"trees"}),
    ],
)
def test_real_sequences_are_of_their_class(name: str, truth: bool, classes: set[str], tmp_path: Path) -> None:
    """Targets that no truth tells of are taken for background, which moves slopes. Below the thin cloud of the first
    sequence a bright horizon is seen."""
    found = texture(backdrops(sequence(name, truth, tmp_path), 9))
    assert set(judge_classes(found).fitting) == classes


@real
def test_thin_cloud_above_the_horizon_is_cloud_alone(tmp_path: Path) -> None:
    """The horizon lies below row 192."""
    pictures = backdrops(sequence("sky_airplane_cirrus", True, tmp_path), 9)
    assert judge_classes(texture(pictures[:, :192])).fitting == ("cloud",)


def test_even_and_small_pictures_are_one_clear_error() -> None:
    with pytest.raises(InputError, match="even"):
        texture(np.full((2, 64, 64), 7, np.uint8))
    with pytest.raises(InputError, match="64x64"):
        texture(np.zeros((2, 40, 64), np.uint8))


@pytest.mark.parametrize(
    ("side", "frames", "asked", "told"),
    [
        (96, 1, ["--like", "cloud"], "2.70 to 4.30  OUTSIDE"),
        (96, 1, ["--camera", "cooled"], "1 frame is too few to measure noise; allowed: at least 4"),
        (96, 12, ["--like", "cloud", "--camera", "cooled"], "its noise is like: that of no real camera"),
        (16, 12, ["--like", "cloud"], "16x16 px are too few for a spectrum; allowed: at least 64x64"),
        (16, 12, ["--camera", "uncorrected"], "2.35 to 9.60  OUTSIDE"),
        (6, 12, ["--camera", "cooled"], "a picture of 6x6 px is too small to be measured; allowed: at least 8x8"),
    ],
)
def test_recordings_of_8_bits_tiny_ones_and_single_frames_are_judged_or_refused_in_a_line(
    side: int, frames: int, asked: list[str], told: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    for k in range(frames):
        cv2.imwrite(str(tmp_path / f"{k:03}.png"), rng.integers(0, 256, (side, side), np.uint8))
    recording = tmp_path / "eight.mcap"
    import_frames(tmp_path, recording)
    done = CliRunner().invoke(app, ["realism", str(recording), *asked])
    assert done.exit_code == 1
    assert told in (str(done.exception) if isinstance(done.exception, InputError) else done.stdout)


def test_it_says_which_figures_keep_a_picture_from_a_class(tmp_path: Path) -> None:
    """White noise: its spectrum is flat, and it lies evenly. It is of 8 bits, and no camera's noise."""
    for k in range(4):
        cv2.imwrite(str(tmp_path / f"{k}.png"), np.clip(white(k), 0, 255).astype(np.uint8))
    import_frames(tmp_path, tmp_path / "white.mcap")
    told = CliRunner().invoke(app, ["realism", str(tmp_path / "white.mcap")])
    assert told.exit_code == 0, told.output
    kept = {line.split(":")[0]: line for line in told.stdout.splitlines() if line.startswith("  not ")}
    assert told.stdout.splitlines()[0] == "figure      measured"
    assert set(kept) == {f"  not {name}" for name in CLASSES}
    assert "uneven 0.02 (allowed 0.41 to 1.74)" in kept["  not cloud"]
    assert "spread" not in kept["  not cloud"]
    assert told.stdout.splitlines()[-1].startswith("its noise is not judged, for pictures of 8 bits hold no sensor's")


def test_the_library_names_its_own_parameters() -> None:
    with pytest.raises(InputError, match=r"^like 'cheese': no such class; allowed: c"):
        check_class("cheese")
    with pytest.raises(InputError, match=r"^camera 'cheese': no such sort of camera; allowed: c"):
        check_sort("cheese")


def test_in_python_the_same_is_compared() -> None:
    told = json.loads(CliRunner().invoke(app, ["realism", "clouds", "frames=12", "--json"]).stdout)
    found = irsim.measure_realism(irsim.open_source("clouds", ["frames=12"]), "cloud")
    assert json.loads(json.dumps({"source": "clouds", **found.as_json()})) == told
    assert found.inside
    assert found.noise_unknown == told["noise_unknown"]
    assert not irsim.measure_realism(irsim.open_source("clouds", ["frames=12"]), "trees").inside
    with pytest.raises(InputError, match=r"^like 'cheese': no such class"):
        irsim.measure_realism(irsim.open_source("clouds"), "cheese")


def test_the_command_says_so_by_its_status() -> None:
    good = CliRunner().invoke(app, ["realism", "clouds", "frames=12", "--like", "cloud", "--json"])
    assert good.exit_code == 0, good.output
    told = json.loads(good.stdout)
    assert "cloud" in told["classes"]
    assert told["ranges"]["bend"]["inside"]
    bad = CliRunner().invoke(app, ["realism", "clouds", "frames=12", "--like", "trees"])
    assert bad.exit_code == 1
    assert "OUTSIDE" in bad.stdout
    alone = CliRunner().invoke(app, ["realism", "clouds", "frames=12"])
    assert alone.exit_code == 0
    assert "looks like: " in alone.stdout
    assert alone.stdout.splitlines()[0] == "figure      measured  allowed for cloud"
    assert bad.stdout.splitlines()[0] == "figure      measured  allowed for trees"
    none = CliRunner().invoke(app, ["realism", "clouds", "--like", "cheese"])
    assert isinstance(none.exception, InputError)
    assert "allowed: cloud, horizon" in str(none.exception)
    unknown = CliRunner().invoke(app, ["realism", "clouds", "--camera", "cheese"])
    assert isinstance(unknown.exception, InputError)
    assert str(unknown.exception).startswith("--camera 'cheese': no such sort of camera; allowed: cooled, ")


@pytest.mark.parametrize(("value", "told"), [(2.7501, "2.7501"), (2.75, "2.75"), (2.2999, "2.2999"), (3.0, "3.00")])
def test_a_figure_outside_is_not_printed_as_the_end_that_it_is_beyond(value: float, told: str) -> None:
    assert Verdict("beta", value, 2.3, 2.75).measured == told
