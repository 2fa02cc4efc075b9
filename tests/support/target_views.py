"""Views of targets for tests: a camera of 160 x 120 px and 0.5 mrad, and figures of what it draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mesh_files import GIVEN

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.geometry.rotations import euler
from irsim.geometry.sprite import Sprite
from irsim.targets import SHAPES, Shape, View
from irsim.targets.body import Body
from irsim.types import Floats

IFOV = 5e-4
AWAY = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""Body vectors to camera vectors of a body that flies away from the camera."""
KINDS = [name for name, _ in SHAPES]
BODIES = [name for name, kind in SHAPES if issubclass(kind, Body)]
MIDDLE = (79.5, 59.5)


def context(psf_px: float = 0.6, ifov_rad: float = IFOV) -> SceneContext:
    return SceneContext(0, Geometry((160, 120), ifov_rad), 30.0, "mwir", psf_px)


def shape(kind: str, **keys: Any) -> Shape:
    value = SHAPES.parse({"kind": kind, **GIVEN.get(kind, {}), **keys})
    assert isinstance(value, Shape)
    return value


def body(kind: str, **keys: Any) -> Body:
    value = shape(kind, **keys)
    assert isinstance(value, Body)
    return value


def view(
    angles_deg: Sequence[float] = (90, 0, 0),
    at: tuple[float, float] = MIDDLE,
    range_m: float = 1000.0,
    time: float = 0.0,
    where: SceneContext | None = None,
) -> View:
    where = where or context()
    return View(where.geometry.place(np.array(at), range_m), AWAY @ euler(np.array(angles_deg)), where, time)


def drawn(
    value: Shape,
    angles_deg: Sequence[float] = (90, 0, 0),
    at: tuple[float, float] = MIDDLE,
    range_m: float = 1000.0,
    time: float = 0.0,
    where: SceneContext | None = None,
) -> Sprite:
    sprite = value.draw(view(angles_deg, at, range_m, time, where))
    assert sprite is not None
    return sprite


def drawn_at_size(
    value: Body, px: float, angles_deg: Sequence[float] = (90, 0, 0), time: float = 0.0, ifov_rad: float = IFOV
) -> Sprite:
    """Draw a body with its length about `px` pixels."""
    return drawn(value, angles_deg, MIDDLE, value.length_m / (px * ifov_rad), time, context(0.6, ifov_rad))


def centroid(sprite: Sprite, cells: Floats) -> Floats:
    """Return the centroid (x, y) px of a sprite's array."""
    rows, columns = cells.shape
    x = cells.sum(axis=0) @ (sprite.x0 + np.arange(columns))
    y = cells.sum(axis=1) @ (sprite.y0 + np.arange(rows))
    return np.asarray(np.array([x, y]) / cells.sum())


def on_frame(sprite: Sprite, cells: Floats, size: tuple[int, int] = (160, 120)) -> Floats:
    """Return a sprite's array in its place on the frame; the sprite must lie within the frame."""
    picture = np.zeros(size[::-1])
    rows, columns = cells.shape
    picture[sprite.y0 : sprite.y0 + rows, sprite.x0 : sprite.x0 + columns] = cells
    return picture
