"""Exact areas of polygons, hidden surfaces and convex solids, against cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irsim.geometry.polygon import (
    as_row_differences,
    centroids,
    coverage,
    polygon_edges,
    row_differences,
    visible_edges,
)
from irsim.targets.parts import Solid
from irsim.targets.polyhedra import build_polyhedra
from irsim.types import Floats


def area(points: Floats, size: tuple[int, int]) -> Floats:
    """(3, rows, columns) area and y and x moments of one polygon."""
    start, stop = polygon_edges(points)
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

    def test_as_changes_it_is_what_changes_gives(self) -> None:
        start, stop = polygon_edges(np.array([[0.3, 0.2], [7.6, 1.9], [2.1, 5.5]]))
        edges = start, stop, np.stack([np.ones(3), np.full(3, 2.5)], axis=1)
        (expected,) = row_differences(*edges, [(6, 8)], np.array([3]))
        np.testing.assert_allclose(as_row_differences(coverage(*edges, (6, 8))), expected, atol=1e-14)

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
        [[integral]], [[centre]] = centroids(*polygon_edges(points), np.ones((corners, 1)), np.array([corners]))
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
        edges = [polygon_edges(np.array(corner)) for corner in corners]
        start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
        layer = np.repeat(np.arange(len(squares)), 4)
        start, stop, weights, _ = visible_edges(start, stop, layer, np.array(glow))
        opacity, light = coverage(start, stop, weights, (10, 10))[0]
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
        cube = build_polyhedra((Solid(corners),), 2.0)
        assert (len(cube.vertices), len(cube.normals), len(cube.parts.tail)) == (8, 6, 12)
        np.testing.assert_allclose(sorted(cube.offsets), [0, 0, 0, 2, 2, 2], atol=1e-12)

    def test_a_flat_solid_is_refused(self) -> None:
        with pytest.raises(ValueError, match="no volume"):
            build_polyhedra((Solid(((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0))),), 1.0)

    def test_faces_agree_with_qhull(self) -> None:
        from scipy.spatial import ConvexHull

        points = np.random.default_rng(3).normal(size=(20, 3))
        ours = build_polyhedra((Solid(tuple(map(tuple, points.tolist()))),), 1.0)
        theirs = ConvexHull(np.round(points, 9)).equations
        mine = np.column_stack([ours.normals, -ours.offsets])
        np.testing.assert_allclose(mine[np.lexsort(mine.T)], theirs[np.lexsort(theirs.T)], atol=1e-9)

    def test_a_part_in_front_hides_whatever_its_middle_says(self) -> None:
        def box(low: tuple[float, float, float], high: tuple[float, float, float], heat: str) -> Solid:
            return Solid(
                tuple((x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])), heat
            )

        # A small lid at the far end of a long deck, seen from above the near end: its middle is farther.
        both = build_polyhedra((box((0, 0, 0), (10, 1, 1), "deck"), box((9, 0, -0.1), (10, 1, 0), "lid")), 1.0)
        pixels = both.vertices[:, :2]
        assert both.hiding_order(np.array([-5.0, 0.5, -5.0]), pixels).tolist() == [1, 0]
        assert both.hiding_order(np.array([-5.0, 0.5, 5.0]), pixels).tolist() == [0, 1]

    @pytest.mark.parametrize("seed", range(10))
    def test_the_first_part_that_a_ray_meets_comes_first(self, seed: int) -> None:
        draw = np.random.default_rng(seed)
        cells = draw.permutation(27)[:14]
        lows = np.stack(np.unravel_index(cells, (3, 3, 3)), axis=1) + draw.uniform(0.02, 0.3, (14, 3))
        highs = lows + draw.uniform(0.1, 0.65, (14, 3))
        ends = np.stack([lows, highs])
        solids = [
            Solid(tuple((x, y, z) for x in xs for y in ys for z in zs), f"{number}")
            for number, (xs, ys, zs) in enumerate(ends.transpose(1, 2, 0).tolist())
        ]
        boxes = build_polyhedra(tuple(solids), 1.0)
        eye = draw.uniform(-1, 1, 3)
        eye = 1.5 + 8 * eye / np.linalg.norm(eye)
        toward = (1.5 - eye) / np.linalg.norm(1.5 - eye)
        across = np.linalg.svd(toward[None])[2][1:]
        rays = boxes.vertices - eye
        rank = boxes.hiding_order(eye, rays @ across.T / (rays @ toward)[:, None])
        assert sorted(rank) == list(range(14))
        for ray in draw.uniform(0, 3, (200, 3)) - eye:
            into, out = np.sort((ends - eye) / ray, axis=0)  # (boxes, axes)
            met = np.flatnonzero(into.max(axis=1) < out.min(axis=1))
            if len(met):
                assert rank[met].argmin() == into.max(axis=1)[met].argmin()
