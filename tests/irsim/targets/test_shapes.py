"""What bodies and points look like."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_files import GIVEN
from pydantic import ValidationError

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.sprite import Sprite
from irsim.motion.attitude import euler
from irsim.physics.radiometry import radiance
from irsim.targets import SHAPES, Shape, View, draw_shapes
from irsim.targets.body import Body
from irsim.types import Floats

IFOV = 5e-4
OFF_AXIS = math.cos(math.atan(IFOV * math.hypot(30.3 - 79.5, 40.8 - 59.5)))
"""Cosine of the angle between the optical axis and the pixel (30.3, 40.8)."""
AWAY = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
BODIES = [name for name, kind in SHAPES if issubclass(kind, Body)]


def context(psf_px: float = 0.6) -> SceneContext:
    return SceneContext(0, Geometry((160, 120), IFOV), 30.0, "mwir", psf_px)


def shape(kind: str, **keys: Any) -> Shape:
    value = SHAPES.parse({"kind": kind, **GIVEN.get(kind, {}), **keys})
    assert isinstance(value, Shape)
    return value


def seen(
    value: Shape,
    angles_deg: tuple[float, ...] = (90, 0, 0),
    at: tuple[float, float] = (79.5, 59.5),
    range_m: float = 1000.0,
    psf_px: float = 0.6,
) -> Sprite:
    where = context(psf_px)
    view = View(where.geometry.place(np.array(at), range_m), AWAY @ euler(np.array(angles_deg)), where)
    sprite = value.draw(view)
    assert sprite is not None
    return sprite


def middle(sprite: Sprite, cells: Floats) -> Floats:
    """Centroid of a sprite's array, px."""
    rows, columns = cells.shape
    x = cells.sum(axis=0) @ (sprite.x0 + np.arange(columns))
    y = cells.sum(axis=1) @ (sprite.y0 + np.arange(rows))
    return np.asarray(np.array([x, y]) / cells.sum())


def test_drawn_together_each_is_what_it_is_alone() -> None:
    where, rng = context(), np.random.default_rng(2)
    things = []
    for kind, _ in SHAPES:
        place = where.geometry.place(rng.uniform(20, 100, 2), 2000.0)
        things.append((shape(kind), View(place, AWAY @ euler(rng.uniform(-180, 180, 3)), where, 0.3)))
    things.append((things[1][0], View(np.array([0.0, 0.0, -10.0]), np.eye(3), where)))
    *together, behind = draw_shapes(things)
    assert behind is None
    for (value, view), sprite in zip(things, together, strict=False):
        alone = value.draw(view)
        assert alone is not None
        assert sprite is not None
        for name in ("cover", "alpha", "emission"):
            np.testing.assert_array_equal(getattr(sprite, name), getattr(alone, name))
        assert (sprite.center, sprite.signal_center, sprite.area) == (alone.center, alone.signal_center, alone.area)


@pytest.mark.parametrize("kind", [name for name, _ in SHAPES])
class TestEveryShape:
    def test_truth_is_the_centroid_of_its_own_pixels(self, kind: str) -> None:
        rng = np.random.default_rng(1)
        for _ in range(25):
            angles = tuple(rng.uniform(-180, 180, 3).tolist())
            sprite = seen(shape(kind), angles, tuple(rng.uniform(60, 62, 2).tolist()), 2000.0)
            np.testing.assert_allclose(middle(sprite, sprite.alpha), sprite.center, atol=1e-3)
            np.testing.assert_allclose(middle(sprite, sprite.emission), sprite.signal_center, atol=1e-3)

    def test_it_follows_a_hundredth_of_a_pixel(self, kind: str) -> None:
        # Far away, so that the shift of the direction turns the body by less than can be seen.
        value = shape(kind)
        for x in np.arange(60.0, 61.0, 0.13):
            here, there = (seen(value, (50, 20, 30), (x + d, 40.2), 4000.0) for d in (0.0, 0.01))
            np.testing.assert_allclose(np.subtract(there.center, here.center), [0.01, 0], atol=3e-5)

    def test_behind_the_camera_there_is_nothing(self, kind: str) -> None:
        assert shape(kind).draw(View(np.array([0.0, 0, -500]), np.eye(3), context())) is None

    def test_it_may_hang_out_of_the_frame(self, kind: str) -> None:
        inside, outside = (seen(shape(kind), at=(x, 60), range_m=6000) for x in (3, -1))
        assert outside.area == pytest.approx(inside.area, rel=5e-3)

    def test_emission_is_that_of_its_temperatures(self, kind: str) -> None:
        keys = type(shape(kind)).model_fields
        value = shape(kind, **{key: 0.8 for key in keys if key.endswith("emissivity")})
        given = {key: x for key, x in value.model_dump().items() if key.endswith("_k")}
        temperatures = [x for x in (*given.values(), *given.pop("materials_k", {}).values()) if isinstance(x, float)]
        sprite = seen(value, (30, 10, 0), psf_px=0.0)
        glow = sprite.emission[sprite.alpha > 0.01] / sprite.alpha[sprite.alpha > 0.01]
        low, high = (0.8 * float(radiance("mwir", kelvin)) for kelvin in (min(temperatures), max(temperatures)))
        assert glow.min() >= low - 1e-6 * high
        assert glow.max() <= high * (1 + 1e-6)


@pytest.mark.parametrize("kind", BODIES)
class TestEveryBody:
    def test_each_part_has_its_emissivity(self, kind: str) -> None:
        """Lit alone, all others at emissivity 0, the parts add up to the whole body, each as its emissivity says."""
        body = shape(kind)
        assert isinstance(body, Body)
        keys = [key for key in type(body).model_fields if key.endswith("_emissivity")]
        parts = {solid.heat.removesuffix("_k") for solid in body.solids} - {"temperature"}
        named = sorted(parts - {key.removesuffix("_emissivity") for key in keys})
        given = {"emissivity": 0.9, **dict.fromkeys(keys, 0.6), "emissivities": dict.fromkeys(named, 0.3)}
        none = dict.fromkeys(named, 0.0)
        dark: dict[str, Any] = {"emissivity": 0.0, **dict.fromkeys(keys, 0.0), "emissivities": none}
        alone = [{**dark, key: given[key]} for key in ("emissivity", *keys)]
        alone += [{**dark, "emissivities": {**none, name: 0.3}} for name in named]

        def emitted(values: dict[str, Any]) -> Floats:
            return seen(shape(kind, **values), (30, 10, 0)).emission

        whole = emitted(given)
        assert len(alone) > 1
        np.testing.assert_allclose(sum(map(emitted, alone)), whole, rtol=1e-9, atol=1e-9 * whole.max())
        assert emitted(dark).max() == 0
        if named:  # three times the emissivity, three times the light
            once, thrice = ({**dark, "emissivities": {**none, named[0]: e}} for e in (0.3, 0.9))
            np.testing.assert_allclose(emitted(thrice), 3 * emitted(once), rtol=1e-12, atol=1e-12 * whole.max())

    def test_the_emissivity_of_no_part_is_refused(self, kind: str) -> None:
        with pytest.raises(ValidationError, match="'wing_tip' is no part with an emissivity"):
            type(shape(kind)).model_validate({"emissivities": {"wing_tip": 0.5}})

    def test_blur_keeps_the_light(self, kind: str) -> None:
        sharp, soft = seen(shape(kind), psf_px=0.0), seen(shape(kind), psf_px=1.3)
        assert soft.alpha.sum() == pytest.approx(soft.cover.sum(), rel=1e-12)
        assert soft.emission.sum() == pytest.approx(sharp.emission.sum(), rel=1e-12)
        np.testing.assert_allclose(sharp.alpha, sharp.cover, atol=1e-12)

    @pytest.mark.sampled
    def test_its_area_is_that_of_sampled_hulls(self, kind: str) -> None:
        from scipy.spatial import ConvexHull

        value, where = shape(kind), context()
        assert isinstance(value, Body)
        rng = np.random.default_rng(7)
        for angles in rng.uniform(-180, 180, (4, 3)):
            range_m = 45.0 * value.length_m
            sprite = seen(value, tuple(angles.tolist()), range_m=range_m)
            turn = AWAY @ euler(angles)
            position = where.geometry.place(np.array([79.5, 59.5]), range_m)
            box = sprite.box
            x, y = np.meshgrid(
                np.arange(box.left - 2, box.right + 2, 0.07), np.arange(box.top - 2, box.bottom + 2, 0.07)
            )
            inside = np.zeros(x.shape, dtype=bool)
            joints = value.joints(0.0)
            for solid in value.solids:
                corners = np.array(solid.points)
                if solid.joint:
                    corners = corners @ joints[solid.joint].turn.T + joints[solid.joint].shift
                points = where.geometry.project(corners * value.length_m @ turn.T + position)
                planes = ConvexHull(points).equations
                inside |= np.all([a * x + b * y + c <= 0 for a, b, c in planes], axis=0)
            assert sprite.cover.sum() == pytest.approx(inside.sum() * 0.07**2, rel=5e-3)
            assert sprite.center[0] == pytest.approx(x[inside].mean(), abs=0.02)
            assert sprite.center[1] == pytest.approx(y[inside].mean(), abs=0.02)
            edges = [x[inside].min(), x[inside].max(), y[inside].min(), y[inside].max()]
            np.testing.assert_allclose([box.left, box.right, box.top, box.bottom], edges, atol=0.35)

    @settings(max_examples=60, deadline=None)
    @given(st.tuples(*[st.integers(-8, 8)] * 3), st.floats(0, 1), st.floats(0, 1))
    def test_special_attitudes_leave_no_streaks(
        self, kind: str, eighths: tuple[int, int, int], dx: float, dy: float
    ) -> None:
        sprite = seen(shape(kind), tuple(45.0 * eighth for eighth in eighths), (79.5 + dx, 59.5 + dy), 800.0)
        assert sprite.cover.min() > -1e-6
        assert sprite.cover.max() < 1 + 1e-6
        assert sprite.alpha[:, [0, -1]].max() < 1e-6

    def test_nothing_jumps_as_it_turns(self, kind: str) -> None:
        for yaw in range(0, 360, 20):
            before, after = (seen(shape(kind), (yaw + d, 10, 20), range_m=1500) for d in (0.0, 0.001))
            assert before.alpha.shape == after.alpha.shape
            np.testing.assert_allclose(after.alpha, before.alpha, atol=1e-3)
            np.testing.assert_allclose(after.emission, before.emission, atol=1e-3 * before.emission.max())

    def test_far_is_smaller_by_the_square_of_range(self, kind: str) -> None:
        near, far = (seen(shape(kind), range_m=range_m).cover.sum() for range_m in (5_000.0, 20_000.0))
        assert near / far == pytest.approx(16, rel=0.01)


class TestFighter:
    def test_broadside_it_is_as_long_as_its_length_over_its_range(self) -> None:
        # 15 m at 2000 m and 0.5 mrad a pixel: 15 px.
        assert seen(shape("fighter", length_m=15.0), (90, 0, 0), range_m=2000).box.w == pytest.approx(15, rel=2e-3)

    def test_head_on_it_is_much_smaller_than_from_above(self) -> None:
        above, head_on = (seen(shape("fighter"), angles).cover.sum() for angles in ((90, 0, 90), (180, 0, 0)))
        assert head_on < 0.2 * above

    def test_its_nose_hides_its_hot_nozzle(self) -> None:
        cold, hot = shape("fighter", engine_k=300.0), shape("fighter", engine_k=900.0)
        head_on = [seen(value, (180, 0, 0)).emission.sum() for value in (cold, hot)]
        tail_on = [seen(value, (0, 0, 0)).emission.sum() for value in (cold, hot)]
        assert head_on[1] == pytest.approx(head_on[0], rel=1e-9)
        assert tail_on[1] > 10 * tail_on[0]

    def test_the_signal_is_at_the_hot_end(self) -> None:
        sprite = seen(shape("fighter", engine_k=900.0), (90, 0, 0))
        assert sprite.signal_center[0] < sprite.center[0] - 5  # flies right, so its tail is on the left

    def test_an_isothermal_body_has_one_centre(self) -> None:
        sprite = seen(shape("fighter", temperature_k=310.0, engine_k=310.0), (60, 20, 30))
        np.testing.assert_allclose(sprite.signal_center, sprite.center, atol=1e-9)

    def test_near_the_lens_only_what_the_frame_sees_is_drawn(self) -> None:
        sprite = seen(shape("fighter"), (90, 0, 0), range_m=12.0)
        assert sprite.box.w > 2000
        assert sprite.alpha.shape[1] < 200


def test_a_tank_shows_its_engine_from_behind_but_not_from_the_front() -> None:
    cold, hot = shape("tank", engine_k=300.0), shape("tank", engine_k=400.0)
    front = [seen(value, (180, 0, 0)).emission.sum() for value in (cold, hot)]
    rear = [seen(value, (0, 0, 0)).emission.sum() for value in (cold, hot)]
    assert front[1] < 1.05 * front[0]
    assert rear[1] > 2 * rear[0]


@pytest.mark.parametrize("range_m", [2000.0, 100.0])
def test_a_hot_spot_has_an_ellipse_s_area_and_fills_its_box(range_m: float) -> None:
    # 4 m by 2 m on the axis: pi / 4 * 4 * 2 m2, a pixel sees (0.5 mrad * range)^2.
    sprite = seen(shape("hot_spot", size_m=[4.0, 2.0]), range_m=range_m)
    assert sprite.cover.sum() == pytest.approx(math.pi * 2 / (IFOV * range_m) ** 2, rel=1e-6)
    assert (sprite.box.w, sprite.box.h) == pytest.approx((4 / (IFOV * range_m), 2 / (IFOV * range_m)), rel=1e-6)


class TestPoint:
    def test_its_light_is_its_share_of_a_pixel(self) -> None:
        # 0.1 m2 at 1000 m, a pixel on the axis sees 0.5 m there: phi = 0.1 / 0.25 = 0.4.
        assert seen(shape("point", area_m2=0.1)).alpha.sum() == pytest.approx(0.4, abs=1e-8)
        sprite = seen(shape("point", area_m2=0.1), at=(30.3, 40.8))
        assert sprite.alpha.sum() == pytest.approx(0.4 / OFF_AXIS**3, abs=1e-8)
        assert sprite.cover.sum() == pytest.approx(1.0, abs=1e-8)
        assert sprite.center == pytest.approx((30.3, 40.8))

    def test_it_replaces_no_more_than_all_of_a_pixel(self) -> None:
        assert seen(shape("point", area_m2=50.0)).alpha.max() == pytest.approx(1.0)

    def test_its_nominal_box_is_the_spread_s_full_width(self) -> None:
        box = seen(shape("point"), psf_px=8.0).box
        assert (box.w, box.h) == pytest.approx((18.84, 18.84), rel=2e-3)  # 2.3548 * 8

    def test_without_blur_it_lights_one_pixel(self) -> None:
        # A square millimetre, 0.002 px across, is far smaller than its way to the pixel's edge.
        sprite = seen(shape("point", area_m2=1e-6), at=(30.3, 40.8), psf_px=0.0)
        lit = np.argwhere(sprite.alpha > 1e-12)
        assert (lit + np.array([sprite.y0, sprite.x0])).tolist() == [[41, 30]]
        assert sprite.alpha.max() == pytest.approx(4e-6 / OFF_AXIS**3)

    @pytest.mark.parametrize("x", [79.5, 300.0, 600.0])
    def test_off_the_axis_it_fills_more_of_a_pixel(self, x: float) -> None:
        """Of a plane picture, a pixel t off the axis sees cos^3 t of the solid angle that one on it sees."""
        wide = SceneContext(0, Geometry((640, 120), 1e-3), 30.0, "mwir", 0.6)
        for kind, keys in (("point", {"area_m2": math.pi / 4}), ("hot_spot", {"size_m": (1.0, 1.0)})):
            sprite = shape(kind, **keys).draw(View(wide.geometry.place(np.array([x, 59.5]), 200.0), AWAY, wide))
            assert sprite is not None
            cosine = math.cos(math.atan((x - 319.5) * 1e-3))
            assert sprite.alpha.sum() == pytest.approx(math.pi / 4 / (200 * 1e-3) ** 2 / cosine**3, rel=0.02)
