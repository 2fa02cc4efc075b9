"""Joints: how the moving parts of a body lie at a time."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from irsim.targets.solids import Point3
from irsim.types import Floats

Turn = Annotated[float, Field(ge=-360, le=360)]
"""How a moving part lies in frame 0, degrees."""


class Rigid(NamedTuple):
    """A rigid motion in body axes: v -> turn v + shift, shift in body lengths. A body has several of them in each
    frame: as plain numbers, the turn's (3, 3) row by row before the shift's, they are made in half the time of arrays.
    """

    numbers: tuple[float, ...]

    @property
    def turn(self) -> Floats:
        """(3, 3)."""
        return np.array(self.numbers[:9]).reshape(3, 3)

    @property
    def shift(self) -> Floats:
        """(3,)."""
        return np.array(self.numbers[9:])

    def __matmul__(self, other: Rigid) -> Rigid:
        """The other motion first, then this one: a shin on a thigh is `thigh @ knee`."""
        a, b, c, d, e, f, g, h, i, x, y, z = self.numbers
        j, k, l, m, n, o, p, q, r, u, v, w = other.numbers  # noqa: E741 - twelve letters in a row, l among them
        return Rigid(
            (
                *(a * j + b * m + c * p, a * k + b * n + c * q, a * l + b * o + c * r),
                *(d * j + e * m + f * p, d * k + e * n + f * q, d * l + e * o + f * r),
                *(g * j + h * m + i * p, g * k + h * n + i * q, g * l + h * o + i * r),
                *(a * u + b * v + c * w + x, d * u + e * v + f * w + y, g * u + h * v + i * w + z),
            )
        )


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
    along_x, along_y = rest * x, rest * y
    xy, xz, yz = along_x * y, along_x * z, along_y * z
    about_x, about_y, about_z = sine * x, sine * y, sine * z
    a, b, c = cosine + along_x * x, xy - about_z, xz + about_y
    d, e, f = xy + about_z, cosine + along_y * y, yz - about_x
    g, h, i = xz - about_y, yz + about_x, cosine + rest * z * z
    u, v, w = px - (a * px + b * py + c * pz), py - (d * px + e * py + f * pz), pz - (g * px + h * py + i * pz)
    return Rigid((a, b, c, d, e, f, g, h, i, u, v, w))
