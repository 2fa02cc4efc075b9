"""Frames and truth: centroids, order, switches, velocity, contrast."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from quiet_scenes import standing as scene

import irsim
from irsim.render.frame import Renderer
from irsim.render.stream import Rendering
from irsim.targets import SHAPES
from irsim.types import Floats


def centroid(light: Floats) -> tuple[float, float]:
    y, x = np.indices(light.shape)
    total = light.sum(dtype=np.float64)
    return float((x * light).sum(dtype=np.float64) / total), float((y * light).sum(dtype=np.float64) / total)


@pytest.mark.parametrize("shape", SHAPES.kinds)
def test_center_and_signal_center_of_each_shape(shape: str) -> None:
    """The signal center is the centroid of the light; a shift of a hundredth of a pixel is exact."""
    light, truth = Renderer(scene(shape=shape, x=79.501, y=60.123)).scene(0)
    (x, y), (target,) = centroid(light), truth.targets
    assert target.signal_center == pytest.approx((x, y), abs=0.01)
    (shifted,) = Renderer(scene(shape=shape, x=79.511, y=60.123)).scene(0)[1].targets
    assert np.subtract(shifted.center, target.center) == pytest.approx([0.01, 0], abs=1e-3)


def test_signal_center_with_a_contrast_factor() -> None:
    """The centroid of the faded target, whose background shines through."""
    contrast = 0.3
    path = {"kind": "straight", "start": (80.3, 60.2), "speed": 0.0, "range_m": 150.0}
    car = {"id": "one", "shape": {"kind": "car"}, "path": path}
    sky = {"kind": "sky", "horizon_k": 290.0, "zenith_k": 290.0}
    usual, other = (Renderer(scene(targets=[{**car, "contrast": share}], background=sky)) for share in (1.0, contrast))
    (seen,), (truth,), (own,) = other.drawn_targets(0), other.scene(0)[1].targets, usual.scene(0)[1].targets
    sprite = seen.piece.sprite
    x, y = centroid(sprite.emission)
    assert truth.signal_center == pytest.approx((x + sprite.x0, y + sprite.y0), abs=1e-3)
    assert truth.signal_center is not None
    assert own.signal_center is not None
    assert np.hypot(*np.subtract(truth.signal_center, own.signal_center)) > 0.05


NOISY: dict[str, Any] = {
    "camera": {
        "size": (160, 120),
        "noise": [{"kind": "white"}, {"kind": "fixed_pattern"}, {"kind": "ar1", "rho": 0.9}],
        "motion": [{"kind": "pan", "azimuth_deg_s": 0.3}, {"kind": "jitter"}],
    },
    "background": {"kind": "sky", "clouds": [{"wind_mrad_s": (2.0, 0.0)}]},
}


def test_a_frame_alone_equals_the_frame_in_sequence() -> None:
    scenario = scene(frames=20, **NOISY)
    ordered = [frame.image for frame, _ in irsim.frames(scenario)]
    alone = Rendering(scenario)
    for index in (19, 0, 17, 8):
        assert np.array_equal(alone.frame(index).image, ordered[index])
    (part,) = [frame.image for frame, _ in irsim.frames(scenario, 13, 14)]
    assert np.array_equal(part, ordered[13])
    shorter = scenario.model_copy(update={"frames": 5})
    assert np.array_equal(Rendering(shorter).frame(4).image, ordered[4])


def test_truth_alone_is_the_truth_of_the_frames() -> None:
    rendering = Rendering(scene(frames=3, **NOISY))
    assert list(rendering.truths()) == [truth for _, truth in rendering.pairs()]


def test_without_a_target_only_its_pixels_change() -> None:
    scenario = scene(**NOISY)
    whole = Rendering(scenario).frame(2).image
    without = Rendering(scenario.model_copy(update={"without": ("one",)}))
    rows, columns = np.nonzero(whole != without.frame(2).image)
    box = next(iter(Rendering(scenario).truths(2))).targets[0].box
    reach = 8  # of the optics' blur
    assert rows.size > 20
    assert box.left - reach < columns.min() <= columns.max() < box.right + reach
    assert box.top - reach < rows.min() <= rows.max() < box.bottom + reach
    assert next(iter(without.truths(2))).targets == ()


def test_switching_off_one_noise_leaves_the_others() -> None:
    scenario = scene(**NOISY)
    both = Rendering(scenario).frame(1).image.astype(int)
    for name in ("white", "fixed_pattern", "ar1"):
        less = Rendering(scenario.model_copy(update={"without": (name,)})).frame(1).image.astype(int)
        assert np.std(both - less) > 0.5
    none = scenario.model_copy(update={"without": ("white", "fixed_pattern", "ar1")})
    still = Rendering(none.model_copy(update={"camera": none.camera.model_copy(update={"netd_mk": 0.0})}))
    assert np.array_equal(Rendering(none).frame(1).image, still.frame(1).image)


def test_no_velocity_for_a_target_just_from_behind_the_camera() -> None:
    path = {"kind": "straight_m", "start_m": (0.0, 0.0, -50.0), "velocity_m_s": (0.0, 0.0, 3000.0)}
    targets = [{"id": "one", "shape": {"kind": "point"}, "path": path}]
    truths = list(Rendering(scene(targets=targets)).truths())
    assert [len(truth.targets) for truth in truths] == [0, 1, 1, 1]  # at -50, 50, 150, 250 m
    assert truths[1].targets[0].velocity is None
    assert truths[2].targets[0].velocity == pytest.approx((0, 0), abs=1e-9)


def test_contrast_is_the_difference_of_temperatures() -> None:
    shape = {"kind": "point", "temperature_k": 400.0, "area_m2": 1.0, "emissivity": 1.0}
    path = {"kind": "straight", "start": (80.0, 60.0), "speed": 0.0, "range_m": 1500.0}
    sky = {"kind": "sky", "horizon_k": 250.0, "zenith_k": 250.0}
    targets = [{"id": "one", "shape": shape, "path": path}]
    (target,) = next(iter(Rendering(scene(targets=targets, background=sky)).truths())).targets
    assert target.contrast_k == pytest.approx(150, abs=0.1)


def test_a_frame_past_the_end_is_an_index_error() -> None:
    with pytest.raises(IndexError, match="frames 0 to 3"):
        Rendering(scene()).frame(4)


@pytest.mark.parametrize("pitch", [-40.0, 40.0])
def test_a_target_outside_the_picture_has_no_scr(pitch: float) -> None:
    """A slanted missile that moves out past a corner of the picture: one way its body leaves it before its box does."""
    target = {
        "id": "one",
        "shape": {"kind": "missile"},
        "path": {"kind": "straight", "start": (5.0, 5.0), "speed": 0.5, "heading_deg": 225.0, "range_m": 1500.0},
        "attitude_deg": (90.0, pitch, 0.0),
    }
    scenario = scene(
        60, targets=[target], camera={"size": (160, 120), "ifov_mrad": 0.05}, background={"kind": "ground"}
    )
    seen = [truth.targets[0] for truth in irsim.Rendering(scenario).truths()]
    assert all((each.scr is None) == (each.visible is not None and each.visible < 1e-9) for each in seen)
    assert any(each.scr is not None for each in seen)
    if pitch < 0:
        assert any(each.scr is None and min(each.box.right, each.box.bottom) > 1 for each in seen)
