"""What is the scene's is not told as the camera's: texture, slopes, edges, and what moves."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from test_measure_fit import apart
from typer.testing import CliRunner

import irsim
from irsim.cli.app import app
from irsim.errors import InputError
from irsim.fitting import Fit
from irsim.measure import Measured, NoiseReport, Region, measure_figures, measure_noise
from irsim.measure.lines import common_lines, lines
from irsim.measure.neighbours import alike, changes
from irsim.measure.rounding import HIDDEN
from irsim.measure.words import noise_lines
from irsim.types import Floats

NOISE, PIXEL, COLUMN, ROW = 4.0, 2.0, 1.5, 1.0
SIDE = 64


def pattern(rng: np.random.Generator, rows: int, columns: int) -> Floats:
    """What a camera adds that stays: pixels, columns and rows."""
    lines = rng.normal(0, ROW, (rows, 1)) + rng.normal(0, COLUMN, (1, columns))
    return np.asarray(rng.normal(0, PIXEL, (rows, columns)) + lines)


def texture(rng: np.random.Generator, rows: int, columns: int, sigma: float) -> Floats:
    drawn = gaussian_filter(rng.normal(size=(rows, columns)), 2)
    return np.asarray(sigma * drawn / drawn.std())


def filmed(rng: np.random.Generator, scene: Floats, count: int = 40) -> Floats:
    return np.rint(1000 + scene + rng.normal(0, NOISE, (count, *scene.shape)))


@pytest.mark.parametrize("side", [16, 32, 64])
def test_a_detectors_pattern_is_no_scene(side: int) -> None:
    for seed in range(200):
        assert alike(pattern(np.random.default_rng(seed), side, side)) == ()


def test_even_and_odd_rows_are_no_scene() -> None:
    rng = np.random.default_rng(1)
    assert alike(pattern(rng, SIDE, SIDE) + 30 * (np.arange(SIDE) % 2)[:, None]) == ()


@pytest.mark.parametrize(
    ("seen", "doubtful"),
    [
        (0.5 * np.arange(SIDE)[:, None], ("v",)),
        (0.5 * np.arange(SIDE)[None], ("h",)),
        (texture(np.random.default_rng(2), SIDE, SIDE, 1.0), ("v", "h", "vh")),
    ],
    ids=["slope down", "slope across", "texture"],
)
def test_what_a_scene_adds_is_doubted(seen: Floats, doubtful: tuple[str, ...]) -> None:
    """A texture of half the pattern's sigma makes `vh` 12 % too large."""
    rng = np.random.default_rng(3)
    report = measure_noise(filmed(rng, pattern(rng, SIDE, SIDE) + seen), 30.0, Region(0, 0, SIDE, SIDE))
    assert report.doubtful == doubtful
    told = dict(noise_lines(report))
    for term in ("v", "h", "vh", "tvh", "pair", "lags", "memory", "drift"):
        assert told[term].endswith("; may be the scene's") == (term in doubtful)
    assert report.terms.tvh.value == pytest.approx(np.hypot(NOISE, np.sqrt(1 / 12)), rel=0.01)


def ridge(seed: int) -> Floats:
    """A sky that grows brighter downwards above hot textured land, which ends in an edge; a still camera."""
    rng = np.random.default_rng(seed)
    rows, columns = np.mgrid[:150, :200]
    land = rows > 95 + 6 * np.sin(columns / 17)
    scene = 4.0 * rows + np.where(land, 250 + texture(rng, 150, 200, 60), 0)
    return filmed(rng, scene + pattern(rng, 150, 200))


def held(found: Measured | None, true: float) -> bool:
    """Within the interval made half as wide again: one in twenty lies outside of it."""
    if found is None:
        return False
    reach = 0.25 * (found.high - found.low)
    return found.low - reach <= true <= found.high + reach


def test_noise_is_read_off_the_texture() -> None:
    """On land, where 64 x 64 px are, v was 158 and vh 63."""
    report = measure_noise(ridge(4), 30.0)
    assert report.doubtful == ("v",)
    assert held(report.terms.vh, PIXEL)
    assert held(report.terms.h, COLUMN)


def test_where_there_is_texture_everywhere_it_is_said(tmp_path: Path) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text("frames: 20\ncamera: {size: [96, 80]}\nbackground: {kind: ground, spread_k: 1}\n")
    told = CliRunner().invoke(app, ["noise", str(scene)]).stdout
    assert "neighbouring pixels are alike in what stays here" in told
    assert "row to row, fixed; may be the scene's" in told
    found = json.loads(CliRunner().invoke(app, ["noise", str(scene), "--json"]).stdout)
    assert found["doubtful"] == ["v", "h", "vh"]


def moved(speed: float) -> NoiseReport:
    rng = np.random.default_rng(5)
    wide = texture(rng, SIDE, 4 * SIDE, 20.0)
    shifts = (speed * np.arange(40)).astype(int)
    scene = np.stack([wide[:, SIDE + shift : 2 * SIDE + shift] for shift in shifts])
    return measure_noise(scene + pattern(rng, SIDE, SIDE) + rng.normal(0, NOISE, scene.shape), 30.0)


def test_what_moves_is_told_from_noise_that_is_blurred() -> None:
    for speed in (0.1, 0.5):
        assert (moved(speed).together, moved(speed).moving) == (True, True)
        report = moved(speed)
        told = dict(noise_lines(report))
        assert {term for term, text in told.items() if text.endswith("; may be the scene's")} == set(report.doubtful)
        assert set(report.doubtful) == {"t", "v", "h", "tv", "th", "vh", "tvh", "pair", "lags", "memory", "drift"}
    rng = np.random.default_rng(6)
    blurred = np.stack([gaussian_filter(rng.normal(0, 20, (48, 48)), 0.7) for _ in range(40)])
    assert (changes(blurred).together, changes(blurred).moving) == (True, False)


def test_what_is_said_of_noise_that_is_blurred_is_plain_json() -> None:
    """Sharp noise of less than 0.3 counts: by rounding alone."""
    rng = np.random.default_rng(1)
    counts = np.rint(gaussian_filter(rng.normal(0, 15, (40, 96, 96)), (0, 1.5, 1.5)))
    told = json.loads(json.dumps(measure_noise(counts, 30.0).as_json()))
    assert (told["together"], told["moving"]) == (True, False)


def test_lines_that_all_parts_have_in_common_lie_in_their_interval() -> None:
    """Beneath edges and texture that are no lines; and beneath a horizon."""
    hits = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rows, columns = np.mgrid[:150, :200]
        scene = np.where(rows > 95 + 6 * np.sin(columns / 17), 250 + texture(rng, 150, 200, 60), 0) + 300 * (rows > 20)
        found = common_lines(scene + pattern(rng, 150, 200))
        hits += (found.row.low <= ROW <= found.row.high) + (found.column.low <= COLUMN <= found.column.high)
    assert hits >= 66  # of 80: a binomial of 0.95 has fewer in 1 of 10^5


@pytest.mark.parametrize("shape", [(3, 3), (4, 4), (5, 64), (64, 5)])
def test_lines_of_tiny_pictures_are_numbers(shape: tuple[int, int]) -> None:
    """Of fewer than six columns there are fewer than six parts; they were nan."""
    drawn = np.random.default_rng(1).normal(0, ROW, (shape[0], 1)) + np.zeros(shape)
    found = common_lines(drawn)
    assert 0 <= found.row.low <= found.row.value <= found.row.high
    assert found.row.low <= ROW <= found.row.high
    assert found.column == Measured(0, 0, 0)


def test_what_has_no_lines_has_none_in_common() -> None:
    even = common_lines(np.full((20, 30), 7.0))
    assert even.row == even.column == Measured(0, 0, 0)


def test_pictures_that_are_all_equal_have_no_noise_and_tiny_ones_are_one_clear_error() -> None:
    picture = np.random.default_rng(1).integers(0, 200, (40, 40)).astype(np.float64)
    found = measure_figures(np.repeat(picture[None], 8, axis=0), 30.0)
    assert (found.noise.value, found.noise.high) == (0, HIDDEN)  # as little as rounding hides
    assert found.row is not None
    assert found.row.low == 0
    with pytest.raises(InputError, match="a picture of 7x40 px is too small to be measured; allowed: at least 8x8"):
        measure_figures(np.zeros((8, 40, 7)), 30.0)


def test_lines_beside_strong_texture_lie_in_their_interval() -> None:
    """Where it is strong it is expected to have twice the power that it has, and lines add far less."""
    rng, across = np.random.default_rng(1), np.fft.rfftfreq(200)
    texture = np.tile(1e10 * np.maximum(across / 0.01, 1) ** -5.0, (150, 1)) + 4.0
    expected = np.where(texture > 100, 2 * texture, texture)
    seen = texture.copy()
    seen[0] += COLUMN**2 * 150 * 2 / 3
    drawn = (lines(seen * rng.exponential(size=seen.shape), expected, (150, 200)).column for _ in range(40))
    hits = sum(found.low <= COLUMN <= found.high for found in drawn)
    assert hits >= 32  # a binomial of 0.95 has fewer in 1 of 10^4


CAMERA = "[{kind: white}, {kind: fixed_pattern, pixel: 0.5, row: 0.3, column: 0.4}]"


@lru_cache
def fitted(name: str) -> tuple[float, Fit]:
    """The noise of a pixel in counts, and the fit."""
    changes = ["frames=60", "camera.motion=[]", "camera.size=[192,144]", f"camera.noise={CAMERA}"]
    scene = irsim.load(name, changes)
    response = scene.camera.response()
    return response.noise / response.gain, irsim.fit(scene)


@pytest.mark.sampled
@pytest.mark.parametrize("name", ["countryside", "treeline", "ground"])
def test_what_is_seen_is_not_written_as_fixed_pattern(name: str) -> None:
    noise, found = fitted(name)
    assert held(found.figures.noise, noise)
    assert found.figures.noise.value == pytest.approx(noise, rel=0.06)
    assert held(found.figures.pixel, 0.5 * noise)
    assert held(found.figures.row, 0.3 * noise)
    assert held(found.figures.column, 0.4 * noise)


def test_waves_that_run_are_not_written_as_fixed_pattern() -> None:
    """They explain most of the change as one shift: all that can be told is the noise."""
    noise, found = fitted("sea")
    assert found.figures.noise.value == pytest.approx(noise, rel=0.06)
    assert found.figures.pixel is found.figures.row is found.figures.column is None
    assert any("what moves in the scene is written standing still" in note for note in found.figures.notes)


@pytest.mark.parametrize("name", ["treeline", "sea"])
def test_rendered_and_fitted_again_the_figures_agree(name: str) -> None:
    first = fitted(name)[1]
    assert not apart(first.figures, irsim.fit(first.scenario).figures)


@pytest.mark.parametrize(("name", "layered"), [("treeline", True), ("ground", False)])
def test_what_is_not_made_again_of_a_scene_is_told(name: str, layered: bool) -> None:
    notes = fitted(name)[1].figures.notes
    assert any("a horizon: sky, sea, waves" in note for note in notes) == layered


def test_a_texture_that_is_the_same_all_over_is_told_nothing_of() -> None:
    text = """\
frames: 12
camera: {size: [96, 72], netd_mk: 40}
background: {kind: ground, spread_k: 3, correlation_mrad: 8}
"""
    notes = irsim.fit(irsim.loads(text)).notes
    assert not any("not made again" in note or "standing still" in note for note in notes)
    panned = irsim.loads(text, overrides=["camera.motion=[{kind: pan, azimuth_deg_s: 1}]"])
    assert any("standing still" in note for note in irsim.fit(panned).notes)


def test_a_gradient_that_is_no_texture_is_told_of() -> None:
    text = """\
frames: 30
camera: {size: [96, 72], elevation_deg: 5, ifov_mrad: 1, noise: [{kind: white}], netd_mk: 40}
background: {kind: sky, horizon_k: 288, zenith_k: 211}
"""
    found = irsim.fit(irsim.loads(text))
    image = irsim.open_source(irsim.loads(text)).frame(0).image.astype(float)
    rise = image[-1].mean() - image[0].mean()
    (told,) = [re.search(r"rises by (\d+) counts from (.*), which", note) for note in found.notes if "rises" in note]
    assert told is not None
    assert float(told[1]) == pytest.approx(rise, rel=0.1)
    assert told[2] == "top to bottom"
    even = irsim.fit(irsim.loads(text.replace("211", "288")))
    assert not any("rises" in note for note in even.notes)
