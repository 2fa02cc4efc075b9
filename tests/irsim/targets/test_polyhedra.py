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


def test_hulls_agree_with_qhull() -> None:
    from scipy.spatial import ConvexHull

    points = np.random.default_rng(3).normal(size=(20, 3))
    ours = build_polyhedra((Solid(tuple(map(tuple, points.tolist()))),), 1.0)
    theirs = ConvexHull(np.round(points, 9)).equations
    mine = np.column_stack([ours.normals, -ours.offsets])
    np.testing.assert_allclose(mine[np.lexsort(mine.T)], theirs[np.lexsort(theirs.T)], atol=1e-9)
    cube = build_polyhedra((block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),), 2.0)
    assert (len(cube.vertices), len(cube.normals), len(cube.topology.edges)) == (8, 6, 12)
    with pytest.raises(ValueError, match="no volume"):
        build_polyhedra((Solid(((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0))),), 1.0)


@pytest.mark.parametrize("seed", range(3))
def test_the_first_part_on_a_ray_comes_first(seed: int) -> None:
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
    for ray in draw.uniform(0, 3, (100, 3)) - eye:
        into, out = np.sort((ends - eye) / ray, axis=0)  # (boxes, axes)
        met = np.flatnonzero(into.max(axis=1) < out.min(axis=1))
        if len(met):
            assert rank[met].argmin() == into.max(axis=1)[met].argmin()


COLD = block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), "cold")


@pytest.mark.parametrize(("bottom", "ends"), [(0.5, [(-0.5, 0.0)]), (1.5, [(-0.5, 0.0), (1.0, 1.5)])])
def test_an_intersecting_part_ends_at_the_other(bottom: float, ends: list[tuple[float, float]]) -> None:
    """A part that ends within the other is cut off at its face; a part that passes through becomes two."""
    found = split_intersections((COLD, block((0.2, 0.2, -0.5), (0.6, 0.8, bottom), "hot")))
    expected = [corners(block((0.2, 0.2, low), (0.6, 0.8, high))) for low, high in ends]
    assert sorted(sorted(corners(each)) for each in found if each.material == "hot") == sorted(map(sorted, expected))
    assert [corners(each) for each in found if each.material == "cold"] == [corners(COLD)]


@pytest.mark.parametrize(
    "other",
    [
        block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5), "cold"),
        block((2, 0, 0), (3, 1, 1)),
        Solid(block((0.2, 0.2, -0.5), (0.6, 0.8, 0.5)).points, "hot", "joint"),
    ],
    ids=["same material", "apart", "other joint"],
)
def test_other_parts_stay_whole(other: Solid) -> None:
    assert [corners(each) for each in split_intersections((COLD, other))] == [corners(COLD), corners(other)]


@pytest.mark.parametrize("kind", BODIES)
def test_a_body_gets_few_more_parts(kind: str) -> None:
    solids = body(kind).solids
    assert len(split_intersections(solids)) <= len(solids) + 5


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
