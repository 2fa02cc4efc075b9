"""Wrong arguments of irsim's C kernels: each is an error, and nothing is read or written elsewhere."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from test_compiled_bodies import polygon, solids

from irsim import rng
from irsim._native import COMPILED, kernels
from irsim.backgrounds.clouds import CloudShading
from irsim.geometry.polygon import polygon_edges
from irsim.targets.polyhedra import build_polyhedra

pytestmark = pytest.mark.skipif(not COMPILED, reason="nothing is compiled")

Case = tuple[list[Any], dict[int, list[Any]]]
"""Right arguments, and wrong values by their place."""

SINGLE, STATES = np.zeros(40, np.float32), np.zeros(40, np.int16)
ONE_PIXEL = np.ones((1, 2, 1, 1))
"""Shares of a spread that leaves the light in its pixel."""


def add_normals() -> Case:
    seed, table, deep, refined = rng.kernel_arguments(1, "a")
    locked = SINGLE.copy()
    locked.flags.writeable = False
    wrong: dict[int, list[Any]] = {
        0: [seed[1:]],
        1: [table[1:]],
        2: [deep[1:]],
        3: [-1, refined + 1],
        4: [SINGLE.astype(float), locked],
    }
    return [seed, table, deep, refined, SINGLE.copy(), 1.0], wrong


def bridge() -> Case:
    right = [*rng.kernel_arguments(1, "a"), STATES, STATES, 0.5, 1.0, STATES.copy()]
    return right, {4: [STATES[1:], SINGLE], 5: [STATES[1:], SINGLE], 8: [SINGLE]}


def mixed() -> Case:
    pair, out = np.ones((4, 4, 2), np.float32), np.zeros((3, 9), np.float32)
    right = [(1.0, 0.0, 2.0, 0.0), (1.0, 0.5), 4, 1, 2, out, out, pair, pair, pair, pair]
    return right, {0: [(1.0,) * 3, None], 2: [0, -1, 5], 3: [-1], 4: [-1], 6: [out[1:]], 7: [pair[:3]], 10: [pair[:3]]}


def cloud() -> Case:
    one, glow = np.ones((3, 4), np.float32), CloudShading.of(0.0, 1.0, (268.0, 2.0, 8.0), "mwir").glow
    right = [one, one, one, 0.0, 1.0, 1.0, glow, 1.0, 1.0, one.copy(), one.copy()]
    return right, {0: [one[1:]], 1: [one[1:]], 2: [one[1:], one.astype(float)], 6: [glow[1:]], 9: [one[1:]]}


def moved() -> Case:
    state, out = np.zeros((5, 6), np.int16), np.ones((4, 5), np.float32)
    right = [16384, 0, 16384, 0, 0.0, 0.5, out, state, state]
    return right, {0: [16385, -1, 65536], 2: [16383], 6: [out[1:]], 7: [state[:4]], 8: [state.view(np.uint16)]}


def veil() -> Case:
    state, light, wide = np.zeros((5, 6), np.int16), np.ones((4, 5), np.float32), np.ones((4, 10), np.float32)
    right = [light, 16384, 0, 16384, 0, 0.0, 0.5, 0.5, light.copy(), *[state] * 4, light, light]
    return right, {0: [light[1:]], 12: [state[:4]], 13: [light[1:]], 14: [light[:, 1:], wide[:, ::2]]}


def counts_of() -> Case:
    right = [SINGLE, np.ones(40, np.uint16), 1.0, 0.0, 255, False, np.zeros(4, np.float32), np.zeros(10, np.float32)]
    wrong: dict[int, list[Any]] = {
        0: [SINGLE[1:]],
        1: [STATES],
        4: [-1.0, 2.0**16, math.nan],
        5: [SINGLE],
        6: [SINGLE[:5]],
        8: [SINGLE],
    }
    return [*right, STATES, 1.0], wrong


def signal_of() -> Case:
    return [SINGLE, SINGLE.copy(), 1.0, 0.0, 0.0, 1.0, STATES, 1.0], {1: [SINGLE[1:].copy()], 6: [SINGLE, STATES[1:]]}


def histogram() -> Case:
    pixels = np.zeros(4, np.int64)
    right = [np.zeros((2, 3), np.uint16), pixels]
    return right, {0: [np.zeros(6, np.uint8)], 1: [pixels.astype(np.int32), np.zeros(2**16 + 1, np.int64)]}


def lay() -> Case:
    patch, light = np.ones((3, 4)), np.ones((60, 70), np.float32)
    wrong: dict[int, list[Any]] = {1: [0], 2: [np.ones((3, 3))], 3: [np.ones(11)], 4: [5], 5: [2**62], 6: [-(2**62)]}
    return [light, 70, patch, patch, 4, 0, 0], wrong


def clutter() -> Case:
    return [np.ones((60, 70), np.float32), 70, 1.0, 1.0, 1.0, 1.0, 20.0, 4.0], {1: [0, 71], 6: [3.0]}


def form() -> Case:
    """Tables of a body of two parts, the second on a joint."""
    body = build_polyhedra(solids(2, 3), 1.0)
    topology, far = body.topology, body.topology.edges.copy()
    far[2, 3] = len(body.normals)
    right: list[Any] = [
        topology.firsts,
        topology.corner,
        topology.edges,
        topology.material,
        body.vertices,
        body.normals,
    ]
    right += [body.offsets, body.penetration, body.thin, np.array([-1, 0])]
    wrong: dict[int, list[Any]] = {at: [right[at][:-1]] for at in (3, 4, 5, 7)} | {8: ["much"], 9: [np.array([-1])]}
    return right, wrong | {0: [topology.firsts[:, ::-1].copy()], 1: [topology.corner + len(body.vertices)], 2: [far]}


def body_light() -> Case:
    still, table = (*np.eye(3).ravel().tolist(), 0.0, 0.0, 0.0), kernels.spread(np.ones(1), ONE_PIXEL, 1)
    right: list[Any] = [kernels.form(*form()[0]), (still,), 1.0, np.array([0.0, 0.0, 20.0]), np.eye(3), 1e-2, 160, 120]
    right += [0.0, 0.0, np.ones(2), 1.0, ((math.inf, table),)]
    wrong: dict[int, list[Any]] = {
        0: [table],
        1: [(), (still[:5],), (list(still),)],
        3: [np.zeros(4)],
        4: [np.zeros(8)],
        5: [math.nan],
    }
    return right, wrong | {6: ["wide"], 10: [np.ones(1)], 12: [(), ((1.0, "spread"),)]}


def recursive() -> Case:
    frame, counts = np.ones((3, 4), np.float32), np.ones((3, 4), np.uint16)
    wrong: dict[int, list[Any]] = {0: [frame[1:], counts], 1: [counts[1:], frame], 2: [0, 5, -4], 5: [frame[1:]]}
    return [frame, counts, 4, 0.5, 0.1, frame.copy()], wrong


def enhance() -> Case:
    frame, lines, counts = np.ones((3, 4), np.float32), np.ones((2, 4), np.float32), np.ones((3, 4), np.uint16)
    wrong: dict[int, list[Any]] = {0: [frame[1:]], 1: [lines[:0], lines[1:]], 2: [lines[1:]], 3: [0, 5]}
    return [frame, lines, lines, 4, 255.0, counts], wrong | {4: [-1.0, 65_536.0, math.nan], 5: [counts[1:], frame]}


def spread() -> Case:
    return [np.ones(1), ONE_PIXEL, 1], {0: [np.ones(2), np.ones(0)], 1: [np.ones((1, 2, 1, 2))], 2: [0, 5]}


def sprite_light() -> Case:
    start, stop = polygon_edges(polygon((4, 4), 3, 0.2, 5))
    table = kernels.spread(np.ones(1), ONE_PIXEL, 1)
    right = [start, stop, np.zeros(5, np.int64), np.ones(1), 0.0, 0.0, 4, 4, table, np.empty((3, 4, 4))]
    wrong: dict[int, list[Any]] = {0: [start[:4], start.astype(np.float32)], 1: [np.ones((5, 3))], 3: [np.zeros(0)]}
    wrong |= {2: [np.array([0, 0, 0, 0, 1])], 6: [0], 7: [-1], 8: [kernels.form(*form()[0])], 9: [np.empty((3, 4, 5))]}
    return right, wrong


CASES = (
    add_normals,
    bridge,
    mixed,
    cloud,
    moved,
    veil,
    counts_of,
    signal_of,
    histogram,
    recursive,
    enhance,
    lay,
    clutter,
    form,
    body_light,
)


@pytest.mark.parametrize("case", [*CASES, spread, sprite_light], ids=lambda case: case.__name__)
def test_each_wrong_argument_is_an_error(case: Callable[[], Case]) -> None:
    call = getattr(kernels, case.__name__)
    right, wrong = case()
    call(*right)
    for at, values in wrong.items():
        for value in values:
            with pytest.raises((TypeError, ValueError, BufferError)):
                call(*right[:at], value, *right[at + 1 :])
    with pytest.raises(TypeError, match="takes"):
        call(*right[:-1])
