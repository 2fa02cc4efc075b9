"""Exact polygon coverage and hidden-line removal, against cases worked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from irsim.geometry.polygon import (
    as_row_differences,
    centroids,
    coverage,
    polygon_edges,
    row_differences,
    visible_edges,
)
from irsim.types import Floats


def area(points: Floats, size: tuple[int, int]) -> Floats:
    """Return area, y moment and x moment (3, rows, columns) of one polygon."""
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

    def test_row_differences_agree_with_coverage(self) -> None:
        start, stop = polygon_edges(np.array([[0.3, 0.2], [7.6, 1.9], [2.1, 5.5]]))
        edges = start, stop, np.stack([np.ones(3), np.full(3, 2.5)], axis=1)
        expected = row_differences(*edges, (6, 8))
        np.testing.assert_allclose(as_row_differences(coverage(*edges, (6, 8))), expected, atol=1e-14)

    @pytest.mark.parametrize("corners", range(3, 10))
    def test_sums_are_those_of_the_shoelace_formula(self, corners: int) -> None:
        rng = np.random.default_rng(corners)
        angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.9, corners)) / corners
        points = 15 + rng.uniform(3, 13, corners)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        cells, by_y, by_x = area(points, (30, 30))
        x, y = points.T
        cross = x * np.roll(y, -1) - np.roll(x, -1) * y
        assert cells.sum() == pytest.approx(cross.sum() / 2, abs=1e-10)
        assert cells.min() > -1e-12
        assert cells.max() < 1 + 1e-12
        place = np.arange(30) + 0.5
        moments = [(cells @ place + by_x.sum(axis=1)).sum(), (place @ cells + by_y.sum(axis=0)).sum()]
        np.testing.assert_allclose(moments, [((v + np.roll(v, -1)) * cross).sum() / 6 for v in (x, y)], rtol=1e-11)
        (integral,), (centre,) = centroids(*polygon_edges(points), np.ones((corners, 1)))
        np.testing.assert_allclose([integral, *(integral * centre)], [cells.sum(), *moments], rtol=1e-11)

    def test_a_window_equals_part_of_the_grid(self) -> None:
        points = np.array([[2.2, 3.1], [27.5, 9.3], [19.9, 28.4], [4.4, 21.0]])
        np.testing.assert_allclose(area(points - 10, (9, 7)), area(points, (30, 30))[:, 10:19, 10:17], atol=1e-12)


class TestVisibleEdges:
    """Squares in front of squares, worked out by hand."""

    @staticmethod
    def layers(squares: list[tuple[float, float, float]], glow: list[float]) -> tuple[Floats, Floats]:
        """Return (opacity, glow) in cells of squares (x, y, side), the nearest first."""
        corners = [np.array([[x, y], [x + s, y], [x + s, y + s], [x, y + s]]) for x, y, s in squares]
        edges = [polygon_edges(np.array(corner)) for corner in corners]
        start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
        layer = np.repeat(np.arange(len(squares)), 4)
        start, stop, weights = visible_edges(start, stop, layer, np.array(glow))
        opacity, light = coverage(start, stop, weights, (10, 10))[0]
        return opacity, light

    def test_the_nearer_hides_the_farther(self) -> None:
        opacity, light = self.layers([(2, 2, 4), (4, 4, 4)], [5.0, 1.0])
        assert opacity.sum() == pytest.approx(16 + 16 - 4)
        assert light.sum() == pytest.approx(5 * 16 + 1 * 12)
        assert opacity.max() == pytest.approx(1.0)
        assert light[5, 5] == pytest.approx(5.0)
        assert light[7, 7] == pytest.approx(1.0)

    def test_a_hidden_polygon_adds_nothing(self) -> None:
        opacity, light = self.layers([(2, 2, 6), (3, 3, 2)], [1.0, 9.0])
        assert opacity.sum() == pytest.approx(36)
        assert light.sum() == pytest.approx(36)

    def test_a_polygon_in_front_replaces(self) -> None:
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
    def test_coinciding_edges_count_once(self, squares: list[tuple[float, float, float]], whole: float) -> None:
        opacity, light = self.layers(squares, [1.0, 2.0, 3.0][: len(squares)])
        assert opacity.sum() == pytest.approx(whole, abs=1e-6)
        assert opacity.min() > -1e-6
        assert opacity.max() < 1 + 1e-6
        assert light[:, 8:].max() < 1e-6  # an edge lost would leave a streak to the right
