"""A passenger car."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.motion.attitude import VEHICLE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.solids import Point3, Solid, block, mirrored, plate, profile, wheel

# A saloon of 4.5 m: 1.8 m wide, 1.45 m high; the wheels' lower ends at z = 0.
_SILL, _BELT, _ROOF, _HALF = -0.06, -0.205, -0.32, 0.19
_WHEELS = tuple(wheel((x, 0.17, -0.07), 0.07, 0.05, "wheels_k") for x in (0.3, -0.29))


def _cabin(x_low: tuple[float, float], x_high: tuple[float, float]) -> tuple[Point3, ...]:
    """The glasshouse: back and front at the belt and at the roof, narrower above."""
    low = [(x, side * 0.175, _BELT) for x in x_low for side in (-1, 1)]
    return (*low, *((x, side * 0.135, _ROOF) for x in x_high for side in (-1, 1)))


_SIDE_GLASS = tuple(
    Solid(
        (
            (front_low, 0.177, _BELT - 0.012),
            (back_low, 0.177, _BELT - 0.012),
            (front_high, 0.143, _ROOF + 0.016),
            (back_high, 0.143, _ROOF + 0.016),
            ((front_low + back_low) / 2, 0.13, -0.26),
        ),
        "windows_k",
    )
    for front_low, back_low, front_high, back_high in ((0.155, -0.03, 0.055, -0.03), (-0.055, -0.24, -0.055, -0.17))
)


def _pane(low: float, high: float, inside: float) -> Solid:
    """Wind screen or rear window: x at the belt and at the roof, and a point behind the glass."""
    rim = [(low, side * 0.155, _BELT - 0.008) for side in (-1, 1)] + [
        (high, side * 0.125, _ROOF + 0.012) for side in (-1, 1)
    ]
    return Solid((*rim, (inside, 0.0, -0.24)), "windows_k")


class Car(Body):
    """A saloon car: warm bonnet and wheels, windows that mirror the cold sky."""

    lies: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    poses: ClassVar[tuple[Angles, ...]] = ((125.0, 0.0, 0.0), (90.0, 0.0, 0.0), (35.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 285.0
    from_above_deg: ClassVar[float] = 14.0
    # The Bugatti Chiron Super Sport 300+ of 2019: 490 km/h, 136 m/s.
    fastest_m_s: ClassVar[float | None] = 140.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(
            (
                (0.495, -0.07),
                (0.5, -0.12),
                (0.475, -0.165),
                (0.2, _BELT),
                (-0.42, -0.212),
                (-0.49, -0.2),
                (-0.5, -0.09),
                (-0.46, _SILL),
                (0.46, _SILL),
            ),
            -_HALF,
            _HALF,
        ),
        Solid(_cabin((0.2, -0.36), (0.03, -0.23))),
        *_SIDE_GLASS,
        *map(mirrored, _SIDE_GLASS),
        _pane(0.205, 0.045, 0.0),
        _pane(-0.365, -0.245, -0.2),
        plate(((0.46, -0.13), (0.46, 0.13), (0.24, 0.15), (0.24, -0.15)), -0.2, -0.17, "engine_k"),
        block((0.47, -0.1, -0.135), (0.503, 0.1, -0.085), "engine_k"),
        *_WHEELS,
        *map(mirrored, _WHEELS),
    )

    length_m: Length = 4.5
    """Length, m."""
    temperature_k: Kelvin = 295.0
    """Temperature of the body, kelvin."""
    engine_k: Kelvin = 312.0
    """Temperature of the bonnet and the grille, kelvin."""
    wheels_k: Kelvin = 308.0
    """Temperature of the wheels, kelvin."""
    windows_k: Kelvin = 285.0
    """Apparent temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.9
    """Emissivity of the windows: glass in the thermal infrared."""
