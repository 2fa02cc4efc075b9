"""Mean, contribution and variance against frames; the Cramér-Rao bound is in tests/validation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from quiet_scenes import SMALL_PATH as PATH
from quiet_scenes import small as scene

import irsim
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
    scenario = scene(frames=200, camera=camera)
    frames = np.stack([frame.image for frame in Rendering(scenario).frames()]).astype(np.float64)
    moments = Moments(scenario)
    # 1024 pixels of 200 frames each: the mean of their variances is known to 0.3 %.
    ratio = frames.var(axis=0, ddof=1) / moments.variance(0)
    assert ratio.mean() == pytest.approx(1, abs=0.012)
    z = (frames.mean(axis=0) - moments.mean(0)) / np.sqrt(moments.variance(0) / 200)
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


@pytest.mark.parametrize(("kind", "camera"), [("point", CAMERAS[1]), ("fighter", CAMERAS[2])])
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


def test_a_contribution_to_recorded_frames_is_their_change(tmp_path: Path) -> None:
    """Noisy footage with and without the target: the difference of the frames, but for rounding both."""
    shape = {"kind": "fighter", "temperature_k": 330.0}
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
    for shift in ((float("nan"), 0.0), 5, (1.0, 2.0, 3.0), ("a", "b"), ((1, 2), 3)):
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
