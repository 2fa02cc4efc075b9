"""A lorry."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.motion.attitude import VEHICLE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Solid, block, limb, mirrored, profile, wheel

# A two-axled lorry of 9 m: 2.5 m wide, 3.6 m high; the wheels' lower ends at z = 0.
_WHEELS = tuple(wheel((x, 0.12, -0.058), 0.058, 0.036, "wheels_k") for x in (0.36, -0.24, -0.36))
_SIDE_WINDOW = profile(((0.415, -0.2), (0.44, -0.265), (0.36, -0.265), (0.36, -0.2)), 0.13, 0.14, "windows_k")


class Truck(Body):
    """A lorry: cab with cold windows and a hot grille, a cool box, warm wheels, a hot exhaust stack."""

    lies: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    poses: ClassVar[tuple[Angles, ...]] = ((125.0, 0.0, 0.0), (90.0, 0.0, 0.0), (35.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 284.0
    from_above_deg: ClassVar[float] = 12.0
    # Racing lorries are held to 160 km/h, 44 m/s (FIA); those on roads to less.
    fastest_m_s: ClassVar[float | None] = 50.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(((0.5, -0.06), (0.5, -0.18), (0.46, -0.29), (0.32, -0.29), (0.32, -0.06)), -0.135, 0.135, "cab_k"),
        Solid(
            (
                (0.5, -0.12, -0.188),
                (0.5, 0.12, -0.188),
                (0.464, -0.115, -0.28),
                (0.464, 0.115, -0.28),
                (0.506, -0.12, -0.19),
                (0.506, 0.12, -0.19),
                (0.47, -0.115, -0.28),
                (0.47, 0.115, -0.28),
            ),
            "windows_k",
        ),
        _SIDE_WINDOW,
        mirrored(_SIDE_WINDOW),
        block((0.5, -0.1, -0.155), (0.508, 0.1, -0.075), "engine_k"),
        block((-0.5, -0.14, -0.4), (0.27, 0.14, -0.125)),
        block((-0.49, -0.06, -0.12), (0.32, 0.06, -0.07), "frame_k"),
        limb((0.295, 0.11, -0.1), (0.295, 0.11, -0.37), 0.014, 0.014, "engine_k"),
        limb((0.25, 0.1, -0.09), (0.08, 0.1, -0.09), 0.03, 0.03, "frame_k"),
        *_WHEELS,
        *map(mirrored, _WHEELS),
    )

    length_m: Length = 9.0
    """Length, m."""
    temperature_k: Kelvin = 292.5
    """Temperature of the box, kelvin."""
    cab_k: Kelvin = 297.0
    """Temperature of the cab, kelvin."""
    frame_k: Kelvin = 300.0
    """Temperature of frame and tank below the box, kelvin."""
    engine_k: Kelvin = 318.0
    """Temperature of grille and exhaust stack, kelvin."""
    wheels_k: Kelvin = 307.0
    """Temperature of the wheels, kelvin."""
    windows_k: Kelvin = 285.0
    """Apparent temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.9
    """Emissivity of the windows: glass in the thermal infrared."""
