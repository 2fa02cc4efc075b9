"""Noise is measured as it was put in: unbiased, and inside the stated interval at the stated rate."""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom
from typer.testing import CliRunner

from irsim import commands_measure
from irsim.cli import app
from irsim.detector import NOISES, Moment, Noise
from irsim.detector.response import Electrons, Setting
from irsim.errors import InputError
from irsim.measure import Region, defects, flattest, measure_noise, noise_3d, parse_region, taken_by_targets, temporal
from irsim.measure.memory import fit_memory, time_freedom
from irsim.measure.noise import fine_sigma, noise_lines
from irsim.measure.noise_3d import TERMS, components, mean_squares
from irsim.sources import open_source
from irsim.types import Floats

REAL = Path(__file__).resolve().parents[2] / "shared" / "real"
real = pytest.mark.skipif(not REAL.is_dir(), reason=f"real recordings are not there: {REAL}")


def rendered(seed: int, shape: tuple[int, int, int], *noises: dict[str, Any]) -> Floats:
    """(T, rows, columns) of the detector's own noise terms on an even picture; NETD is 10."""
    frames = np.full(shape, 1000.0, np.float32)
    response = Electrons().response(Setting("mwir", 14, 40.0, (220.0, 400.0)))
    for number, given in enumerate(noises):
        noise = NOISES.parse({"id": f"n{number}", **given})
        assert isinstance(noise, Noise)
        for k, frame in enumerate(frames):
            zero = np.zeros(shape[1:], np.float32)
            moment = Moment(k, shape[1:], 30.0, seed)
            noise.add(zero, response, moment)
            frame += zero * np.float32(10 / response.noise)
            steady = noise.steady(moment)
            if steady is not None:
                frame += 10 * steady
    return frames


def test_components_undo_the_expected_mean_squares() -> None:
    """From E[MS_q] = sum over terms p that hold q of (elements averaged over) s_p, written out by hand."""
    times, rows, columns = 5, 7, 11
    s = {"t": 2.0, "v": 3.0, "h": 5.0, "tv": 7.0, "th": 11.0, "vh": 13.0, "tvh": 17.0}
    squares = {
        "t": 17 + columns * 7 + rows * 11 + rows * columns * 2,
        "v": 17 + columns * 7 + times * 13 + times * columns * 3,
        "h": 17 + rows * 11 + times * 13 + times * rows * 5,
        "tv": 17 + columns * 7,
        "th": 17 + rows * 11,
        "vh": 17 + times * 13,
        "tvh": 17,
    }
    found = components({k: np.array(float(v)) for k, v in squares.items()}, (times, rows, columns))
    assert {k: float(v) for k, v in found.items()} == pytest.approx(s)


def test_mean_squares_split_the_whole_sum_of_squares() -> None:
    frames = np.random.default_rng(0).normal(50, 3, (5, 7, 11))
    freedom = {"t": 4, "v": 6, "h": 10, "tv": 24, "th": 40, "vh": 60, "tvh": 240}
    total = sum(freedom[k] * v for k, v in mean_squares(frames).items())
    assert total == pytest.approx(np.square(frames - frames.mean()).sum())


def test_one_term_alone_is_told_from_the_others() -> None:
    """Offsets of sample variance exactly 1 in one direction give a sigma of 1 there and 0 elsewhere."""
    shape = (6, 8, 10)
    for axis, term in enumerate("tvh"):
        steps = np.arange(shape[axis], dtype=float)
        steps = (steps - steps.mean()) / steps.std(ddof=1)
        sides = [1, 1, 1]
        sides[axis] = -1
        found = noise_3d(np.broadcast_to(steps.reshape(sides), shape))
        for name in TERMS:
            assert getattr(found, name).value == pytest.approx(float(name == term), abs=1e-6), (term, name)


SIGMAS = {"t": 0.3, "v": 0.4, "h": 0.5, "tv": 0.25, "th": 0.35, "vh": 0.6, "tvh": 1.0}


@lru_cache
def many() -> tuple[Any, ...]:
    """The terms of 60 scenes with all seven in them."""
    given = {"kind": "noise_3d", **SIGMAS}
    return tuple(noise_3d(rendered(seed, (24, 20, 22), given)) for seed in range(60))


def at_least(held: int, of: int) -> None:
    """A 95 % interval holds in `held` of `of` draws: neither of the binomial's 1 in 10^4 ends."""
    low, high = binom.interval(1 - 2e-4, of, 0.95)
    assert low <= held <= high, (held, of)


@pytest.mark.parametrize("term", TERMS)
def test_each_term_lies_in_its_interval_at_the_stated_rate(term: str) -> None:
    true = 10 * SIGMAS[term]
    found = [getattr(terms, term) for terms in many()]
    at_least(sum(x.low <= true <= x.high for x in found), len(found))
    variances = np.array([x.value**2 for x in found])
    error = variances.std(ddof=1) / math.sqrt(len(found))
    assert abs(variances.mean() - true**2) < 4 * error  # unbiased


WHITE, CORRELATED, RHO, PIXEL = 1.0, 0.8, 0.8, 0.5


@lru_cache
def remembering() -> tuple[Any, ...]:
    """Figures of 40 scenes with white noise, AR(1) noise and fixed pattern."""
    given = (
        {"kind": "white", "ratio": WHITE},
        {"kind": "ar1", "ratio": CORRELATED, "rho": RHO},
        {"kind": "fixed_pattern", "pixel": PIXEL, "column": 0.3, "row": 0.2},
    )
    return tuple(measure_noise(rendered(seed, (120, 36, 36), *given), 30.0, Region(0, 0, 36, 36)) for seed in range(40))


@pytest.mark.parametrize(
    ("name", "true"),
    [
        ("white", 10 * WHITE),
        ("correlated", 10 * CORRELATED),
        ("total", 10 * math.hypot(WHITE, CORRELATED)),
        ("rho", RHO),
        ("time_constant_s", -1 / (30 * math.log(RHO))),
        ("pixel", 10 * PIXEL),
    ],
)
def test_memory_lies_in_its_interval_at_the_stated_rate(name: str, true: float) -> None:
    found = [getattr(report.temporal.memory, name) for report in remembering()]
    at_least(sum(x.low <= true <= x.high for x in found), len(found))


@pytest.mark.parametrize(("term", "true"), [("v", 2.0), ("h", 3.0), ("vh", 5.0), ("tvh", 10 * math.hypot(1, 0.8))])
def test_terms_lie_in_their_intervals_beside_memory(term: str, true: float) -> None:
    found = [getattr(report.terms, term) for report in remembering()]
    at_least(sum(x.low <= true <= x.high for x in found), len(found))


def test_lag_correlations_are_those_of_the_process() -> None:
    """White of variance 1 and AR(1) of variance .64, rho .8: correlation .64 x .8^k / 1.64 at lag k."""
    for number, lag in enumerate((1, 2, 3, 5, 9, 18, 36)):
        true = 0.64 * RHO**lag / 1.64
        found = [report.temporal.correlation[number] for report in remembering()]
        assert remembering()[0].temporal.lags[number] == lag
        at_least(sum(x.low <= true <= x.high for x in found), len(found))


def test_white_noise_has_no_memory() -> None:
    for seed in range(20):
        found = temporal(rendered(seed, (60, 32, 32), {"kind": "white"}), 30.0)
        assert found.memory is None
        assert found.pair.value == pytest.approx(10, rel=0.03)
        assert abs(found.correlation[0].value) < 0.03


def test_a_curve_of_differences_gives_its_parameters() -> None:
    lags = (1, 2, 3, 5, 9, 18, 36)
    curve = np.array([0.5 + 2.0 * (1 - 0.9**k) for k in lags])
    white, correlated, decay = fit_memory(lags, curve)
    assert (white, correlated, math.exp(-decay)) == pytest.approx((0.5, 2.0, 0.9), rel=1e-3)


def test_freedom_of_white_noise_is_one_less_than_the_frames() -> None:
    assert time_freedom(None, 40) == 39
    memory = remembering()[0].temporal.memory
    assert 20 < time_freedom(memory, 120) < 119


def test_a_drifting_frame_is_drift_and_no_memory() -> None:
    frames = rendered(1, (60, 32, 32), {"kind": "white"})
    frames += np.arange(60, dtype=np.float32)[:, None, None] * 0.5  # 15 counts a second at 30 Hz
    report = measure_noise(frames, 30.0)
    assert report.slope_per_s == pytest.approx(15, rel=0.01)
    assert report.temporal.memory is None


def test_the_flattest_window_is_found() -> None:
    frames = rendered(2, (8, 128, 160), {"kind": "white"}).astype(np.float64)
    rows, columns = np.mgrid[:128, :160]
    frames += 100 * np.sin(rows / 3) * ((columns < 90) | (rows < 56))
    assert flattest(frames, 65535) == Region(96, 64, 64, 64) or flattest(frames, 65535).x >= 88


def test_a_blown_out_corner_is_not_called_flat() -> None:
    frames = rendered(3, (8, 128, 128), {"kind": "white"}).astype(np.float64)
    frames[:, :64, :64] = 4095
    region = flattest(frames, 4095)
    assert region.x >= 64 or region.y >= 64


def test_bad_pixels_are_counted_by_kind() -> None:
    frames = rendered(4, (60, 64, 64), {"kind": "white"}, {"kind": "fixed_pattern"})
    frames[:, 5, 9] = 0
    frames[:, 30, 30] = frames[0, 30, 30]
    frames[:, 40, 12] += 500
    frames[10:30, 50, 50] += 200
    found = defects(frames)
    assert sorted(map(tuple, np.argwhere(found.dead).tolist())) == [(5, 9), (30, 30)]
    assert np.argwhere(found.hot).tolist() == [[40, 12]]
    assert np.argwhere(found.blinking).tolist() == [[50, 50]]
    report = measure_noise(frames)
    assert report.terms.tvh.value == pytest.approx(10, rel=0.05)
    assert (report.dead, report.hot, report.blinking) == (2, 1, 1)


@pytest.mark.parametrize("sigma", [0.3, 0.6, 2.0])
def test_what_does_not_happen_to_change_is_not_called_dead(sigma: float) -> None:
    """Whole counts hide noise below one: in few frames good pixels hold their value, in enough only a dead one does."""
    rng = np.random.default_rng(8)
    frames = np.rint(rng.uniform(100, 101, (64, 96)) + rng.normal(0, sigma, (400, 64, 96)))
    frames[:, 20, 30] = 100
    assert ((frames[:12] == frames[0]).all(axis=0).sum() > 100) == (sigma == 0.3)  # good ones, by chance
    few = measure_noise(frames[:12])
    assert (few.dead, few.frozen_from is not None and few.frozen_from > 12) == (0, True)
    assert any("12 frames are too few to tell dead pixels" in text for _, text in noise_lines(few))
    assert np.argwhere(defects(frames).dead).tolist() == [[20, 30]]
    assert not any("too few" in text for _, text in noise_lines(measure_noise(frames)))


def test_where_most_pixels_never_change_none_is_called_dead_for_it() -> None:
    frames = np.full((40, 32, 32), 7.0)
    frames[5, :8] += 1
    report = measure_noise(frames)
    assert (report.dead, report.frozen_from) == (0, None)
    assert any("most pixels never change" in text for _, text in noise_lines(report))


def test_noise_is_read_where_nothing_moves() -> None:
    """Something soft that wanders over the flattest place, which no truth tells of."""
    frames = rendered(9, (40, 128, 160), {"kind": "white"}).astype(np.float64)
    rows, columns = np.mgrid[:128, :160]
    frames += 25 * np.sin(columns / 4) * (columns < 80)
    for k in range(40):
        frames[k] += 30 * np.exp(-((columns - 90 - 1.5 * k) ** 2 + (rows - 30) ** 2) / 50)
    report = measure_noise(frames)
    assert not report.moves
    assert report.region.x >= 80
    assert report.region.y >= 30
    assert report.terms.tvh.value == pytest.approx(10, rel=0.02)
    forced = measure_noise(frames, 30.0, Region(88, 4, 64, 56))
    assert forced.moves
    assert forced.terms.tvh.value > 10.5
    assert any("--region X,Y,W,H names a place that is still" in text for _, text in noise_lines(forced))


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
    assert "targets pass through 30,20,64,64: --region X,Y,W,H names a place without them" in forced
    fitted = CliRunner().invoke(app, ["fit", str(scene), "--region", "30,20,64,64"]).stdout
    assert "Note: targets pass through 30,20,64,64, where noise is read" in fitted


def test_ridges_and_tracks_are_no_bad_pixels() -> None:
    frames = rendered(7, (40, 64, 64), {"kind": "white"})
    rows, columns = np.mgrid[:64, :64]
    frames += (300 * np.exp(-np.square((rows - columns * 0.7 - 5) / 1.5))).astype(np.float32)
    for k in range(40):
        frames[k, 50, 10 + k] += 400
    assert not defects(frames).all.any()


def test_a_moving_background_is_told_and_noise_found_all_the_same() -> None:
    rows, columns = np.mgrid[:48, :48]
    scene = np.stack([80 * np.sin((columns + 2 * k) / 9) * np.cos(rows / 11) for k in range(40)])
    frames = rendered(5, (40, 48, 48), {"kind": "white"}) + scene
    report = measure_noise(frames, 30.0, Region(0, 0, 48, 48))
    assert report.moves
    assert report.temporal.pair.value > 11  # the scene's own change is in it
    assert report.fine == pytest.approx(10, rel=0.02)
    assert fine_sigma(np.zeros((4, 8, 8))) == 0


@pytest.mark.parametrize(("speed", "moves"), [(0.3, True), (0.0, False)])
def test_a_slow_background_is_told_where_neighbouring_frames_are_alike(speed: float, moves: bool) -> None:
    rows, columns = np.mgrid[:64, :64]
    scene = np.stack([12 * np.sin((columns + speed * k) / 9) * np.cos(rows / 11) for k in range(80)])
    report = measure_noise(rendered(6, (80, 64, 64), {"kind": "white"}) + scene, 30.0, Region(0, 0, 64, 64))
    assert report.moves == moves
    assert report.fine == pytest.approx(10, rel=0.02)
    assert any("motion" in text for _, text in noise_lines(report)) == moves


@pytest.mark.parametrize("shape", [(3, 32, 32), (10, 3, 32)])
def test_too_little_is_one_clear_error(shape: tuple[int, int, int]) -> None:
    with pytest.raises(InputError, match=r"too (few|small)"):
        measure_noise(np.ones(shape))


@pytest.mark.parametrize("text", ["1,2,3", "a,b,c,d", "0,0,99,10", "0,0,3,10", "-1,0,8,8"])
def test_a_region_outside_is_one_clear_error(text: str) -> None:
    assert parse_region("1,2,30,40", (64, 48)) == Region(1, 2, 30, 40)
    with pytest.raises(InputError, match="allowed: x,y,w,h"):
        parse_region(text, (64, 48))


def test_the_input_is_not_changed() -> None:
    frames = rendered(6, (12, 32, 32), {"kind": "white"})
    frames[:, 4, 4] = 0
    before = frames.copy()
    measure_noise(frames)
    np.testing.assert_array_equal(frames, before)


SCENE = """\
frames: 40
camera:
  size: [64, 64]
  netd_mk: 300
  noise: [{kind: white}, {kind: fixed_pattern, pixel: 0.5, column: 0, row: 0}]
background: {kind: ground, spread_k: 0}
targets: []
"""


def test_the_command_measures_a_rendered_scene(tmp_path: Path) -> None:
    scene = tmp_path / "even.yaml"
    scene.write_text(SCENE)
    done = CliRunner().invoke(app, ["noise", str(scene), "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    tvh, vh = found["terms"]["tvh"], found["terms"]["vh"]
    assert vh["value"] / tvh["value"] == pytest.approx(0.5, rel=0.06)
    lines = CliRunner().invoke(app, ["noise", str(scene), "--frames", "4:20", "--region", "0,0,16,16"])
    assert "region   0,0,16,16 (x,y,w,h px), 16 frames" in lines.stdout
    few = CliRunner().invoke(app, ["noise", str(scene), "--frames", "2"])
    assert isinstance(few.exception, InputError)
    assert "2 frames are too few" in str(few.exception)
    with pytest.raises(InputError, match="of 40 frames"):
        commands_measure._span("50:60", 40)


def raw(name: str) -> Floats:
    with np.load(REAL / name / "frames.npz") as file:
        return np.asarray(file["frames"])


@real
def test_a_cooled_corrected_sensor() -> None:
    """The data's README: pair 1.75, tvh 1.65, lag-1 correlation .01, fixed pixel .66, drift .35 counts."""
    report = measure_noise(raw("raw14_lwir"), top=16383)
    assert report.temporal.pair.value == pytest.approx(1.75, rel=0.05)
    assert report.terms.tvh.value == pytest.approx(1.65, rel=0.08)
    assert report.temporal.memory is None
    assert report.temporal.correlation[0].value == pytest.approx(0.01, abs=0.02)
    assert report.terms.vh.value == pytest.approx(0.66, rel=0.1)
    assert report.drift == pytest.approx(0.35, abs=0.05)


@real
def test_a_cooled_uncorrected_sensor() -> None:
    """The data's README: tvh 3.3, lag-1 -.01, fixed pixel 16, column 3, row 52 over odd and even rows."""
    report = measure_noise(raw("raw14_mwir"), top=16383)
    assert report.terms.tvh.value == pytest.approx(3.3, rel=0.08)
    assert report.temporal.memory is None
    assert report.terms.vh.value == pytest.approx(16, rel=0.1)
    assert report.terms.h.low < 3.5
    assert report.terms.v.value > 5 * report.terms.h.value


@real
def test_an_uncooled_sensor_remembers() -> None:
    """The data's README: AR(1) with rho about .9; lag-1 .74 to .89; tvh 1.4 to 3.5; pixel 2.5 to 6.4."""
    report = measure_noise(raw("raw16_lepton"), 9.0)
    memory = report.temporal.memory
    assert memory is not None
    assert memory.rho.value == pytest.approx(0.9, abs=0.03)
    assert 1.4 < memory.total.value < 3.5
    assert 2.5 < report.terms.vh.value < 6.4
    assert 0.5 < report.temporal.pair.value < 2.1
    assert 0.8 < report.drift < 17
