"""Noise is measured as it was put in: unbiased, and inside the stated interval at the stated rate."""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from even_noise import rendered
from scipy.stats import binom
from typer.testing import CliRunner

from irsim.cli.app import app
from irsim.errors import InputError
from irsim.measure import Region, measure_noise, noise_3d, temporal
from irsim.measure.memory import time_freedom
from irsim.measure.noise_3d import TERMS, components, mean_squares
from irsim.measure.stretch import Breaks, Stretch
from irsim.measure.words import noise_lines


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


@pytest.mark.parametrize("term", ["tv", "th", "vh", "tvh"])
def test_an_interval_is_as_wide_as_its_term_scatters(term: str) -> None:
    """1.96 standard deviations to either side, which 60 scenes tell within 9 %; of terms along one axis, with some 20
    degrees of freedom, the intervals are wider than that."""
    found = [getattr(terms, term) for terms in many()]
    reach = np.mean([(x.high - x.low) / 2 for x in found])
    assert reach == pytest.approx(1.96 * np.std([x.value for x in found], ddof=1), rel=0.15)


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
        ("fixed", 10 * PIXEL),
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


def test_noise_that_outlasts_the_recording_is_told_as_such() -> None:
    """Over 60 frames noise of a memory of 2000 is as good as fixed pattern: no interval leaves out the true values."""
    for seed in range(6):
        noise = {"kind": "ar1", "ratio": 3.0, "rho": math.exp(-1 / 2000)}
        report = measure_noise(rendered(seed, (60, 36, 36), noise), 30.0, Region(0, 0, 36, 36))
        memory = report.temporal.memory
        assert memory is not None
        assert memory.time_constant_s.high == math.inf
        assert memory.correlated.low < 30 < memory.correlated.high
        assert (memory.fixed.low, report.terms.vh.low) == (0, 0)
        assert any("noise goes on for longer than 60 frames" in text for _, text in noise_lines(report))
        json.loads(json.dumps(report.as_json(), allow_nan=False))


def test_white_noise_has_no_memory() -> None:
    for seed in range(20):
        found = temporal(rendered(seed, (60, 32, 32), {"kind": "white"}), 30.0)
        assert found.memory is None
        assert found.pair.value == pytest.approx(10, rel=0.03)
        assert abs(found.correlation[0].value) < 0.03


def test_freedom_of_white_noise_is_one_less_than_the_frames() -> None:
    assert time_freedom(None, np.arange(40)) == 39
    memory = remembering()[0].temporal.memory
    assert 20 < time_freedom(memory, np.arange(120)) < 119


def test_a_drifting_frame_is_drift_and_no_memory() -> None:
    frames = rendered(1, (60, 32, 32), {"kind": "white"})
    frames += np.arange(60, dtype=np.float32)[:, None, None] * 0.5  # 15 counts a second at 30 Hz
    report = measure_noise(frames, 30.0)
    assert report.slope_per_s == pytest.approx(15, rel=0.01)
    assert report.temporal.memory is None


@pytest.mark.parametrize("shape", [(3, 32, 32), (10, 3, 32)])
def test_too_little_is_one_clear_error(shape: tuple[int, int, int]) -> None:
    with pytest.raises(InputError, match=r"too (few|small)"):
        measure_noise(np.ones(shape), 30.0)


def test_the_rate_has_to_be_said() -> None:
    """Time constants in seconds are wrong without it: measured at 30 Hz, those of 9 Hz come out at a third."""
    unsaid: Any = measure_noise
    with pytest.raises(TypeError, match="rate_hz"):
        unsaid(np.ones((8, 32, 32)))


def test_the_input_is_not_changed() -> None:
    frames = rendered(6, (12, 32, 32), {"kind": "white"})
    frames[:, 4, 4] = 0
    before = frames.copy()
    measure_noise(frames, 30.0)
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
    assert "of a sensor" not in lines.stdout
    own = CliRunner().invoke(app, ["noise", str(scene), "--frames", "4:20", "camera.bits=8"])
    assert "gain control" not in own.stdout
    assert "note     noise is 0.39 counts as measured, hardly more than rounding" in own.stdout
    assert "rounding" not in lines.stdout
    few = CliRunner().invoke(app, ["noise", str(scene), "--frames", "2"])
    assert isinstance(few.exception, InputError)
    assert "2 frames are too few" in str(few.exception)
    many = CliRunner().invoke(app, ["noise", str(scene), "--frames", "9999"])
    assert "--frames 9999: no such range; allowed: " in str(many.exception)


def test_one_frame_that_repeats_is_told_as_one() -> None:
    one = Stretch(recorded=3, repeats=1, lost=0, breaks=Breaks(), index=(0, 2), number=(0, 1), rate_hz=30.0, slower=1.0)
    assert list(one.left_out(0)) == ["1 of 3 frames repeats the one before bit for bit: it does not count"]


@pytest.mark.parametrize("rate_hz", [np.float32(30), np.int64(30)])
def test_a_rate_of_numpys_ends_in_plain_values(rate_hz: Any) -> None:
    frames = rendered(1, (20, 32, 32), {"kind": "white"})
    told = measure_noise(frames, rate_hz).as_json()
    assert json.loads(json.dumps(told)) == json.loads(json.dumps(measure_noise(frames, 30.0).as_json()))
