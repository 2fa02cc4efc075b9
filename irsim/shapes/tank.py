"""A main battle tank."""

from __future__ import annotations

from typing import ClassVar

from irsim.kinds import Kelvin, Metres
from irsim.shapes.base import Angles
from irsim.shapes.body import Body
from irsim.shapes.solids import Solid, mirrored, plate, profile, tube

_TRACK = profile(
    ((0.5, -0.02), (0.49, -0.06), (-0.48, -0.06), (-0.5, -0.02), (-0.39, 0.12), (0.38, 0.12)), 0.15, 0.25, "tracks_k"
)
_TURRET = Solid(
    (
        *(
            (x, side * y, -0.10)
            for side in (-1, 1)
            for x, y in ((0.24, 0.09), (0.10, 0.19), (-0.16, 0.19), (-0.26, 0.13))
        ),
        *(
            (x, side * y, -0.22)
            for side in (-1, 1)
            for x, y in ((0.10, 0.07), (0.04, 0.14), (-0.14, 0.14), (-0.20, 0.10))
        ),
    ),
    "turret_k",
)


class Tank(Body):
    """Hull, turret and barrel, warm running gear and a hot engine deck at the rear."""

    poses: ClassVar[tuple[Angles, ...]] = ((90.0, 0.0, 0.0), (110.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 288.0
    from_above_deg: ClassVar[float] = 12.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(((0.46, -0.05), (0.40, 0.07), (-0.44, 0.07), (-0.48, -0.09), (0.22, -0.11)), -0.16, 0.16),
        profile(((0.44, -0.05), (0.28, -0.11), (-0.47, -0.11), (-0.48, -0.05)), -0.25, 0.25),
        _TRACK,
        mirrored(_TRACK),
        plate(((-0.29, -0.16), (-0.29, 0.16), (-0.475, 0.16), (-0.475, -0.16)), -0.13, -0.105, "engine_k"),
        plate(((-0.47, -0.14), (-0.47, 0.14), (-0.495, 0.14), (-0.495, -0.14)), -0.1, -0.01, "engine_k"),
        _TURRET,
        tube((0.16, -0.155, 0.02, 0.02), (0.72, -0.165, 0.013, 0.013), heat="turret_k"),
        plate(((-0.02, 0.03), (-0.02, 0.10), (-0.10, 0.10), (-0.10, 0.03)), -0.25, -0.20),
    )

    length_m: Metres = 7.0
    """Length of the hull, m; the barrel reaches a fifth of it further."""
    engine_k: Kelvin = 350.0
    """Temperature of the engine deck, kelvin."""
    turret_k: Kelvin = 304.0
    """Temperature of turret and barrel, kelvin."""
    tracks_k: Kelvin = 315.0
    """Temperature of the tracks, kelvin."""
