"""What differs from place to place and is no texture: noted where it is left out, and no rows of the detector."""

from __future__ import annotations

import re

import numpy as np
import pytest
from intervals import held
from recording_fakes import Noise

import irsim
from irsim.measure import Figures, measure_figures
from irsim.measure.depth import EIGHT_BITS
from irsim.measure.interval import Measured
from irsim.measure.pattern import fixed_pattern
from irsim.types import Floats

Y, X = np.mgrid[:120, :160].astype(np.float64)
R2 = (X - 80) ** 2 + (Y - 60) ** 2
LEFT_OUT = r"([\d.]+) counts rms of what differs from place to place are smoother than texture"


def measured(scene: Floats) -> Figures:
    """Figures of a scene in counts under white noise of 3."""
    rng = np.random.default_rng(2)
    frames = np.rint(5000 + scene + rng.normal(0, 3, (40, *scene.shape))).astype(np.uint16)
    return measure_figures(frames, 30.0, passing=False)


def left_out(figures: Figures) -> list[float]:
    return [float(found[1]) for note in figures.notes if (found := re.match(LEFT_OUT, note))]


def rising(figures: Figures) -> bool:
    return any("the picture rises by" in note for note in figures.notes)


@pytest.mark.sampled
@pytest.mark.parametrize(
    "scene",
    [
        200 * np.exp(-((Y - 60) ** 2) / (2 * 15**2)),
        200 * np.exp(-((X - 80) ** 2) / (2 * 15**2)),
        200 * np.exp(-R2 / (2 * 25**2)),
        -60 * np.exp(-R2 / (2 * 12**2)),
    ],
    ids=["band", "upright", "blob", "dip"],
)
def test_what_is_smooth_and_no_texture_is_not_left_out_without_a_word(scene: Floats) -> None:
    (told,) = left_out(measured(scene))
    assert told == pytest.approx(scene.std(), rel=0.05)


def test_beside_texture_it_is_told_of_too() -> None:
    ground = irsim.loads("frames: 1\ncamera: {size: [160, 120], noise: []}\nbackground: {kind: ground, spread_k: 0.3}")
    texture = irsim.open_source(ground).frame(0, "counts").image.astype(np.float64)
    texture -= texture.mean()
    band = 20 * texture.std() * np.exp(-((Y - 60) ** 2) / (2 * 15**2))
    assert not left_out(measured(texture))
    (told,) = left_out(measured(texture + band))
    assert told == pytest.approx((texture + band).std(), rel=0.2)
    assert rising(measured(texture + 20 * texture.std() * X / 160))


def test_a_rise_small_things_and_noise_alone_are_nothing_that_is_left_out() -> None:
    things = np.where(np.maximum(abs(X - 40), abs(Y - 30)) < 4, 300.0, 0.0)
    for scene, rises in ((0 * Y, False), (things, False), (Y + 0.5 * X, True), (np.maximum(60 - Y, 0) * 3, True)):
        figures = measured(scene)
        assert not left_out(figures)
        assert rising(figures) == rises


@pytest.mark.sampled
@pytest.mark.parametrize(
    "background",
    [
        "{kind: ground, spread_k: 0.1}",
        "{kind: ground, spread_k: 3, betas: [3.9, 3], correlation_mrad: 200}",
        "{kind: sky, horizon_k: 280, zenith_k: 250, clouds: [{}]}",
        "{kind: sky, horizon_k: 290, zenith_k: 260}",
        "{kind: sky}",
    ],
)
def test_grounds_and_skies_that_are_rendered_leave_out_nothing(background: str) -> None:
    for seed in range(3):
        text = f"frames: 1\nseed: {seed}\ncamera: {{size: [160, 120], noise: []}}\nbackground: {background}"
        scene = irsim.open_source(irsim.loads(text)).frame(0, "counts").image.astype(np.float64)
        assert not left_out(measured(scene - scene.mean()))


@pytest.mark.sampled
@pytest.mark.parametrize("elevation_deg", [0, -1])
def test_rows_before_the_horizon_of_a_clear_sky_are_those_of_the_detector(elevation_deg: float) -> None:
    """A kink of 3.5 counts a row, where rows differ by 0.13: they came out 2.5 times too large."""
    text = f"""
frames: 1
camera: {{size: [160, 120], bits: 16, range_k: [240, 310], noise: [], elevation_deg: {elevation_deg}}}
background: {{kind: sky, horizon_k: 290, zenith_k: 260}}
"""
    sky = irsim.open_source(irsim.loads(text)).frame(0, "counts").image / 15.0
    rows: list[Measured] = []
    columns: list[Measured] = []
    for seed in range(24):
        rng = np.random.default_rng(seed)
        lines = rng.normal(0, 0.13, (120, 1)) + rng.normal(0, 0.25, (1, 160))
        found = fixed_pattern(sky + lines + rng.normal(0, 0.5, sky.shape), None, False, np.zeros(sky.shape, np.bool_))
        rows.append(found.row)
        columns.append(found.column)
    held(rows, 0.13)
    held(columns, 0.25)
    assert np.median([row.value for row in rows]) == pytest.approx(0.13, rel=0.1)


def test_what_limits_all_figures_is_told_first() -> None:
    notes = irsim.fit(Noise(count=12, size=(48, 40), bits=8, has_truth=False)).notes
    assert notes[0] == EIGHT_BITS
    first = [next(k for k, note in enumerate(notes) if word in note) for word in ("the blur is taken", "does not say")]
    assert first == sorted(first)


@pytest.mark.parametrize("seed", range(6))
def test_rows_of_the_detector_are_no_rise_of_a_scene(seed: int) -> None:
    """Of 64 rows that differ by ten times the noise, two in ten pictures rose by 16 to 28 counts, it was said."""
    rng = np.random.default_rng(seed)
    frames = 1000 + 40 * rng.standard_normal((64, 1)) + 4 * rng.standard_normal((8, 64, 80))
    assert not rising(measure_figures(np.rint(frames), 30.0, passing=False))
