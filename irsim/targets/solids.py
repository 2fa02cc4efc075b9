"""Convex solids: the parts that bodies are made of.

Body axes: x forward, y right, z down. A solid is the convex hull of its points; lengths are shares of
the body's own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.types import Floats

Point3 = tuple[float, float, float]

_SIDES = 8
"""Corners of a round section."""


@dataclass(frozen=True)
class Solid:
    """points: at least four that do not lie in a plane; heat: the body's key that holds its temperature;
    joint: the joint of the body that it moves with, none where empty."""

    points: tuple[Point3, ...]
    heat: str = "temperature_k"
    joint: str = ""


def tube(*stations: tuple[float, float, float, float], heat: str = "temperature_k") -> Solid:
    """A round solid along x through stations (x, z, half width, half height)."""
    angles = 2 * np.pi * (np.arange(_SIDES) + 0.5) / _SIDES
    rings = [
        (x, float(wide * np.sin(angle)), float(z + high * np.cos(angle)))
        for x, z, wide, high in stations
        for angle in angles
    ]
    return Solid(tuple(rings), heat)


def plate(outline: tuple[tuple[float, float], ...], low: float, high: float, heat: str = "temperature_k") -> Solid:
    """A flat solid: an outline (x, y), seen from above, from z = low to z = high."""
    return Solid(tuple((x, y, z) for x, y in outline for z in (low, high)), heat)


def profile(outline: tuple[tuple[float, float], ...], left: float, right: float, heat: str = "temperature_k") -> Solid:
    """A flat solid: an outline (x, z), seen from the side, from y = left to y = right."""
    return Solid(tuple((x, y, z) for x, z in outline for y in (left, right)), heat)


def block(low: Point3, high: Point3, heat: str = "temperature_k") -> Solid:
    """A box between two opposite corners."""
    return plate(((low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])), low[2], high[2], heat)


def ball(middle: Point3, halves: Point3, heat: str = "temperature_k") -> Solid:
    """An ellipsoid with half axes along x, y and z, in three rings and two poles."""
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    equator = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    rings = [np.cos(rise) * equator + [0.0, 0.0, np.sin(rise)] for rise in np.radians([-45.0, 0.0, 45.0])]
    points = np.concatenate([*rings, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    return Solid(tuple(_point(np.asarray(middle) + np.asarray(halves) * each) for each in points), heat)


def limb(start: Point3, stop: Point3, first: float, last: float, heat: str = "temperature_k", sides: int = 6) -> Solid:
    """A round solid from one point to another, of the radii `first` and `last` at its ends."""
    along = np.subtract(stop, start)
    along = along / np.linalg.norm(along)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across /= np.linalg.norm(across)
    other = np.cross(along, across)
    angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    rim = np.outer(np.cos(angles), across) + np.outer(np.sin(angles), other)
    rings = [np.asarray(start) + first * rim, np.asarray(stop) + last * rim]
    return Solid(tuple(_point(each) for each in np.concatenate(rings)), heat)


def wheel(middle: Point3, radius: float, wide: float, heat: str = "temperature_k") -> Solid:
    """A disc about an axis along y, `wide` across, its middle at `middle`."""
    return limb(
        (middle[0], middle[1] - wide / 2, middle[2]),
        (middle[0], middle[1] + wide / 2, middle[2]),
        radius,
        radius,
        heat,
        sides=10,
    )


def mirrored(solid: Solid) -> Solid:
    """The same on the other side; what is on a joint 'left…' is on 'right…' there."""
    joint = "right" + solid.joint[4:] if solid.joint.startswith("left") else solid.joint
    return Solid(tuple((x, -y, z) for x, y, z in solid.points), solid.heat, joint)


def shifted(solid: Solid, by: Point3) -> Solid:
    """The same elsewhere."""
    return replace(solid, points=tuple((x + by[0], y + by[1], z + by[2]) for x, y, z in solid.points))


def tilted(solid: Solid, rise: float) -> Solid:
    """The same, lifted by `rise` for each unit to the right of the middle: the dihedral of a right wing."""
    return replace(solid, points=tuple((x, y, z - rise * y) for x, y, z in solid.points))


def on(joint: str, *solids: Solid) -> tuple[Solid, ...]:
    """The same solids, moving with a joint."""
    return tuple(replace(solid, joint=joint) for solid in solids)


def _point(values: Floats) -> Point3:
    x, y, z = values.tolist()
    return x, y, z
