"""Joints: how the moving parts of a body lie at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.shapes.solids import Point3
from irsim.types import Floats

Turn = Annotated[float, Field(ge=-360, le=360)]
"""How a moving part lies in frame 0, degrees."""


@dataclass(frozen=True, eq=False)
class Rigid:
    """A rigid motion in body axes: v -> turn v + shift, with turn (3, 3) and shift (3,) in body lengths."""

    turn: Floats
    shift: Floats

    def __matmul__(self, other: Rigid) -> Rigid:
        """The other motion first, then this one: a shin on a thigh is `thigh @ knee`."""
        return Rigid(self.turn @ other.turn, self.turn @ other.shift + self.shift)


def turned(start_deg: float, hz: float, time: float) -> float:
    """The angle, radians, at a time, s, of what turns `hz` times a second from `start_deg` on."""
    return math.radians(start_deg) + 2 * math.pi * hz * time


def hinge(pivot: Point3, axis: Point3, angle: float) -> Rigid:
    """A turn by `angle` radians about an axis (unit vector) through a point, by Rodrigues' formula.

    Right-handed: about y (right) a positive angle lifts what is ahead of the pivot, about z (down)
    it turns it to the right.
    """
    (x, y, z), (px, py, pz), sine, cosine = axis, pivot, math.sin(angle), math.cos(angle)
    rest = 1 - cosine
    a, b, c = cosine + rest * x * x, rest * x * y - sine * z, rest * x * z + sine * y
    d, e, f = rest * x * y + sine * z, cosine + rest * y * y, rest * y * z - sine * x
    g, h, i = rest * x * z - sine * y, rest * y * z + sine * x, cosine + rest * z * z
    # A body has several of them in each frame: these few sums are quicker without arrays.
    shift = px - (a * px + b * py + c * pz), py - (d * px + e * py + f * pz), pz - (g * px + h * py + i * pz)
    return Rigid(np.array([[a, b, c], [d, e, f], [g, h, i]]), np.array(shift))
