"""Exact polygons, hidden surfaces, and what bodies and points look like."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.geometry import Geometry
from irsim.motion.attitude import euler
from irsim.radiometry import radiance
from irsim.shapes import SHAPES, Shape, View
from irsim.shapes.body import Body
from irsim.shapes.polygon import centroids, coverage, outline
from irsim.shapes.solids import Solid, mesh
from irsim.shapes.visible import visible_edges
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Floats

IFOV = 5e-4
AWAY = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
BODIES = [name for name, kind in SHAPES if issubclass(kind, Body)]


def stage(psf_px: float = 0.6) -> Stage:
    return Stage(0, Geometry((160, 120), IFOV), 30.0, "mwir", psf_px)


def shape(kind: str, **keys: Any) -> Shape:
    value = SHAPES.parse({"kind": kind, **keys})
    assert isinstance(value, Shape)
    return value


def seen(
    value: Shape,
    angles_deg: tuple[float, float, float] = (90, 0, 0),
    at: tuple[float, float] = (79.5, 59.5),
    range_m: float = 1000.0,
    psf_px: float = 0.6,
) -> Sprite:
    where = stage(psf_px)
    view = View(where.geometry.place(np.array(at), range_m), AWAY @ euler(np.array(angles_deg)), where)
    sprite = value.draw(view)
    assert sprite is not None
    return sprite


def middle(sprite: Sprite, cells: Floats) -> Floats:
    """Centroid of a sprite's array, px."""
    rows, columns = cells.shape
    x = cells.sum(axis=0) @ (sprite.x0 + np.arange(columns))
    y = cells.sum(axis=1) @ (sprite.y0 + np.arange(rows))
    return np.array([x, y]) / cells.sum()


def area(points: Floats, size: tuple[int, int]) -> Floats:
    """(3, rows, columns) area and y and x moments of one polygon."""
    start, stop = outline(points)
    return coverage(start, stop, np.ones((len(start), 1)), size)[:, 0]


class TestCoverage:
    @pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (0.25, 0.5), (0.9, 0.1)])
    def test_a_unit_square_splits_by_its_shift(self, dx: float, dy: float) -> None:
        square = np.array([[1, 1], [2, 1], [2, 2], [1, 2]]) + np.array([dx, dy])
        expected = np.zeros((4, 4))
        expected[1:3, 1:3] = np.outer([1 - dy, dy], [1 - dx, dx])
        np.testing.assert_allclose(area(square, (4, 4))[0], expected, atol=1e-15)

    def test_a_triangle_by_hand(self) -> None:
        # Right angle at (0, 0), legs 2: the cells on the legs are whole but for the corner cut by x + y = 2.
        cells, by_y, by_x = area(np.array([[0.0, 0], [2, 0], [0, 2]]), (2, 2))
        np.testing.assert_allclose(cells, [[1, 0.5], [0.5, 0]], atol=1e-15)
        # The half cell's centroid is a third of the leg from the right angle: 1/3 - 1/2 from the middle, times 1/2.
        np.testing.assert_allclose(by_x, [[0, -1 / 12], [-1 / 12, 0]], atol=1e-15)
        np.testing.assert_allclose(by_y, [[0, -1 / 12], [-1 / 12, 0]], atol=1e-15)

    @settings(max_examples=100, deadline=None)
    @given(st.integers(0, 2**32 - 1), st.integers(3, 9))
    def test_sums_are_the_polygon_s_own(self, seed: int, corners: int) -> None:
        rng = np.random.default_rng(seed)
        angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
        points = 15 + rng.uniform(3, 13, corners)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        if angles[-1] - angles[0] < np.pi or np.diff(angles).max() > np.pi - 0.1:
            return  # not around its middle: the outline could cross itself
        cells, by_y, by_x = area(points, (30, 30))
        x, y = points.T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y  # the shoelace formula
        assert cells.sum() == pytest.approx(cross.sum() / 2, abs=1e-10)
        assert cells.min() > -1e-12
        assert cells.max() < 1 + 1e-12
        place = np.arange(30) + 0.5
        moments = [(cells @ place + by_x.sum(axis=1)).sum(), (place @ cells + by_y.sum(axis=0)).sum()]
        np.testing.assert_allclose(moments, [((v + np.roll(v, -1)) * cross).sum() / 6 for v in (x, y)], rtol=1e-11)
        (integral,), (centre,) = centroids(*outline(points), np.ones((corners, 1)))
        np.testing.assert_allclose([integral, *(integral * centre)], [cells.sum(), *moments], rtol=1e-11)

    def test_a_window_shows_what_the_whole_grid_has_there(self) -> None:
        points = np.array([[2.2, 3.1], [27.5, 9.3], [19.9, 28.4], [4.4, 21.0]])
        np.testing.assert_allclose(area(points - 10, (9, 7)), area(points, (30, 30))[:, 10:19, 10:17], atol=1e-12)


class TestVisible:
    """Squares on squares, worked out by hand."""

    @staticmethod
    def layers(squares: list[tuple[float, float, float]], glow: list[float]) -> tuple[Floats, Floats]:
        """(opacity, glow) in cells of squares (x, y, side), the nearest first."""
        corners = [np.array([[x, y], [x + s, y], [x + s, y + s], [x, y + s]]) for x, y, s in squares]
        edges = [outline(np.array(corner)) for corner in corners]
        start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
        layer = np.repeat(np.arange(len(squares)), 4)
        pieces = visible_edges(start, stop, layer, np.array(glow))
        opacity, light = coverage(*pieces, (10, 10))[0]
        return opacity, light

    def test_the_nearer_hides_the_farther(self) -> None:
        opacity, light = self.layers([(2, 2, 4), (4, 4, 4)], [5.0, 1.0])
        assert opacity.sum() == pytest.approx(16 + 16 - 4)
        assert light.sum() == pytest.approx(5 * 16 + 1 * 12)
        assert opacity.max() == pytest.approx(1.0)
        assert light[5, 5] == pytest.approx(5.0)
        assert light[7, 7] == pytest.approx(1.0)

    def test_a_part_wholly_behind_adds_nothing(self) -> None:
        opacity, light = self.layers([(2, 2, 6), (3, 3, 2)], [1.0, 9.0])
        assert opacity.sum() == pytest.approx(36)
        assert light.sum() == pytest.approx(36)

    def test_a_part_wholly_before_replaces(self) -> None:
        opacity, light = self.layers([(3, 3, 2), (2, 2, 6)], [9.0, 1.0])
        assert opacity.sum() == pytest.approx(36)
        assert light.sum() == pytest.approx(36 + 8 * 4)

    @pytest.mark.parametrize(
        ("squares", "whole"),
        [
            ([(2, 2, 4), (2, 2, 4)], 16),
            ([(2, 2, 3), (5, 2, 3)], 18),
            ([(2, 2, 4), (2, 2, 2)], 16),
            ([(2, 2, 2), (2, 2, 4), (4, 2, 2)], 16),
        ],
        ids=["same", "abutting", "shared corner", "three on one edge"],
    )
    def test_edges_that_coincide_count_once(self, squares: list[tuple[float, float, float]], whole: float) -> None:
        opacity, light = self.layers(squares, [1.0, 2.0, 3.0][: len(squares)])
        assert opacity.sum() == pytest.approx(whole, abs=1e-6)
        assert opacity.min() > -1e-6
        assert opacity.max() < 1 + 1e-6
        assert light[:, 8:].max() < 1e-6  # an edge lost would leave a streak to the right


class TestSolids:
    def test_a_cube_has_its_faces_and_edges(self) -> None:
        corners = tuple((x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0))
        cube = mesh((Solid(corners),), 2.0)
        assert (len(cube.vertices), len(cube.normals), len(cube.tail)) == (8, 6, 12)
        np.testing.assert_allclose(sorted(cube.offsets), [0, 0, 0, 2, 2, 2], atol=1e-12)

    def test_a_flat_solid_is_refused(self) -> None:
        with pytest.raises(ValueError, match="no volume"):
            mesh((Solid(((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0))),), 1.0)

    def test_faces_agree_with_qhull(self) -> None:
        from scipy.spatial import ConvexHull

        points = np.random.default_rng(3).normal(size=(20, 3))
        ours = mesh((Solid(tuple(map(tuple, points.tolist()))),), 1.0)
        theirs = ConvexHull(np.round(points, 9)).equations
        mine = np.column_stack([ours.normals, -ours.offsets])
        np.testing.assert_allclose(mine[np.lexsort(mine.T)], theirs[np.lexsort(theirs.T)], atol=1e-9)

    def test_a_part_in_front_hides_whatever_its_middle_says(self) -> None:
        def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
            return Solid(
                tuple((x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2]))
            )

        # A small lid at the far end of a long deck, seen from above the near end: its middle is farther.
        both = mesh((box((0, 0, 0), (10, 1, 1)), box((9, 0, -0.1), (10, 1, 0))), 1.0)
        assert both.hiding_order(np.array([-5.0, 0.5, -5.0])).tolist() == [1, 0]
        assert both.hiding_order(np.array([-5.0, 0.5, 5.0])).tolist() == [0, 1]


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
        assert shape(kind).draw(View(np.array([0.0, 0, -500]), np.eye(3), stage())) is None

    def test_it_may_hang_out_of_the_frame(self, kind: str) -> None:
        inside, outside = (seen(shape(kind), at=(x, 60), range_m=6000) for x in (3, -1))
        assert outside.cover.sum() == pytest.approx(inside.cover.sum(), rel=5e-3)

    def test_emission_is_that_of_its_temperatures(self, kind: str) -> None:
        value = shape(kind, emissivity=0.8)
        temperatures = [x for key, x in value.model_dump().items() if key.endswith("_k")]
        sprite = seen(value, (30, 10, 0), psf_px=0.0)
        glow = sprite.emission[sprite.alpha > 0.01] / sprite.alpha[sprite.alpha > 0.01]
        assert glow.min() >= 0.8 * radiance("mwir", min(temperatures)) * (1 - 1e-6)
        assert glow.max() <= 0.8 * radiance("mwir", max(temperatures)) * (1 + 1e-6)


@pytest.mark.parametrize("kind", BODIES)
class TestEveryBody:
    def test_blur_keeps_the_light(self, kind: str) -> None:
        sharp, soft = seen(shape(kind), psf_px=0.0), seen(shape(kind), psf_px=1.3)
        assert soft.alpha.sum() == pytest.approx(soft.cover.sum(), rel=1e-12)
        assert soft.emission.sum() == pytest.approx(sharp.emission.sum(), rel=1e-12)
        np.testing.assert_allclose(sharp.alpha, sharp.cover, atol=1e-12)

    def test_its_area_is_that_of_sampled_hulls(self, kind: str) -> None:
        from scipy.spatial import ConvexHull

        value, where = shape(kind), stage()
        assert isinstance(value, Body)
        rng = np.random.default_rng(7)
        for angles in rng.uniform(-180, 180, (4, 3)):
            sprite = seen(value, tuple(angles.tolist()), range_m=500.0)
            turn = AWAY @ euler(angles)
            position = where.geometry.place(np.array([79.5, 59.5]), 500.0)
            x, y = np.meshgrid(np.arange(0, 160, 0.1), np.arange(0, 120, 0.1))
            inside = np.zeros(x.shape, dtype=bool)
            for solid in value.solids:
                points = where.geometry.project(np.array(solid.points) * value.length_m @ turn.T + position)
                planes = ConvexHull(points).equations
                inside |= np.all([a * x + b * y + c <= 0 for a, b, c in planes], axis=0)
            assert sprite.cover.sum() == pytest.approx(inside.sum() * 0.01, rel=5e-3)
            assert sprite.center[0] == pytest.approx(x[inside].mean(), abs=0.02)
            assert sprite.center[1] == pytest.approx(y[inside].mean(), abs=0.02)
            edges = [x[inside].min(), x[inside].max(), y[inside].min(), y[inside].max()]
            box = sprite.box
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


class TestPoint:
    def test_its_light_is_its_share_of_a_pixel(self) -> None:
        # 0.1 m2 at 1000 m, a pixel sees 0.5 m there: phi = 0.1 / 0.25 = 0.4.
        sprite = seen(shape("point", area_m2=0.1), at=(30.3, 40.8))
        assert sprite.alpha.sum() == pytest.approx(0.4, abs=1e-8)
        assert sprite.cover.sum() == pytest.approx(1.0, abs=1e-8)
        assert sprite.center == pytest.approx((30.3, 40.8))

    def test_it_replaces_no_more_than_all_of_a_pixel(self) -> None:
        assert seen(shape("point", area_m2=50.0)).alpha.max() == 1.0

    def test_its_nominal_box_is_the_spread_s_full_width(self) -> None:
        box = seen(shape("point"), psf_px=8.0).box
        assert (box.w, box.h) == pytest.approx((18.84, 18.84), rel=2e-3)  # 2.3548 * 8

    def test_without_blur_it_lights_one_pixel(self) -> None:
        sprite = seen(shape("point", area_m2=0.1), at=(30.3, 40.8), psf_px=0.0)
        assert (sprite.x0, sprite.y0, sprite.alpha.shape) == (30, 41, (1, 1))
        assert sprite.alpha[0, 0] == pytest.approx(0.4)
