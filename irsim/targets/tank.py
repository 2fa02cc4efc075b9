"""A main battle tank."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Kelvin, Length
from irsim.motion.attitude import VEHICLE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, mirrored, plate, profile, tube, wheel

_TRACK = profile(
    ((0.5, -0.02), (0.49, -0.06), (-0.48, -0.06), (-0.5, -0.02), (-0.39, 0.12), (0.38, 0.12)), 0.15, 0.25, "tracks_k"
)
_TURRET = Solid(
    (
        *(
            (x, side * y, -0.11)
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


# Six road wheels a side, sprocket and idler higher, on the outside of the track: what meets it could not hide it.
_WHEELS = tuple(
    wheel((x, 0.262, z), radius, 0.02, "wheels_k")
    for x, z, radius in (
        *((place, 0.062, 0.05) for place in (0.31, 0.185, 0.06, -0.065, -0.19, -0.315)),
        (0.43, 0.0, 0.04),
        (-0.43, 0.0, 0.04),
    )
)


class Tank(Body):
    """Hull, turret and a long barrel, hot road wheels in warm tracks, and a hot engine deck at the rear."""

    lies: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    poses: ClassVar[tuple[Angles, ...]] = ((90.0, 0.0, 0.0), (110.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 288.0
    from_above_deg: ClassVar[float] = 12.0
    # Guinness World Records of 2002, a Scorpion: 82 km/h, 23 m/s; ungoverned ones of others are said to reach 100.
    fastest_m_s: ClassVar[float | None] = 30.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(((0.46, -0.05), (0.40, 0.07), (-0.44, 0.07), (-0.48, -0.09), (0.22, -0.11)), -0.15, 0.15),
        profile(((0.44, -0.06), (0.28, -0.11), (-0.47, -0.11), (-0.48, -0.06)), -0.25, 0.25),
        _TRACK,
        mirrored(_TRACK),
        plate(((-0.29, -0.16), (-0.29, 0.16), (-0.475, 0.16), (-0.475, -0.16)), -0.13, -0.11, "engine_k"),
        profile(((-0.4725, -0.06), (-0.45, 0.03), (-0.47, 0.03), (-0.4925, -0.06)), -0.14, 0.14, "engine_k"),
        _TURRET,
        *_WHEELS,
        *map(mirrored, _WHEELS),
        tube((0.14, -0.155, 0.034, 0.03), (0.24, -0.157, 0.026, 0.024), heat="turret_k"),
        tube((0.24, -0.157, 0.018, 0.018), (0.8, -0.167, 0.014, 0.014), heat="barrel_k"),
        tube((0.46, -0.161, 0.027, 0.027), (0.58, -0.163, 0.027, 0.027), heat="barrel_k"),
        plate(((-0.02, 0.03), (-0.02, 0.10), (-0.10, 0.10), (-0.10, 0.03)), -0.25, -0.20),
    )

    length_m: Length = 7.0
    """Length of the hull, m; the barrel reaches 0.3 of it further, as those of the common 120 and 125 mm guns do."""
    temperature_k: Kelvin = 298.0
    """Temperature of the hull, kelvin."""
    engine_k: Kelvin = 350.0
    """Temperature of the engine deck, kelvin."""
    turret_k: Kelvin = 304.0
    """Temperature of the turret, kelvin."""
    barrel_k: Kelvin = 316.0
    """Temperature of the barrel, kelvin: warm for a while after it has fired."""
    tracks_k: Kelvin = 308.0
    """Temperature of the tracks, kelvin."""
    wheels_k: Kelvin = 322.0
    """Temperature of the road wheels, whose rubber is kneaded, kelvin."""
