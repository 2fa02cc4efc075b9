"""The bar: where it stands, and how a turning camera sees it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.occluders import OCCLUDERS, Occluder
from irsim.physics.radiometry import radiance
from irsim.types import Box

STAGE = SceneContext(0, Geometry((160, 120), 5e-4, 0.3), 30.0, "lwir", 0.6)


def drawn(turn: tuple[float, float, float] = (0, 0, 0), **keys: Any) -> Sprite | None:
    keys = {"center_px": [50.0, 40.0], "size_px": [10.0, 30.0], "range_m": 100.0} | keys
    value = OCCLUDERS.parse({"kind": "bar", **keys})
    assert isinstance(value, Occluder)
    return value.draw(CameraPose(STAGE, STAGE.geometry, STAGE.geometry.rotation(np.array(turn)), np.zeros(3)))


def test_an_unturned_camera_sees_it_where_it_was_put() -> None:
    sprite = drawn(center_px=[50.3, 40.7])
    assert sprite is not None
    assert (sprite.box.cx, sprite.box.cy, sprite.box.w, sprite.box.h) == pytest.approx((50.3, 40.7, 10, 30))
    assert sprite.center == pytest.approx((50.3, 40.7), abs=1e-6)
    assert sprite.cover.sum() == pytest.approx(300)
    assert sprite.range_m == 100.0


def test_it_hides_all_behind_it_and_shines_as_its_temperature() -> None:
    sprite = drawn(temperature_k=310.0, emissivity=0.9)
    assert sprite is not None
    inner = (40 - sprite.y0, 50 - sprite.x0)
    assert sprite.alpha[inner] == pytest.approx(1.0)
    assert sprite.emission[inner] == pytest.approx(0.9 * radiance("lwir", 310.0))


def test_it_turns_clockwise() -> None:
    # At 90 degrees width and height change places; at 30 the box is w cos + h sin wide.
    quarter, third = drawn(angle_deg=90.0), drawn(angle_deg=30.0)
    assert quarter is not None
    assert third is not None
    assert (quarter.box.w, quarter.box.h) == pytest.approx((30, 10))
    assert third.box.w == pytest.approx(10 * np.sqrt(3) / 2 + 30 / 2)
    # Clockwise: the end of a tall bar that was on top leans to the right.
    top = third.cover[: third.cover.shape[0] // 3]
    assert top.sum(axis=0) @ (third.x0 + np.arange(top.shape[1])) / top.sum() > 50


def test_a_turning_camera_sees_it_move_the_other_way() -> None:
    # 2 mrad to the right at 0.5 mrad a pixel: 4 px to the left, times cos of the elevation (0.3 rad).
    sprite = drawn(turn=(0.002, 0.0, 0.0), center_px=[79.5, 59.5])
    assert sprite is not None
    assert sprite.center[0] == pytest.approx(79.5 - 4 * np.cos(0.3), abs=0.01)


def test_out_of_sight_there_is_nothing() -> None:
    assert drawn(center_px=[-40.0, 40.0]) is None
    assert drawn(turn=(np.pi, 0.0, 0.0)) is None


def test_only_what_the_frame_can_see_is_drawn() -> None:
    sprite = drawn(size_px=[1000.0, 20.0])
    assert sprite is not None
    assert sprite.box.w == pytest.approx(1000)
    assert sprite.alpha.shape[1] <= 180  # the frame and what blurs into it
    seen = sprite.alpha[40 - sprite.y0, -sprite.x0 : 160 - sprite.x0]
    np.testing.assert_allclose(seen, 1.0, atol=1e-9)


@pytest.mark.parametrize("kind", [name for name, _ in OCCLUDERS])
def test_a_drawing_that_is_kept_cannot_be_changed(kind: str) -> None:
    """The next frames are given the same arrays."""
    asked = OCCLUDERS.parse({"kind": kind, "hides": "car", "frames": [0, 9], "range_m": 100.0})
    assert isinstance(asked, Occluder)
    placed = asked.over(Box(80.0, 60.0, 20.0, 10.0), 1.0, STAGE)
    first, second = (placed.draw(CameraPose.first(STAGE)) for _ in range(2))
    assert first is not None
    if first is second:
        assert not any(array.flags.writeable for array in (first.cover, first.alpha, first.emission))
