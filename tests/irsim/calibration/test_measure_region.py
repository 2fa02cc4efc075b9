"""Where noise is read: flat, still and off the targets; what is told where there is no such place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from even_noise import rendered
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.errors import InputError
from irsim.measure import Region, flattest, measure_noise, parse_region, taken_by_targets
from irsim.measure.neighbours import fine_sigma
from irsim.measure.words import noise_lines
from irsim.render.sources import open_source


def test_the_flattest_window_is_found() -> None:
    frames = rendered(2, (8, 128, 160), {"kind": "white"}).astype(np.float64)
    rows, columns = np.mgrid[:128, :160]
    frames += 100 * np.sin(rows / 3) * ((columns < 90) | (rows < 56))
    assert flattest(frames, 65535) == Region(96, 64, 64, 64) or flattest(frames, 65535).x >= 88


def test_the_flattest_window_by_chance_makes_no_fixed_pattern_weaker() -> None:
    """A pattern of sigma 30 in 48 x 48 px is known to 1.5 %, the mean of 64 of them to 0.2 %."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(64):
        frames = 1000 + 30 * rng.standard_normal((1, 96, 128)) + 10 * rng.standard_normal((8, 96, 128))
        found.append(measure_noise(frames, 30.0).terms.vh)
    assert np.mean([vh.value for vh in found]) == pytest.approx(30, rel=0.01)
    assert sum(vh.low < 30 < vh.high for vh in found) > 55


def test_a_blown_out_corner_is_not_called_flat() -> None:
    frames = rendered(3, (8, 128, 128), {"kind": "white"}).astype(np.float64)
    frames[:, :64, :64] = 4095
    region = flattest(frames, 4095)
    assert region.x >= 64 or region.y >= 64


def test_values_about_0_are_no_counts_that_are_cut_off() -> None:
    """In degrees, or less their mean: half of them, in every window, were taken for counts below the least."""
    random = np.random.default_rng(3)
    rows, columns = np.mgrid[:96, :128]
    frames = random.normal(0, 3, (40, 96, 128)) + 4 * random.normal(size=(96, 128)) * (columns >= 64)
    for k, frame in enumerate(frames):
        frame += 3 * np.sin(2 * np.pi * (columns / 20 + rows / 23 + k / 7)) * (columns < 64)
    above = measure_noise(frames + 1000, 30.0)
    assert not above.together
    about = measure_noise(frames, 30.0)
    assert about.region == above.region
    assert about.terms.tvh.value == pytest.approx(above.terms.tvh.value, rel=1e-9)


def test_noise_is_read_where_nothing_moves() -> None:
    """Something soft that wanders over the flattest place, which no truth tells of."""
    frames = rendered(9, (40, 128, 160), {"kind": "white"}).astype(np.float64)
    rows, columns = np.mgrid[:128, :160]
    frames += 25 * np.sin(columns / 4) * (columns < 80)
    for k in range(40):
        frames[k] += 30 * np.exp(-((columns - 90 - 1.5 * k) ** 2 + (rows - 30) ** 2) / 50)
    report = measure_noise(frames, 30.0)
    assert not report.together
    assert report.region.x >= 80
    assert report.region.y >= 30
    assert report.terms.tvh.value == pytest.approx(10, rel=0.02)
    forced = measure_noise(frames, 30.0, Region(88, 4, 64, 56))
    assert forced.together
    assert forced.terms.tvh.value > 10.5
    assert any("region=X,Y,W,H names a place that is still" in text for _, text in noise_lines(forced))


CROSSED = """\
frames: 30
camera: {size: [128, 96], netd_mk: 60}
background: {kind: ground, spread_k: 0}
targets:
  - id: car
    shape: {kind: point, area_m2: 2}
    path: {kind: straight, start: [20, 48], speed: 3, range_m: 1000}
"""


def test_noise_is_read_off_the_boxes_of_the_truth(tmp_path: Path) -> None:
    scene = tmp_path / "crossed.yaml"
    scene.write_text(CROSSED)
    taken = taken_by_targets(open_source(scene), 0, 30)
    assert taken is not None
    assert taken[48, 20]
    assert taken[48, 107]
    assert not taken[:30].any()
    assert not taken[66:].any()
    first = taken_by_targets(open_source(scene), 0, 1)
    assert first is not None
    assert first.sum() < 200
    done = CliRunner().invoke(app, ["noise", str(scene), "--json"])
    found = json.loads(done.stdout)
    assert not found["crossed"]
    assert not taken[Region(*found["region"]).rows, Region(*found["region"]).columns].any()
    forced = CliRunner().invoke(app, ["noise", str(scene), "--region", "30,20,64,64"]).stdout
    assert "targets pass through 30,20,64,64, where noise is read: --region X,Y,W,H names a place without" in forced
    fitted = CliRunner().invoke(app, ["fit", str(scene), "--region", "30,20,64,64"]).stdout
    assert "Note: targets pass through 30,20,64,64, where noise is read" in fitted


def test_truth_moves_a_region_off_its_targets_and_no_other() -> None:
    """With windows that targets crossed left out of those alike, the middle one of the rest was another."""
    rng = np.random.default_rng(3)
    frames = 1000 + 10 * rng.standard_normal((8, 128, 256)) + 0.02 * np.arange(256)
    place = flattest(frames, 65535)
    taken = np.zeros((128, 256), bool)
    beside = 192 if place.x < 128 else 0
    taken[:, beside : beside + 60] = True
    assert flattest(frames, 65535, taken) == place
    taken = np.zeros((128, 256), bool)
    taken[place.y + 20, place.x + 20] = True
    moved = flattest(frames, 65535, taken)
    assert not moved.of(taken).any()


def test_a_moving_background_is_told_and_noise_found_all_the_same() -> None:
    rows, columns = np.mgrid[:48, :48]
    scene = np.stack([80 * np.sin((columns + 2 * k) / 9) * np.cos(rows / 11) for k in range(40)])
    frames = rendered(5, (40, 48, 48), {"kind": "white"}) + scene
    report = measure_noise(frames, 30.0, Region(0, 0, 48, 48))
    assert report.together
    assert report.temporal.pair.value > 11  # the scene's own change is in it
    assert report.fine == pytest.approx(10, rel=0.02)
    assert fine_sigma(np.zeros((4, 8, 8))) == 0


@pytest.mark.parametrize(("speed", "moves"), [(0.3, True), (0.0, False)])
def test_a_slow_background_is_told_where_neighbouring_frames_are_alike(speed: float, moves: bool) -> None:
    rows, columns = np.mgrid[:64, :64]
    scene = np.stack([12 * np.sin((columns + speed * k) / 9) * np.cos(rows / 11) for k in range(80)])
    report = measure_noise(rendered(6, (80, 64, 64), {"kind": "white"}) + scene, 30.0, Region(0, 0, 64, 64))
    assert report.together == moves
    assert report.fine == pytest.approx(10, rel=0.02)
    assert any("motion" in text for _, text in noise_lines(report)) == moves


@pytest.mark.parametrize("text", ["1,2,3", "a,b,c,d", "0,0,99,10", "0,0,3,10", "-1,0,8,8"])
def test_a_region_outside_is_one_clear_error(text: str) -> None:
    assert parse_region("1,2,30,40", (64, 48)) == Region(1, 2, 30, 40)
    with pytest.raises(InputError, match=rf"^region '{text}': .*; allowed: x,y,w,h"):
        parse_region(text, (64, 48))
