"""Three-dimensional bodies: a table of convex parts, drawn by attitude and range."""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar

import numpy as np

from irsim.kinds import Fraction, Kelvin, Positive
from irsim.radiometry import Band, radiance
from irsim.shapes.base import Shape, View
from irsim.shapes.silhouette import sprite, within_sight
from irsim.shapes.solids import Mesh, Solid, mesh
from irsim.sprite import Sprite
from irsim.types import Box, Floats

WIDEST_PX = 2000.0
"""Of a body that fills more, only the part that the frame can see is drawn: its cover counts that part only."""


class Body(Shape):
    """A body of convex parts, each with its own temperature.

    A part is drawn as the outline that its hull has from where the camera is, exactly, and parts hide
    each other in the order of `Mesh.hiding_order`. Where parts of unlike temperature meet, the light
    may jump a little at the attitude at which that order changes (the silhouette does not).
    """

    solids: ClassVar[tuple[Solid, ...]]
    """The parts, for a body of length 1."""

    length_m: Positive
    """Length, m."""
    temperature_k: Kelvin = 300.0
    """Temperature of the skin, kelvin."""
    emissivity: Fraction = 0.95

    def draw(self, view: View) -> Sprite | None:
        stage, form = view.stage, _mesh(type(self), self.length_m)
        points = form.vertices @ view.attitude.T + view.position
        if points[:, 2].min() <= 0:
            return None
        pixels = stage.geometry.project(points)
        box = Box.from_edges(*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())
        window = box if max(box.w, box.h) <= WIDEST_PX else within_sight(box, stage)
        if window is None:
            return None
        eye = -view.position @ view.attitude
        faces_eye = form.normals @ eye > form.offsets
        left = faces_eye[form.left]
        rim = left != faces_eye[form.right]
        # By layers, the nearest first: their edges must stand together.
        rank = form.hiding_order(eye)
        order = np.flatnonzero(rim)
        order = order[np.argsort(rank[form.part[order]], kind="stable")]
        # A face seen from outside runs clockwise in x right, y down where its edges are read backwards.
        start = pixels[np.where(left, form.head, form.tail)[order]]
        stop = pixels[np.where(left, form.tail, form.head)[order]]
        glow = np.empty(len(rank))
        glow[rank] = _glow(self, stage.band)
        range_m = float(np.linalg.norm(view.position))
        return sprite((start, stop, rank[form.part[order]]), glow, box, window, stage.psf_px, range_m)


@lru_cache(maxsize=64)
def _mesh(body: type[Body], length_m: float) -> Mesh:
    return mesh(body.solids, length_m)


@lru_cache(maxsize=64)
def _glow(body: Body, band: Band) -> Floats:
    """(parts,) in-band radiance, W/m2/sr."""
    temperatures = np.array([getattr(body, solid.heat) for solid in body.solids])
    return np.asarray(body.emissivity * radiance(band, temperatures))
