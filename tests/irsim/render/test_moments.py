"""Mean, contribution and variance against frames, and the Cramér-Rao bound."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from quiet_scenes import SMALL_PATH as PATH
from quiet_scenes import small as scene

import irsim
from irsim.render.frame import Renderer
from irsim.render.moments import Exact, Moments
from irsim.render.stream import Rendering
from irsim.scenario.model import Scenario

CAMERAS: list[dict[str, Any]] = [
    {},
    {"detector": {"kind": "electrons", "integration_ms": 5.0}, "range_k": (220.0, 400.0)},
    {"optics": {"f_number": 4.0}, "psf_px": 0.3, "smear": {"time_ms": 10.0, "steps": 3}, "falloff": {}},
    {"time_constant_ms": 10.0, "noise": [{"kind": "white"}, {"kind": "ar1", "rho": 0.9}]},
]


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_mean_is_that_of_quiet_frames(camera: dict[str, Any]) -> None:
    quiet = {**camera, "noise": [], "netd_mk": 0.0}
    scenario = scene(camera=camera)
    frame = Rendering(scene(camera=quiet)).frame(2).image
    mean = Moments(scenario).mean(2)
    assert mean.dtype == np.float64
    # Counts are rounded; the frames' light is summed up in float32.
    np.testing.assert_allclose(mean, frame, atol=0.5 + 0.02)


@pytest.mark.parametrize("camera", CAMERAS[:2])
def test_variance_is_that_of_many_frames(camera: dict[str, Any]) -> None:
    scenario = scene(frames=400, camera=camera)
    frames = np.stack([frame.image for frame in Rendering(scenario).frames()]).astype(np.float64)
    moments = Moments(scenario)
    # 1024 pixels of 400 frames each: the mean of their variances is known to 0.3 %.
    ratio = frames.var(axis=0, ddof=1) / moments.variance(0)
    assert ratio.mean() == pytest.approx(1, abs=0.012)
    z = (frames.mean(axis=0) - moments.mean(0)) / np.sqrt(moments.variance(0) / 400)
    assert np.abs(z).max() < 5


def test_temporal_variance_leaves_out_fixed_noise() -> None:
    """In squares of one NETD white noise has 1, correlated 0.25 and fixed pattern 2.25 + 0.64 + 0.16; rounding 1/12."""
    noise = [
        {"kind": "white"},
        {"kind": "ar1", "ratio": 0.5, "rho": 0.9},
        {"kind": "fixed_pattern", "pixel": 1.5, "column": 0.8, "row": 0.4},
    ]
    scenario = scene(camera={"netd_mk": 50.0, "noise": noise})
    moments, unit = Moments(scenario), scenario.camera.response().noise ** 2
    np.testing.assert_allclose(moments.variance(1, fixed=False), 1.25 * unit + 1 / 12, rtol=1e-5)
    np.testing.assert_allclose(moments.variance(1), (1.25 + 3.05) * unit + 1 / 12, rtol=1e-5)


@pytest.mark.parametrize(("kind", "camera"), [("point", CAMERAS[1]), ("fighter", CAMERAS[2]), ("hot_spot", CAMERAS[1])])
def test_a_contribution_follows_its_shift_smoothly(kind: str, camera: dict[str, Any]) -> None:
    """Differences over 0.02 px and over 0.005 px give the same derivative; no step of float32 is in it."""
    moments = Moments(scene({"kind": kind}, camera=camera))

    def slope(step: float) -> Exact:
        ahead, behind = (moments.contribution(0, "one", (0.2 + side * step, 0.1)) for side in (1, -1))
        return (ahead - behind) / (2 * step)

    wide, narrow = slope(0.01), slope(0.0025)
    assert moments.contribution(0, "one").dtype == np.float64
    assert np.abs(wide).max() > 1
    np.testing.assert_allclose(narrow, wide, atol=5e-3 * np.abs(wide).max())
    tiny = moments.contribution(0, "one", (1e-9, 0.0)) - moments.contribution(0, "one")
    assert np.abs(tiny).max() < 1e-6 * np.abs(wide).max()


def test_a_shift_equals_a_shifted_path() -> None:
    shape = {"kind": "hot_spot"}
    moved = scene(shape).model_dump()
    moved["targets"][0]["path"]["start"] = (15.3 + 0.37, 15.8 - 0.21)
    elsewhere = Moments(Scenario.model_validate(moved)).contribution(1, "one")
    shifted = Moments(scene(shape)).contribution(1, "one", (0.37, -0.21))
    np.testing.assert_allclose(shifted, elsewhere, atol=2e-3 * np.abs(elsewhere).max())


def test_contributions_and_the_empty_scene_add_to_the_mean() -> None:
    two = [
        {"id": name, "shape": {"kind": "point", "area_m2": 0.3}, "path": {**PATH, "start": (x, 15.0)}}
        for name, x in (("one", 8.0), ("two", 24.0))
    ]
    scenario = scene(targets=two)
    moments = Moments(scenario)
    empty = Moments(scenario, without=("one", "two")).mean(1)
    parts = empty + moments.contribution(1, "one") + moments.contribution(1, "two")
    np.testing.assert_allclose(parts, moments.mean(1), atol=1e-6)


def test_a_hidden_target_contributes_nothing() -> None:
    bar = {"kind": "bar", "center_px": (15.0, 15.0), "size_px": (20.0, 20.0), "range_m": 500.0}
    hidden = Moments(scene(occluders=[bar]))
    assert np.abs(hidden.contribution(0, "one")).max() < 1e-6 * np.abs(Moments(scene()).contribution(0, "one")).max()
    open_ = Moments(scene(occluders=[bar]), without=("bar",))
    np.testing.assert_array_equal(open_.contribution(0, "one"), Moments(scene()).contribution(0, "one"))


def test_indices_of_moments_count_frames_that_arrive() -> None:
    """Of frames 0 .. 3 arrive 0, 2, 2, 3: of its own number only the first and the last. Shot noise tells variances."""
    shape, path = {"kind": "hot_spot", "temperature_k": 315.0}, {**PATH, "speed": 3.0, "start": (8.0, 16.0)}
    target = {"id": "one", "shape": shape, "path": path}
    faults = [{"kind": "drop", "frames": [1]}, {"kind": "duplicate", "frames": [2]}]
    camera = {"detector": {"kind": "electrons", "integration_ms": 5.0}, "noise": [{"kind": "shot"}]}
    whole = Moments(scene(targets=[target], camera=camera))
    moments = Moments(scene(targets=[target], camera={**camera, "faults": faults}))
    for index, taken in enumerate([0, 2, 2, 3]):
        np.testing.assert_array_equal(moments.mean(index), whole.mean(taken))
        np.testing.assert_array_equal(moments.variance(index), whole.variance(taken))
        np.testing.assert_array_equal(moments.contribution(index, "one"), whole.contribution(taken, "one"))
    assert not np.array_equal(whole.mean(1), whole.mean(2))
    assert not np.array_equal(whole.variance(1), whole.variance(2))
    for index in (-1, 4):
        with pytest.raises(IndexError):
            moments.mean(index)
    all_arrive = Moments(moments.scenario, without=("drop", "duplicate"))
    np.testing.assert_array_equal(all_arrive.mean(1), whole.mean(1))


def test_signal_center_differs_from_the_centroid_of_contrast() -> None:
    """The sky behind is as warm as most of a car: what the car adds has its centroid elsewhere."""
    car = {"kind": "car"}
    target = {"id": "one", "shape": car, "path": {**PATH, "start": (32.0, 24.0), "range_m": 150.0}}
    camera = {"size": (64, 48), "netd_mk": 0.0}

    def found(kelvin: float) -> tuple[tuple[float, float], Exact]:
        sky = {"kind": "sky", "horizon_k": kelvin, "zenith_k": kelvin}
        scenario = scene(targets=[target], camera=camera, background=sky, atmosphere={"surroundings_k": 280.0})
        (truth,) = Rendering(scenario).truths(0, 1)
        added = Moments(scenario).contribution(0, "one")
        rows, columns = np.indices(added.shape)
        own = truth.targets[0].signal_center
        assert own is not None
        return own, np.array([(columns * added).sum(), (rows * added).sum()]) / added.sum()

    (own, of_cold), (same, of_warm) = found(100.0), found(290.0)
    assert own == same
    np.testing.assert_allclose(of_cold, own, atol=0.02)
    assert np.hypot(*(of_warm - own)) > 0.3


@pytest.mark.parametrize(
    "shape", [{"kind": "fighter", "temperature_k": 330.0}, {"kind": "point", "area_m2": 50.0, "temperature_k": 400.0}]
)
def test_a_contribution_to_recorded_frames_is_their_change(tmp_path: Path, shape: dict[str, Any]) -> None:
    """Noisy footage with and without the target: the difference of the frames, but for rounding both."""
    own = irsim.record(
        Rendering(scene(camera={"netd_mk": 200.0, "range_k": (220.0, 1200.0)}, targets=[])), tmp_path / "own.mcap"
    )
    recorded = {"kind": "recording", "file": str(own)}
    moments = Moments(scene(shape, background=recorded))
    with_it, without = (
        Rendering(each).frame(2).image.astype(float)
        for each in (scene(shape, background=recorded), scene(background=recorded, targets=[]))
    )
    added = moments.contribution(2, "one")
    np.testing.assert_allclose(added, with_it - without, atol=0.5 + 0.02)
    assert abs(added).max() > 20
    moved, step = moments.contribution(2, "one", (0.01, 0.0)), moments.contribution(2, "one", (0.02, 0.0))
    np.testing.assert_allclose(step - added, 2 * (moved - added), atol=0.02 * abs(step - added).max())
    for unknown in (moments.mean, moments.variance):
        with pytest.raises(irsim.InputError, match="the noise of a recording is not known"):
            unknown(2)


def test_wrong_arguments_of_moments_are_input_errors() -> None:
    moments = Moments(scene())
    with pytest.raises(irsim.InputError, match="there is no 'two'; allowed: one"):
        moments.contribution(0, "two")
    for shift in ((float("nan"), 0.0), 5, (1.0, 2.0, 3.0), (0.0, float("inf")), ("a", "b"), ((1, 2), 3)):
        with pytest.raises(irsim.InputError, match="is no shift; allowed: two finite numbers"):
            moments.contribution(0, "one", shift)  # type: ignore[arg-type]  # some are no pairs
    for call in (moments.mean, moments.variance, partial(moments.contribution, target="one")):
        with pytest.raises(irsim.InputError, match=r"frame 0\.5: allowed: a whole number, 0 to"):
            call(0.5)  # type: ignore[arg-type]  # no frame
    with pytest.raises(irsim.InputError, match=r"region: .* is not within 32x32 px"):
        moments.mean(0, (30, 0, 8, 8))
    with pytest.raises(irsim.InputError, match="without: there is no 'fog'; allowed: one, white"):
        Moments(scene(), without=("fog",))
    with pytest.raises(IndexError):
        moments.mean(4)


DRAWS = 2000


@pytest.mark.parametrize(
    ("shape", "optics"),
    [({"kind": "point", "area_m2": 0.5, "temperature_k": 400.0}, {"f_number": 4.0}), ({"kind": "fighter"}, None)],
)
def test_a_least_squares_fit_reaches_the_cramer_rao_bound(shape: dict[str, Any], optics: Any) -> None:
    """Least squares for place and amplitude of the rendered target, 20 times the noise, in 2,000 noisy frames.

    The Fisher information of independent Gaussian pixels is J^T diag(1/variance) J, J the derivatives of
    the mean (Kay, Fundamentals of Statistical Signal Processing, vol. 1, ch. 3). A standard deviation of
    2,000 draws is known to 1.6 %.
    """
    target = dict(shape)
    camera = {"optics": optics, "psf_px": 0.6 if optics is None else 0.3, "range_k": (200.0, 900.0)}
    peak = np.abs(Moments(scene(target, camera=camera)).contribution(0, "one")).max()
    response = scene(target, camera=camera).camera.response()
    # The camera's noise is set so that the target's peak is 20 times as high.
    netd = scene(target).camera.netd_mk * peak / 20 / response.noise
    scenario = scene(target, DRAWS, camera={**camera, "netd_mk": float(netd)})
    moments = Moments(scenario)
    variance, mean = moments.variance(0), moments.mean(0)
    assert np.abs(moments.contribution(0, "one")).max() / np.sqrt(np.median(variance)) == pytest.approx(20, rel=0.03)

    def drawn(x: float, y: float) -> Exact:
        return moments.contribution(0, "one", (x, y)).ravel()

    step, own = 0.01, drawn(0, 0)
    along, down = ((drawn(*at) - drawn(*(-a for a in at))) / (2 * step) for at in ((step, 0.0), (0.0, step)))
    second = [
        (drawn(step, 0) + drawn(-step, 0) - 2 * own) / step**2,
        (drawn(step, step) + drawn(-step, -step) - drawn(step, -step) - drawn(-step, step)) / (4 * step**2),
        (drawn(0, step) + drawn(0, -step) - 2 * own) / step**2,
    ]
    weight = 1 / variance.ravel()
    jacobian = np.stack([along, down, own], axis=1)
    bound = np.sqrt(np.diag(np.linalg.inv((jacobian.T * weight) @ jacobian)))

    renderer = Renderer(scenario)
    light = renderer.light(0)  # of all frames: the target stands
    images = np.stack([renderer.sensor.expose(light, index).ravel() for index in range(DRAWS)])
    residuals: Exact = images.astype(np.float64) - mean.ravel()
    found = np.zeros((DRAWS, 3))  # x, y, amplitude less one
    for _ in range(4):  # Gauss-Newton; within a few hundredths of a pixel the second order is exact enough
        x, y, more = found.T[:, :, None]
        shape_ = own + x * along + y * down + x**2 / 2 * second[0] + x * y * second[1] + y**2 / 2 * second[2]
        left = residuals - ((1 + more) * shape_ - own)
        across = along + x * second[0] + y * second[1]
        upright = down + x * second[1] + y * second[2]
        slopes = np.stack([(1 + more) * across, (1 + more) * upright, shape_], axis=1)
        normal = np.einsum("dip,djp,p->dij", slopes, slopes, weight, optimize=True)
        right = np.einsum("dip,dp,p->di", slopes, left, weight, optimize=True)
        found += np.linalg.solve(normal, right[..., None])[..., 0]
    np.testing.assert_allclose(found.std(axis=0, ddof=1), bound, rtol=0.05)
    assert np.all(np.abs(found.mean(axis=0)) < 4 * bound / np.sqrt(DRAWS))
