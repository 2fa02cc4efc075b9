"""The outlines of a body's parts as they are seen, in layers by what hides what."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from irsim.targets.base import View
from irsim.targets.hull import Ints
from irsim.targets.joints import Rigid
from irsim.targets.mesh import Mesh
from irsim.types import Box, Floats


class Rims(NamedTuple):
    """The outlines of n convex parts.

    edges   start (m, 2), stop (m, 2) px from `middle` and layer (m,), rising: see `visible_edges`
    middle  (x, y) px: of the body; edges of a small one keep their digits only where it is told apart
    glow    (n,) the light of each layer, the nearest first, W/m2/sr
    box     around them, px
    """

    edges: tuple[Floats, Floats, Ints]
    middle: tuple[float, float]
    glow: Floats
    box: Box


@dataclass(frozen=True, eq=False)
class Joints:
    """What moves: the names of its joints, and of each part the place of its joint among them, -1 where it stays."""

    names: tuple[str, ...]
    of_part: Ints


def rims(
    form: Mesh, joints: Joints, motions: Mapping[str, Rigid], scale: float, view: View, light: Floats
) -> Rims | None:
    """Of a body at rest, its joints moved in units of `scale`, of the light (n,) of its parts, W/m2/sr; None where any
    of it lies behind the camera."""
    right, down, ahead = view.position.tolist()
    if ahead <= 0:
        return None
    geometry = view.context.geometry
    (x, y), scale_px = geometry.axis_px, 1 / (ahead * geometry.ifov_rad)
    x, y = x + right * scale_px, y + down * scale_px
    moved = {part: motions[joints.names[joint]] for part, joint in enumerate(joints.of_part.tolist()) if joint >= 0}
    form = form.posed(moved, scale)
    parts = form.parts
    arms, position = form.vertices @ view.attitude.T, view.position
    depth = arms[:, 2] + position[2]
    if depth.min() <= 0:
        return None
    pixels = (arms[:, :2] - position[:2] / position[2] * arms[:, 2:]) / (depth * geometry.ifov_rad)[:, None]
    (west, north), (east, south) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    eye = -position @ view.attitude
    faces_eye = form.normals @ eye > form.offsets
    left = faces_eye[parts.left]
    rim = left != faces_eye[parts.right]
    # By layers, the nearest first: their edges must stand together.
    rank = form.hiding_order(eye, pixels)
    edge = np.flatnonzero(rim)
    layer = rank[parts.part[edge]]
    by_layer = np.argsort(layer, kind="stable")
    order, layer = edge[by_layer], layer[by_layer]
    # A face seen from outside runs clockwise in x right, y down where its edges are read backwards.
    start = pixels[np.where(left, parts.head, parts.tail)[order]]
    stop = pixels[np.where(left, parts.tail, parts.head)[order]]
    glow = np.empty(len(rank))
    glow[rank] = light
    return Rims((start, stop, layer), (x, y), glow, Box.from_edges(x + west, y + north, x + east, y + south))
