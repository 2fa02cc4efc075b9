"""The contract of every occluder: coverage, hiding, determinism, camera motion; bars in detail."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from target_views import centroid

from irsim import loads
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.occluders import OCCLUDERS, Occluder
from irsim.physics.radiometry import radiance
from irsim.render.frame import Renderer
from irsim.types import Box

CONTEXT = SceneContext(0, Geometry((160, 120), 5e-4, 0.3), 30.0, "lwir", 0.6)
WINDOW = Box(80.0, 40.0, 20.0, 10.0)


def placed(kind: str, window: Box = WINDOW) -> Occluder:
    value = OCCLUDERS.parse({"kind": kind, "id": "it", "hides": "car", "frames": [0, 9], "range_m": 100.0})
    assert isinstance(value, Occluder)
    return value.covering(window, 1.0, CONTEXT)


def pose(turn: tuple[float, float, float] = (0, 0, 0), place: tuple[float, float, float] = (0, 0, 0)) -> CameraPose:
    geometry = CONTEXT.geometry
    return CameraPose(CONTEXT, geometry, geometry.rotation(np.array(turn, float)), np.array(place, float), 0.1)


def scene(kind: str, target: str = "start: [40, 40]") -> str:
    return f"""\
frames: 12
camera: {{size: [96, 64], netd_mk: 0}}
background: {{kind: ground}}
targets:
  - {{id: car, shape: {{kind: car}}, path: {{kind: straight, {target}, speed: 2, range_m: 600}}}}
occluders:
  - {{kind: {kind}, id: it, hides: car, frames: [4, 6], range_m: 90}}
"""


@pytest.mark.parametrize("kind", [name for name, _ in OCCLUDERS])
class TestEveryOccluder:
    def test_it_covers_its_window_and_no_pixel_twice(self, kind: str) -> None:
        for window in (WINDOW, Box(60.3, 50.2, 6.0, 25.0)):
            sprite = placed(kind, window).draw(pose())
            assert sprite is not None
            rows = slice(round(window.top) + 2 - sprite.y0, round(window.bottom) - 1 - sprite.y0)
            columns = slice(round(window.left) + 2 - sprite.x0, round(window.right) - 1 - sprite.x0)
            assert sprite.cover[rows, columns].size > 0
            assert sprite.cover[rows, columns].min() > (0.85 if placed(kind).translucent else 0.999)
            assert sprite.cover.min() > -1e-6
            assert sprite.cover.max() < 1 + 1e-6
            assert sprite.range_m == pytest.approx(100.0)

    def test_drawings_are_equal_and_read_only(self, kind: str) -> None:
        first, second = (placed(kind).draw(pose()) for _ in range(2))
        assert first is not None
        assert second is not None
        for name in ("cover", "alpha", "emission"):
            np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
        if first is second:  # cached for the next frames
            assert not any(array.flags.writeable for array in (first.cover, first.alpha, first.emission))

    def test_it_moves_against_a_turning_camera(self, kind: str) -> None:
        # 2 mrad to the right at 0.5 mrad a pixel: 4 px to the left, times the cosine of the elevation (0.3 rad).
        still, turned = placed(kind).draw(pose()), placed(kind).draw(pose((0.002, 0.0, 0.0)))
        assert still is not None
        assert turned is not None
        assert turned.box.cx - still.box.cx == pytest.approx(-4 * np.cos(0.3), abs=0.2)
        assert placed(kind).draw(pose((np.pi, 0.0, 0.0))) is None
        nearer = placed(kind).draw(pose(place=(0.0, 0.0, 20.0)))
        assert nearer is not None
        assert nearer.range_m == pytest.approx(80, rel=0.01)

    def test_it_hides_its_target_unless_switched_off(self, kind: str) -> None:
        renderer, without = Renderer(loads(scene(kind))), Renderer(loads(scene(kind), overrides=["without=[it]"]))
        (hidden,), (seen,) = (each.scene(5)[1].targets for each in (renderer, without))
        assert hidden.visible is not None
        assert hidden.visible < 0.02
        assert hidden.occluders == ("it",)
        assert seen.visible == pytest.approx(1)
        assert seen.occluders == ()
        assert hidden.center == seen.center


def bar(turn: tuple[float, float, float] = (0, 0, 0), **keys: Any) -> Sprite | None:
    keys = {"center_px": [50.0, 40.0], "size_px": [10.0, 30.0], "range_m": 100.0} | keys
    value = OCCLUDERS.parse({"kind": "bar", **keys})
    assert isinstance(value, Occluder)
    return value.draw(pose(turn))


class TestBar:
    def test_it_is_drawn_exactly_in_its_place(self) -> None:
        sprite = bar(center_px=[50.3, 40.7], temperature_k=310.0, emissivity=0.9)
        assert sprite is not None
        assert (sprite.box.cx, sprite.box.cy, sprite.box.w, sprite.box.h) == pytest.approx((50.3, 40.7, 10, 30))
        assert sprite.center == pytest.approx((50.3, 40.7), abs=1e-6)
        np.testing.assert_allclose(centroid(sprite, sprite.cover), sprite.center, atol=1e-9)
        assert sprite.cover.sum() == pytest.approx(300)
        inner = (40 - sprite.y0, 50 - sprite.x0)
        assert sprite.alpha[inner] == pytest.approx(1.0)
        assert sprite.emission[inner] == pytest.approx(0.9 * radiance("lwir", 310.0))

    def test_it_turns_clockwise(self) -> None:
        # At 30 degrees the box is w cos + h sin wide, and the upper end lies to the right.
        third = bar(angle_deg=30.0)
        assert third is not None
        assert third.box.w == pytest.approx(10 * np.sqrt(3) / 2 + 30 / 2)
        top = third.cover[: third.cover.shape[0] // 3]
        assert top.sum(axis=0) @ (third.x0 + np.arange(top.shape[1])) / top.sum() > 50

    def test_only_the_part_in_view_is_drawn(self) -> None:
        assert bar(center_px=[-40.0, 40.0]) is None
        sprite = bar(size_px=[1000.0, 20.0])
        assert sprite is not None
        assert sprite.box.w == pytest.approx(1000)
        assert sprite.alpha.shape[1] <= 180  # the frame and the blur around it
        seen = sprite.alpha[40 - sprite.y0, -sprite.x0 : 160 - sprite.x0]
        np.testing.assert_allclose(seen, 1.0, atol=1e-9)
