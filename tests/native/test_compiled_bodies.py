"""The compiled drawing of bodies does what its plain twin does."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from target_views import AWAY, BODIES, context, shape

from irsim._native import COMPILED
from irsim.geometry import silhouette
from irsim.geometry.polygon import polygon_edges
from irsim.geometry.rotations import euler
from irsim.geometry.silhouette import LayeredPolygons, draw_sprite
from irsim.geometry.sprite import Sprite
from irsim.physics.diffraction import LensPSF
from irsim.physics.psf import PSF, GaussianPSF
from irsim.targets import View, body
from irsim.targets.body import PosedBody, RestPose, draw_body
from irsim.targets.parts import Solid
from irsim.targets.polyhedra import build_polyhedra
from irsim.targets.visibility import Joints
from irsim.types import Box, Floats

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")

PLAIN = pytest.MonkeyPatch()


def plainly(draw: Sequence[LayeredPolygons]) -> list[Sprite]:
    with PLAIN.context() as patch:
        patch.setattr(silhouette, "COMPILED", False)
        return [draw_sprite(each) for each in draw]


def same(one: Sprite | None, other: Sprite | None, slack: float = 1e-11) -> None:
    """The same but for sums in another order."""
    if one is None or other is None:
        assert one is other
        return
    assert (one.x0, one.y0) == (other.x0, other.y0)
    assert one.range_m == pytest.approx(other.range_m, rel=1e-15)
    assert one.area == pytest.approx(other.area, rel=1e-11, abs=1e-11)
    for name in ("cover", "alpha", "emission"):
        ours, theirs = getattr(one, name), getattr(other, name)
        assert ours.shape == theirs.shape
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=slack * max(np.abs(theirs).max(), 1.0))
    for side in ("left", "right", "top", "bottom"):
        assert getattr(one.box, side) == pytest.approx(getattr(other.box, side), rel=1e-12, abs=1e-11)
    if one.area > 1e-3:
        assert one.center == pytest.approx(other.center, rel=1e-12, abs=1e-9)
        if one.emission.sum() > 1e-3:
            assert one.signal_center == pytest.approx(other.signal_center, rel=1e-12, abs=1e-9)


SPREADS = (GaussianPSF(0.0), GaussianPSF(0.6), GaussianPSF(2.5), LensPSF(((0.9, 1.0),), 0.5, 0.3))


def polygon(middle: tuple[float, float], radius: float, turn: float, corners: int) -> Floats:
    angles = turn + 2 * np.pi * np.arange(corners) / corners
    return np.asarray(np.array(middle) + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def drawn_as(polygons: Sequence[Floats], glow: Sequence[float], window: Box, psf: PSF) -> LayeredPolygons:
    edges = [polygon_edges(points) for points in polygons]
    start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
    layer = np.repeat(np.arange(len(polygons)), [len(points) for points in polygons])
    low, high = start.min(axis=0), start.max(axis=0)
    box = Box.from_edges(*low.tolist(), *high.tolist())
    return LayeredPolygons((start, stop, layer), np.array(glow), box, window, psf, 1000.0)


WHOLE = st.integers(-2, 8).map(float)
PLACE = WHOLE | st.floats(-3, 9)
ONE = st.tuples(
    st.tuples(PLACE, PLACE),
    st.sampled_from([1.0, 2.0, 1e-9, 0.0]) | st.floats(0.01, 6),
    st.sampled_from([0.0, math.pi / 4]) | st.floats(-4, 4),
    st.integers(3, 9),
)
SQUARE = ((4.0, 4.0), math.sqrt(8), math.pi / 4, 4)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(ONE, min_size=1, max_size=6),
    st.lists(st.sampled_from([0.0, 1.0, 5.0]), min_size=6, max_size=6),
    st.tuples(st.floats(-3, 5), st.floats(-3, 5), st.floats(0.1, 9), st.floats(0.1, 20)),
    st.sampled_from(SPREADS),
)
@example([SQUARE, SQUARE], [1.0, 5.0] * 3, (0.0, 0.0, 8.0, 8.0), SPREADS[1])  # all their edges coincide
@example([SQUARE, SQUARE], [1.0] * 6, (0.0, 0.0, 8.0, 8.0), SPREADS[1])
@example([SQUARE, ((8.0, 4.0), math.sqrt(8), math.pi / 4, 4)], [5.0, 1.0] * 3, (0.0, 0.0, 9.0, 8.0), SPREADS[1])
@example([SQUARE, ((4.0, 4.0), 0.0, 0.0, 5)], [5.0, 1.0] * 3, (0.0, 0.0, 9.0, 8.0), SPREADS[0])
@example([SQUARE], [1.0] * 6, (40.0, -50.0, 3.0, 3.0), SPREADS[1])  # nothing of it is in the window
@example([((1.0, 2.0), 1e-9, 0.0, 3)] * 2, [0.0] * 6, (0.0, 0.0, 1.0, 1.0), SPREADS[0])  # nothing of it is seen
def test_polygons_that_hide_each_other(
    given: list[tuple[tuple[float, float], float, float, int]],
    glow: list[float],
    window: tuple[float, float, float, float],
    psf: PSF,
) -> None:
    left, top, wide, high = window
    one = drawn_as([polygon(*each) for each in given], glow[: len(given)], Box.from_pixels(left, top, wide, high), psf)
    with np.errstate(invalid="ignore"):
        (expected,) = plainly([one])
    same(draw_sprite(one), expected)


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("psf_px", [0.0, 0.6])
def test_bodies(kind: str, psf_px: float) -> None:
    where, rng = context(psf_px), np.random.default_rng(4)
    things = []
    for _ in range(5):
        place = where.geometry.place(rng.uniform(-20, 180, 2), rng.choice([30.0, 300.0, 2000.0]))
        turn = AWAY @ euler(rng.uniform(-180, 180, 3))
        things.append((shape(kind), View(place, turn, where, float(rng.uniform(0, 3)))))
    with PLAIN.context() as patch:
        patch.setattr(silhouette, "COMPILED", False)
        patch.setattr(body, "COMPILED", False)
        expected = [one.draw(view) for one, view in things]
    assert any(each is not None for each in expected)
    for ours, theirs in zip([one.draw(view) for one, view in things], expected, strict=True):
        same(ours, theirs)


def solids(count: int, seed: int, cubes: bool = True) -> tuple[Solid, ...]:
    """Hulls of a few points each, which run through each other or lie apart; cubes among them touch and coincide."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        size = rng.choice([0.3, 1.0])
        points = rng.integers(0, 3, 3) + size * rng.uniform(0, 1, (rng.integers(4, 9), 3))
        if cubes and rng.random() < 0.5:
            points = rng.integers(0, 3, 3) + np.indices((2, 2, 2)).reshape(3, 8).T
        found.append(Solid(tuple(tuple(point) for point in points.tolist()), str(rng.integers(5))))
    return tuple(found)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
def test_edges_that_are_no_numbers_do_not_crash(bad: float) -> None:
    one = drawn_as([polygon((4, 4), 3, 0.2, 5)] * 3, [1.0, bad, 2.0], Box(4, 4, 6, 6), GaussianPSF(0.6))
    start, stop, layer = one.edges
    for end in (start, stop):
        end[2, 1] = end[7, 0] = end[12] = bad
    draw_sprite(one._replace(edges=(start, stop, layer)))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_body_without_a_place_does_not_crash(bad: float) -> None:
    form, still = build_polyhedra(solids(9, 5), 1.0), Joints((), np.full(9, -1))
    for place in ([0.0, 0.0, bad], [bad, 0.0, 9.0]):
        view = View(np.array(place), AWAY, context())
        with contextlib.suppress(ValueError):
            draw_body(PosedBody(RestPose(form, still, np.arange(9.0)), {}, 1.0, view, 1.0))
