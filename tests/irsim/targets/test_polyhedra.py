"""Convex polyhedra: hulls, depth order, splitting of intersecting parts, rigid transforms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from target_views import BODIES, body

from irsim.targets.parts import Solid, block, hinge
from irsim.targets.polyhedra import build_polyhedra
from irsim.targets.visibility import split_intersections


def corners(solid: Solid) -> set[tuple[float, ...]]:
    return {tuple(np.round(point, 6).tolist()) for point in solid.points}


class TestHulls:
    def test_a_cube_has_its_faces_and_edges(self) -> None:
        cube = build_polyhedra((block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),), 2.0)
        assert (len(cube.vertices), len(cube.normals), len(cube.topology.edges)) == (8, 6, 12)
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


class TestDepthOrder:
    def test_a_separating_plane_decides_not_the_middle(self) -> None:
        # A small lid at the far end of a long deck, seen from above the near end: its middle is farther.
        both = build_polyhedra((block((0, 0, 0), (10, 1, 1), "deck"), block((9, 0, -0.1), (10, 1, 0), "lid")), 1.0)
        pixels = both.vertices[:, :2]
        assert both.depth_order(np.array([-5.0, 0.5, -5.0]), pixels).tolist() == [1, 0]
        assert both.depth_order(np.array([-5.0, 0.5, 5.0]), pixels).tolist() == [0, 1]

    @pytest.mark.parametrize("seed", range(5))
    def test_the_first_part_on_a_ray_comes_first(self, seed: int) -> None:
        draw = np.random.default_rng(seed)
        cells = draw.permutation(27)[:14]
        lows = np.stack(np.unravel_index(cells, (3, 3, 3)), axis=1) + draw.uniform(0.02, 0.3, (14, 3))
        ends = np.stack([lows, lows + draw.uniform(0.1, 0.65, (14, 3))])
        corners_of = enumerate(zip(*ends.tolist(), strict=True))
        solids = [block(tuple(low), tuple(high), f"{number}") for number, (low, high) in corners_of]
        boxes = build_polyhedra(tuple(solids), 1.0)
        eye = draw.uniform(-1, 1, 3)
        eye = 1.5 + 8 * eye / np.linalg.norm(eye)
        toward = (1.5 - eye) / np.linalg.norm(1.5 - eye)
        across = np.linalg.svd(toward[None])[2][1:]
        rays = boxes.vertices - eye
        rank = boxes.depth_order(eye, rays @ across.T / (rays @ toward)[:, None])
        assert sorted(rank) == list(range(14))
        for ray in draw.uniform(0, 3, (200, 3)) - eye:
            into, out = np.sort((ends - eye) / ray, axis=0)  # (boxes, axes)
            met = np.flatnonzero(into.max(axis=1) < out.min(axis=1))
            if len(met):
                assert rank[met].argmin() == into.max(axis=1)[met].argmin()


class TestSplitIntersections:
    COLD = block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), "cold")

    def test_a_sunken_part_ends_at_the_face(self) -> None:
        sunk = block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5), "hot")
        cold, hot = sorted(split_intersections((self.COLD, sunk)), key=lambda solid: solid.material)
        assert corners(cold) == corners(self.COLD)
        assert corners(hot) == corners(block((0.2, 0.2, -0.5), (0.6, 0.8, 0.0)))

    def test_a_part_through_another_becomes_two(self) -> None:
        through = block((0.2, 0.2, -0.5), (0.6, 0.8, 1.5), "hot")
        pieces = [corners(solid) for solid in split_intersections((self.COLD, through)) if solid.material == "hot"]
        expected = [corners(block((0.2, 0.2, low), (0.6, 0.8, low + 0.5))) for low in (-0.5, 1.0)]
        assert sorted(map(sorted, pieces)) == sorted(map(sorted, expected))

    @pytest.mark.parametrize(
        "other",
        [
            block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5), "cold"),
            block((2, 0, 0), (3, 1, 1)),
            Solid(block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5)).points, "hot", "joint"),
        ],
        ids=["same material", "apart", "other joint"],
    )
    def test_others_stay_whole(self, other: Solid) -> None:
        found = split_intersections((self.COLD, other))
        assert [corners(each) for each in found] == [corners(self.COLD), corners(other)]

    @pytest.mark.parametrize("kind", BODIES)
    def test_a_body_gets_few_more_parts(self, kind: str) -> None:
        solids = body(kind).solids
        whole, split = (build_polyhedra(each, 1.0).topology for each in (solids, split_intersections(solids)))
        assert split.count <= whole.count + 5
        assert len(split.edges) < 1.4 * len(whole.edges)


def test_a_hinge_turns_about_its_axis() -> None:
    # About y (right) through (1, 0, 0), a quarter turn lifts (2, 5, 0), ahead of it, to (1, 5, -1): z is down.
    quarter = hinge((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), math.pi / 2)
    for transform, point, expected in (
        (quarter, [2.0, 5.0, 0.0], [1.0, 5.0, -1.0]),
        (quarter, [1.0, 7.0, 0.0], [1.0, 7.0, 0.0]),
        (quarter @ quarter, [2.0, 5.0, 0.0], [0.0, 5.0, 0.0]),
    ):
        moved = transform.rotation @ np.array(point) + transform.translation
        np.testing.assert_allclose(moved, expected, atol=1e-12)
