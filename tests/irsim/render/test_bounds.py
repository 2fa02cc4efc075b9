"""Bounds of one frame: against closed forms, dense algebra and fits to drawn frames; wrong input."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from position_fits import correlated, drawn, fit, gaussian, with_noise
from quiet_scenes import small
from scipy.special import ndtr

import irsim
from irsim.render.bounds import ClutterBound, FrameInformation
from irsim.render.detectability import whitened
from irsim.render.fisher import FrameNoise, pixel_information, position_covariance, quantised_information
from irsim.render.interval_error import predicted_errors

PSF_PX = 0.8
POLE = {"kind": "pole", "foot_px": (14.3, 31.0), "height_px": 28.0, "width_px": 2.0, "range_m": 500.0}


def scene(d: float = 30.0, frames: int = 4, **other: Any) -> irsim.Scenario:
    """Return a scene of a point whose d is nearly the given one, far above rounding."""
    camera = {"psf_px": PSF_PX, **other.pop("camera", {})}
    made = small(frames=frames, camera=camera, **other)
    return with_noise(made, irsim.bounds(with_noise(made, 1.0), stop=1)[0].d / d)


def test_gaussian_point_has_the_analytic_bound() -> None:
    """The image of a point is a Gaussian over the pixels' areas: a difference of error functions on each axis."""
    scenario = scene(shape={"kind": "point", "area_m2": 1e-4, "temperature_k": 1000.0})
    moments = irsim.Moments(scenario)
    total = moments.contribution(0, "one").sum()

    def line(at: float) -> tuple[np.ndarray, np.ndarray]:
        edges = (np.arange(33) - 0.5 - at) / PSF_PX
        density = np.exp(-(edges**2) / 2) / (math.sqrt(2 * math.pi) * PSF_PX)
        return np.diff(ndtr(edges)), -np.diff(density)

    (across, across_slope), (down, down_slope) = line(15.3), line(15.8)
    D = total * np.stack([np.outer(down, across_slope), np.outer(down_slope, across), np.outer(down, across)])
    J = np.einsum("iab,jab->ij", D, D / moments.variance(0, fixed=False))
    exact = np.sqrt(np.diag(np.linalg.inv(J)))
    found = irsim.bounds(scenario, stop=1)[0]
    assert found.sd_x == pytest.approx(exact[0], rel=0.005)
    assert found.sd_y == pytest.approx(exact[1], rel=0.005)
    assert found.d == pytest.approx(math.sqrt(J[2, 2]), rel=0.005)


@pytest.mark.parametrize(
    "noise",
    [
        [{"kind": "white"}],
        [{"kind": "noise_3d", "t": 1.0, "tv": 0.7, "th": 0.5, "tvh": 1.0}],
        [{"kind": "white"}, {"kind": "ar1", "over": "row", "rho": 0.5}],
        [{"kind": "white"}, {"kind": "ar1", "over": "column", "rho": 0.5}, {"kind": "bad_pixels", "dead": 0.1}],
    ],
    ids=["white", "3d", "rows", "columns"],
)
def test_region_holds_the_information_of_the_whole_frame(noise: list[dict[str, Any]]) -> None:
    """Against V of the whole frame as a dense matrix: 1e-6; a point at the left of 48x32 px."""
    side = (48, 32)
    scenario = scene(camera={"noise": noise, "size": side})
    information = FrameInformation(scenario)
    found, whole = information.derivatives(0, "one"), information.derivatives(0, "one", whole=True)
    assert found is not None
    assert whole is not None
    assert found.values.size < whole.values.size
    row, column, frame = information.renderer.sensor.common_variance(0)
    down, across = np.divmod(np.arange(math.prod(side)), side[0])
    common = row * (down[:, None] == down) + column * (across[:, None] == across) + frame
    variance = irsim.Moments(scenario).variance(0, fixed=False).ravel()
    works = np.isfinite(variance)
    V = (common + np.diag(np.where(works, variance, 1.0) - row - column - frame))[np.ix_(works, works)]
    D = whole.values.reshape(3, -1)[:, works]
    dense = D @ np.linalg.solve(V, D.T)
    np.testing.assert_allclose(information.of(0, found), dense, rtol=1e-6, atol=1e-6 * np.abs(dense).max())
    assert information.of(0, found, background=True)[3, 3] > 0


@pytest.mark.parametrize("case", ["white", "occluded", "lines"])
def test_fits_reach_the_bound(case: str) -> None:
    """Root mean square error over the bound of 600 fits, axes pooled: within 4 standard errors, 12 %, of 1."""
    draws = 600
    other: dict[str, Any] = {}
    if case == "occluded":
        other = {"occluders": [POLE]}
    elif case == "lines":
        other = {"camera": {"noise": [{"kind": "noise_3d", "t": 1.0, "tv": 0.7, "th": 0.5, "tvh": 1.0}]}}
    scenario = scene(frames=draws, **other)
    variance = irsim.Moments(scenario).variance(0, fixed=False).ravel()
    score = gaussian(variance)
    if case == "lines":
        row, column, frame = FrameInformation(scenario).renderer.sensor.common_variance(0)
        down, across = np.divmod(np.arange(32 * 32), 32)
        common = row * (down[:, None] == down) + column * (across[:, None] == across) + frame
        score = correlated(common + np.diag(variance - row - column - frame))
    bound = irsim.bounds(scenario, stop=1)[0]
    errors = fit(scenario, drawn(scenario, draws), score, steps=4) / [bound.sd_x, bound.sd_y]
    assert np.sqrt((errors**2).mean()) == pytest.approx(1, abs=4 / math.sqrt(4 * draws))


def test_information_of_rounded_and_clipped_counts() -> None:
    """Coarse noise: 1 / (sigma² + 1/12) within 1 %; fine noise: that of a coin; clipped: half of the information and
    more, by symmetry."""
    mean = np.linspace(100, 101, 9)
    fine = quantised_information(mean, np.full(9, 1.0), 4095)
    np.testing.assert_allclose(fine, 1 / (1 + 1 / 12), rtol=0.01)
    at_edge = quantised_information(np.array([100.5]), np.array([0.1]), 4095)[0]
    assert at_edge == pytest.approx(2 / math.pi / 0.01, rel=1e-4)  # of the sign alone
    at_middle = 2 * (math.exp(-12.5) / math.sqrt(2 * math.pi)) ** 2 / (0.01 * ndtr(-5.0))
    assert quantised_information(np.array([100.0]), np.array([0.1]), 4095)[0] == pytest.approx(at_middle, rel=1e-6)
    below, above = (quantised_information(np.array([mu]), np.array([3.0]), 255)[0] for mu in (0.0, 255.0))
    assert below == pytest.approx(above, rel=1e-9)
    assert 0.5 / (9 + 1 / 12) < below < 1 / 9
    assert quantised_information(np.array([-40.0]), np.array([3.0]), 255)[0] < 1e-12
    dead = pixel_information(np.array([[np.inf, 4.0]]), np.array([[50.0, 50.0]]), 255)
    np.testing.assert_allclose(dead, [[0, 0.25]])


def test_less_is_known_in_background_clutter_and_rounding() -> None:
    """Each further unknown raises the bound; without clutter that bound is the headline."""
    scenario = irsim.loads(CLUTTERED)
    row = irsim.bounds(scenario, ["a"], 1, 2, clutter=True)[0]
    assert row.sd_x_background is not None
    assert row.sd_x_clutter is not None
    assert row.d_clutter is not None
    assert row.sd_x <= row.sd_x_background
    assert 1.02 * row.sd_x < row.sd_x_clutter
    assert row.d_clutter < row.d
    assert row.d_clutter == pytest.approx(math.sqrt(irsim.Detectability(scenario).d2(1, "a")), rel=1e-3)
    flat = scene(camera={"size": (96, 96)}, background={"kind": "sky", "horizon_k": 290.0, "zenith_k": 290.0})
    found = FrameInformation(flat).derivatives(0, "one")
    assert found is not None
    assert ClutterBound(flat).of(0, found)[0] == pytest.approx(irsim.bounds(flat, stop=1)[0].sd_x, rel=1e-3)


def test_interval_error_of_simulated_peaks() -> None:
    """Highest peak of a matched filter in a gate of 41 px at d = 4, 800 draws: within 20 %."""
    rng, gate, side, sigma, step = np.random.default_rng(5), 41.0, 54, 1.2, 0.25
    x, middle, places = np.arange(side), (side - 1) / 2, np.arange(-gate / 2, gate / 2 + 1e-9, step)
    bank = np.exp(-((x - middle - places[:, None]) ** 2) / (2 * sigma**2))
    bank /= np.linalg.norm(bank, axis=1, keepdims=True)
    line = np.exp(-((x - middle) ** 2) / (2 * sigma**2))
    point = np.outer(line, line) / (line @ line)
    for d in (4.0,):
        errors = []
        for _ in range(800):
            output = bank @ (rng.standard_normal((side, side)) + d * point) @ bank.T
            errors.append(places[list(np.unravel_index(output.argmax(), output.shape))])
        found = predicted_errors(np.eye(2) * 2 * sigma**2 / d**2, d, gate)
        assert found[0] == pytest.approx(float(np.sqrt(np.mean(np.square(errors)))), rel=0.2), d


def test_prediction_stands_below_d_of_10_only() -> None:
    strong, weak = irsim.bounds(scene(30), stop=1)[0], irsim.bounds(scene(4), stop=1)[0]
    assert strong.predicted_x is None
    assert weak.predicted_x is not None
    assert weak.predicted_x > 2 * weak.sd_x
    wide = irsim.bounds(scene(4), stop=1, gate_px=60)[0].predicted_x
    assert wide is not None
    assert wide > weak.predicted_x


def test_coloured_bound_of_dense_covariance() -> None:
    """J by conjugate gradients equals D' V^-1 D with the dense covariance of a periodic clutter."""
    rng, side = np.random.default_rng(2), 16
    spectrum = np.abs(np.fft.fft2(rng.standard_normal((side, side)))) ** 2
    first = np.fft.ifft2(spectrum).real
    down, across = np.divmod(np.arange(side * side), side)
    V = first[(down[:, None] - down) % side, (across[:, None] - across) % side] + 30 * np.eye(side * side)
    D = rng.standard_normal((3, side, side))
    solved = np.stack([whitened(part, np.full((side, side), 30.0), spectrum) for part in D])
    flat = D.reshape(3, -1)
    np.testing.assert_allclose(flat @ solved.reshape(3, -1).T, flat @ np.linalg.solve(V, flat.T), rtol=1e-6, atol=1e-9)


def test_singular_information_has_no_bound() -> None:
    assert position_covariance(np.zeros((3, 3))) is None
    assert position_covariance(np.ones((3, 3))) is None
    noise = FrameNoise(np.zeros((4, 4)), row=1.0)
    assert not noise.information(np.ones((3, 4, 4)), (0, 0, 4, 4)).any()


CLUTTERED = """
seed: 3
frames: 4
camera: {size: [96, 72], netd_mk: 40}
background: {kind: ground}
targets:
  - {id: a, shape: {kind: point, scr: 6}, path: {kind: straight, start: [40, 36], speed: 1, range_m: 3000}}
  - {id: away, shape: {kind: point}, path: {kind: straight, start: [400, 50], speed: 0, range_m: 3000}}
"""


@pytest.mark.parametrize(
    ("overrides", "arguments", "message"),
    [
        ([], {"targets": ["b"]}, "target: there is no 'b'; allowed: a, away"),
        ([], {"targets": ["away"]}, "target away: is in view in none of the frames 0:4"),
        ([], {"gate_px": 0}, "gate_px 0: allowed"),
        ([], {"start_error_px": -1, "targets": ["a"]}, "start_error_px -1: allowed"),
        (["camera.netd_mk=0"], {}, "camera: has no temporal noise"),
        (["without=[a, away]"], {}, "targets: there are none"),
    ],
)
def test_wrong_input_is_one_clear_line(overrides: list[str], arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(irsim.InputError, match=message) as caught:
        irsim.bounds(irsim.loads(CLUTTERED, overrides=overrides), **arguments)
    assert "\n" not in str(caught.value)


def test_targets_out_of_view_have_no_rows() -> None:
    assert {row.target for row in irsim.bounds(irsim.loads(CLUTTERED))} == {"a"}
    with pytest.raises(irsim.InputError, match="bounds"):
        irsim.bounds("sky")
