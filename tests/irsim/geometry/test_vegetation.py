"""Vegetation: outline, gaps, shading and wood of crowns."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import pytest

from irsim.geometry.vegetation import Crown, Foliage, broadleaf, bush, conifer, wood
from irsim.rng import stream
from irsim.types import Floats

Mask = npt.NDArray[np.bool_]

KINDS: dict[str, Callable[[float, float, np.random.Generator], Crown]] = {
    "broadleaf": broadleaf,
    "bush": bush,
    "conifer": conifer,
}
HIGH = 200.0
WIDE = {"broadleaf": 150.0, "bush": 350.0, "conifer": 80.0}
SEEDS = range(3)


def grown(kind: str, leaves: float, seed: int) -> tuple[Mask, Floats, Crown]:
    """Return the mask of leaves, their warmth, and the crown."""
    draw = stream(seed, "tree")
    crown = KINDS[kind](HIGH, WIDE[kind], draw)
    return *foliage(leaves).leaves_of(crown, draw), crown


@lru_cache
def foliage(leaves: float) -> Foliage:
    return Foliage(HIGH, leaves, 1, "trees")


def dimension(solid: Mask) -> float:
    """Return the box-counting dimension of an outline between boxes of 2 and 16 px."""
    inner = solid[1:-1, 1:-1] & solid[:-2, 1:-1] & solid[2:, 1:-1] & solid[1:-1, :-2] & solid[1:-1, 2:]
    edge = solid[1:-1, 1:-1] & ~inner
    sides = np.array([2, 4, 8, 16])
    counts = []
    for side in sides:
        rows, cols = (length // side * side for length in edge.shape)
        boxes = edge[:rows, :cols].reshape(rows // side, side, cols // side, side)
        counts.append(boxes.any(axis=(1, 3)).sum())
    return float(-np.polyfit(np.log(sides), np.log(counts), 1)[0])


@pytest.mark.parametrize("kind", KINDS)
def test_an_outline_is_ragged_at_all_scales(kind: str) -> None:
    """A smooth outline has dimension 1, a filled plane 2."""
    found = [dimension(grown(kind, 1.0, seed)[0]) for seed in SEEDS]
    assert 1.15 < float(np.median(found)) < 1.7


@pytest.mark.parametrize("kind", KINDS)
def test_a_crown_has_about_its_nominal_size(kind: str) -> None:
    extents = []
    for seed in SEEDS:
        solid = grown(kind, 1.0, seed)[0]
        rows, columns = np.flatnonzero(solid.any(axis=1)), np.flatnonzero(solid.any(axis=0))
        extents.append((len(solid) - rows[0], columns[-1] - columns[0] + 1))
    high, wide = np.median(extents, axis=0)
    assert high == pytest.approx(HIGH, rel=0.15)
    assert wide == pytest.approx(WIDE[kind], rel=0.25)


def test_gaps_lie_towards_the_edge() -> None:
    """With few leaves, the middle of a crown hides more than its rim."""
    for seed in SEEDS:
        leafy, _, crown = grown("broadleaf", 1.0, seed)
        bare, _, _ = grown("broadleaf", 0.6, seed)
        gaps = leafy & ~bare
        deep = leafy & (crown.depth > 0.6)
        rim = leafy & (crown.depth < 0.2)
        assert gaps[deep].mean() < gaps[rim].mean()
        assert not (bare & ~leafy).any()


def test_the_lit_side_is_warmer() -> None:
    """Up and to the left, of every kind."""
    for kind in ("broadleaf", "conifer"):
        warmer = []
        for seed in SEEDS:
            solid, warmth, crown = grown(kind, 1.0, seed)
            left = np.arange(solid.shape[1])[None, :] < crown.middle
            warmer.append(warmth[solid & left].mean() - warmth[solid & ~left].mean())
        assert np.mean(warmer) > 0.1


def test_wood_grows_within_the_crown() -> None:
    trunk, *boughs = wood(HIGH, WIDE["broadleaf"], 9.0, stream(1, "wood"))
    low, high = trunk[[0, 3]], trunk[[1, 2]]
    np.testing.assert_allclose(low.mean(axis=0), [0, 0], atol=1e-9)
    assert np.linalg.norm(low[1] - low[0]) == pytest.approx(9)
    assert high[:, 1].mean() < -0.7 * HIGH
    for points in boughs:
        tip = points[[1, 2]].mean(axis=0)
        assert np.hypot(2 * tip[0] / WIDE["broadleaf"], 2 * tip[1] / HIGH + 1) < 0.8 + 1e-9
        assert points[[1, 2], 1].mean() < points[[0, 3], 1].mean()  # upwards
