"""What the compiled drawing of bodies refuses: tables, poses and arrays that do not agree."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from test_compiled_bodies import polygon, solids

from irsim._native import COMPILED
from irsim.geometry.polygon import polygon_edges
from irsim.targets.polyhedra import build_polyhedra

if COMPILED:
    from irsim._native import kernels

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")


def tables() -> list[Any]:
    """Of a body of two parts, the second on a joint."""
    body = build_polyhedra(solids(2, 3), 1.0)
    topology = body.topology
    return [
        *(topology.firsts, topology.corner, topology.edges, topology.material),
        *(body.vertices, body.normals, body.offsets, body.penetration, body.thin, np.array([-1, 0])),
    ]


def test_wrong_tables_of_a_body_are_refused() -> None:
    right = tables()
    firsts, corner, edges, heat, vertices, normals, _, crossing, *_ = right
    make: Callable[..., object] = kernels.form
    assert make(*right) is not None
    far = edges.copy()
    far[2, 3] = len(normals)
    wrong = {
        0: firsts[:, ::-1].copy(),
        1: corner + len(vertices),
        2: far,
        3: heat[:1],
        4: vertices[:-1],
        5: normals[:-1],
        7: crossing[:1],
        9: np.array([-1]),
    }
    for place, value in wrong.items():
        with pytest.raises(ValueError, match="form: its arrays do not agree"):
            make(*right[:place], value, *right[place + 1 :])
    with pytest.raises(TypeError):
        make(*right[:-1])
    with pytest.raises(TypeError):
        make(*right[:8], "much", *right[9:])


ONE_PIXEL = np.ones((1, 2, 1, 1))
"""The shares of a spread that leaves the light where it is."""


def test_wrong_poses_of_a_body_are_refused() -> None:
    draw: Callable[..., Any] = kernels.body_light
    still, spread = tuple(np.eye(3).ravel().tolist() + [0.0] * 3), kernels.spread(np.ones(1), ONE_PIXEL, 1)
    place, turn = np.array([0.0, 0.0, 20.0]), np.eye(3)
    right = [kernels.form(*tables()), (still,), 1.0, place, turn, 1e-2, 160, 120, 0.0, 0.0]
    right += [np.ones(2), 1.0, ((math.inf, spread),)]
    assert draw(*right)[-1] > 0
    wrong: dict[int, tuple[object, type[Exception]]] = {
        0: (spread, ValueError),  # another capsule
        1: ((), ValueError),
        3: (np.zeros(4), ValueError),
        4: (np.zeros(8), ValueError),
        5: (math.nan, ValueError),
        6: ("wide", TypeError),
        10: (np.ones(1), ValueError),
        12: ((), TypeError),
    }
    for at, (value, error) in wrong.items():
        with pytest.raises(error):
            draw(*right[:at], value, *right[at + 1 :])
    for motions in ((still[:5],), (list(still),)):
        with pytest.raises(ValueError, match="twelve numbers"):
            draw(right[0], motions, *right[2:])
    with pytest.raises(ValueError, match="PyCapsule"):
        draw(*right[:-1], ((1.0, "spread"),))
    with pytest.raises(TypeError):
        draw(*right[:-1])


def test_wrong_spreads_are_refused() -> None:
    make: Callable[..., object] = kernels.spread
    ones = np.ones(1)
    for weights, shares, fine in (
        (ones, np.ones((1, 2, 5, 1)), 5),  # finer than there is room for
        (ones, ONE_PIXEL, 0),
        (ones, np.ones((1, 2, 1, 2)), 1),  # to one side only
        (np.ones(2), ONE_PIXEL, 1),
        (np.ones(0), ONE_PIXEL, 1),
    ):
        with pytest.raises(ValueError, match="spread: shares"):
            make(weights, shares, fine)
    with pytest.raises(TypeError):
        make(ones, ONE_PIXEL)


def test_wrong_arrays_are_refused() -> None:
    start, stop = polygon_edges(polygon((4, 4), 3, 0.2, 5))
    layer, ones, spread = np.zeros(5, dtype=np.int64), np.ones(1), kernels.spread(np.ones(1), ONE_PIXEL, 1)
    right = [start, stop, layer, ones, 0.0, 0.0, 4, 4, spread, np.empty((3, 4, 4))]
    draw: Callable[..., tuple[float, ...]] = kernels.sprite_light
    assert draw(*right)[0] > 0
    wrong = {
        0: start[:4],
        1: np.ones((5, 3)),
        2: np.array([0, 0, 0, 0, 1]),
        3: np.zeros(0),
        6: 0,
        7: -1,
        8: kernels.form(*tables()),
        9: np.empty((3, 4, 5)),
    }
    for place, value in wrong.items():
        with pytest.raises(ValueError, match=r"sprite_light|layers|PyCapsule"):
            draw(*right[:place], value, *right[place + 1 :])
    with pytest.raises(TypeError):
        draw(*right[:-1])
    with pytest.raises(TypeError):
        draw(start.astype(np.float32), *right[1:])
