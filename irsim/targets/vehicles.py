"""Vehicles: car, truck, tank and boat."""

from __future__ import annotations

from typing import ClassVar

from irsim.config.quantities import Fraction, Kelvin, Length
from irsim.motion.attitude import UPRIGHT, VEHICLE, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.parts import Point3, Solid, block, limb, mirrored, plate, profile, tube, wheel


def _both_sides(*points: Point3) -> tuple[Point3, ...]:
    """Return points and their mirror images, left and right."""
    return tuple((x, side * y, z) for x, y, z in points for side in (-1, 1))


# A saloon of 4.5 m: 1.8 m wide, 1.45 m high; the wheels' lower ends at z = 0.
_CAR_SILL, _CAR_BELT, _CAR_ROOF, _CAR_HALF = -0.06, -0.205, -0.32, 0.19
_CAR_WHEELS = tuple(wheel((x, 0.17, -0.07), 0.07, 0.05, "wheels_k") for x in (0.3, -0.29))


_CAR_SIDE_GLASS = tuple(
    Solid(
        (
            (front_low, 0.177, _CAR_BELT - 0.012),
            (back_low, 0.177, _CAR_BELT - 0.012),
            (front_high, 0.143, _CAR_ROOF + 0.016),
            (back_high, 0.143, _CAR_ROOF + 0.016),
            ((front_low + back_low) / 2, 0.13, -0.26),
        ),
        "windows_k",
    )
    for front_low, back_low, front_high, back_high in ((0.155, -0.03, 0.055, -0.03), (-0.055, -0.24, -0.055, -0.17))
)


def _car_pane(low: float, high: float, inside: float) -> Solid:
    """Return a windscreen or rear window: its x at the belt line and at the roof, and x of a point behind the glass."""
    rim = _both_sides((low, 0.155, _CAR_BELT - 0.008), (high, 0.125, _CAR_ROOF + 0.012))
    return Solid((*rim, (inside, 0.0, -0.24)), "windows_k")


class Car(Body):
    """A saloon car: warm bonnet and wheels, windows that reflect the cold sky."""

    default_posture: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    picture_poses: ClassVar[tuple[Angles, ...]] = ((125.0, 0.0, 0.0), (90.0, 0.0, 0.0), (35.0, 0.0, 0.0))
    picture_background_k: ClassVar[float] = 285.0
    picture_depression_deg: ClassVar[float] = 14.0
    # The Bugatti Chiron Super Sport 300+ of 2019: 490 km/h, 136 m/s.
    max_speed_m_s: ClassVar[float | None] = 140.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(
            (
                (0.495, -0.07),
                (0.5, -0.12),
                (0.475, -0.165),
                (0.2, _CAR_BELT),
                (-0.42, -0.212),
                (-0.49, -0.2),
                (-0.5, -0.09),
                (-0.46, _CAR_SILL),
                (0.46, _CAR_SILL),
            ),
            -_CAR_HALF,
            _CAR_HALF,
        ),
        Solid(
            _both_sides(*((x, 0.175, _CAR_BELT) for x in (0.2, -0.36)), *((x, 0.135, _CAR_ROOF) for x in (0.03, -0.23)))
        ),
        *_CAR_SIDE_GLASS,
        *map(mirrored, _CAR_SIDE_GLASS),
        _car_pane(0.205, 0.045, 0.0),
        _car_pane(-0.365, -0.245, -0.2),
        plate(((0.46, -0.13), (0.46, 0.13), (0.24, 0.15), (0.24, -0.15)), -0.2, -0.17, "engine_k"),
        block((0.47, -0.1, -0.135), (0.503, 0.1, -0.085), "engine_k"),
        *_CAR_WHEELS,
        *map(mirrored, _CAR_WHEELS),
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


# A two-axled lorry of 9 m: 2.5 m wide, 3.6 m high; the wheels' lower ends at z = 0.
_TRUCK_WHEELS = tuple(wheel((x, 0.12, -0.058), 0.058, 0.036, "wheels_k") for x in (0.36, -0.24, -0.36))
_TRUCK_SIDE_WINDOW = profile(((0.415, -0.2), (0.44, -0.265), (0.36, -0.265), (0.36, -0.2)), 0.13, 0.14, "windows_k")


class Truck(Body):
    """A lorry: cab with cold windows and a hot grille, a cool box, warm wheels, a hot exhaust stack."""

    default_posture: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    picture_poses: ClassVar[tuple[Angles, ...]] = ((125.0, 0.0, 0.0), (90.0, 0.0, 0.0), (35.0, 0.0, 0.0))
    picture_background_k: ClassVar[float] = 284.0
    picture_depression_deg: ClassVar[float] = 12.0
    # FIA limit for racing lorries: 160 km/h, 44 m/s.
    max_speed_m_s: ClassVar[float | None] = 50.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(((0.5, -0.06), (0.5, -0.18), (0.46, -0.29), (0.32, -0.29), (0.32, -0.06)), -0.135, 0.135, "cab_k"),
        Solid(
            _both_sides((0.5, 0.12, -0.188), (0.464, 0.115, -0.28), (0.506, 0.12, -0.19), (0.47, 0.115, -0.28)),
            "windows_k",
        ),
        _TRUCK_SIDE_WINDOW,
        mirrored(_TRUCK_SIDE_WINDOW),
        block((0.5, -0.1, -0.155), (0.508, 0.1, -0.075), "engine_k"),
        block((-0.5, -0.14, -0.4), (0.27, 0.14, -0.125)),
        block((-0.49, -0.06, -0.12), (0.32, 0.06, -0.07), "frame_k"),
        limb((0.295, 0.11, -0.1), (0.295, 0.11, -0.37), 0.014, 0.014, "engine_k"),
        limb((0.25, 0.1, -0.09), (0.08, 0.1, -0.09), 0.03, 0.03, "frame_k"),
        *_TRUCK_WHEELS,
        *map(mirrored, _TRUCK_WHEELS),
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


_TANK_TRACK = profile(
    ((0.5, -0.02), (0.49, -0.06), (-0.48, -0.06), (-0.5, -0.02), (-0.39, 0.12), (0.38, 0.12)), 0.15, 0.25, "tracks_k"
)
_TANK_TURRET = Solid(
    _both_sides(
        *((x, y, -0.11) for x, y in ((0.24, 0.09), (0.10, 0.19), (-0.16, 0.19), (-0.26, 0.13))),
        *((x, y, -0.22) for x, y in ((0.10, 0.07), (0.04, 0.14), (-0.14, 0.14), (-0.20, 0.10))),
    ),
    "turret_k",
)


# Six road wheels a side, sprocket and idler higher, clear of the track: the depth order of touching parts is undefined.
_TANK_WHEELS = tuple(
    wheel((x, 0.262, z), radius, 0.02, "wheels_k")
    for x, z, radius in (
        *((place, 0.062, 0.05) for place in (0.31, 0.185, 0.06, -0.065, -0.19, -0.315)),
        (0.43, 0.0, 0.04),
        (-0.43, 0.0, 0.04),
    )
)


class Tank(Body):
    """A tank: hull, turret and a long barrel, hot road wheels in warm tracks, and a hot engine deck at the rear."""

    default_posture: ClassVar[Posture] = VEHICLE
    grounded: ClassVar[bool] = True
    picture_poses: ClassVar[tuple[Angles, ...]] = ((90.0, 0.0, 0.0), (110.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    picture_background_k: ClassVar[float] = 288.0
    picture_depression_deg: ClassVar[float] = 12.0
    # Guinness World Records of 2002, a Scorpion: 82 km/h, 23 m/s; ungoverned tanks reportedly reach 100 km/h.
    max_speed_m_s: ClassVar[float | None] = 30.0
    solids: ClassVar[tuple[Solid, ...]] = (
        profile(((0.46, -0.05), (0.40, 0.07), (-0.44, 0.07), (-0.48, -0.09), (0.22, -0.11)), -0.15, 0.15),
        profile(((0.44, -0.06), (0.28, -0.11), (-0.47, -0.11), (-0.48, -0.06)), -0.25, 0.25),
        _TANK_TRACK,
        mirrored(_TANK_TRACK),
        plate(((-0.29, -0.16), (-0.29, 0.16), (-0.475, 0.16), (-0.475, -0.16)), -0.13, -0.11, "engine_k"),
        profile(((-0.4725, -0.06), (-0.45, 0.03), (-0.47, 0.03), (-0.4925, -0.06)), -0.14, 0.14, "engine_k"),
        _TANK_TURRET,
        *_TANK_WHEELS,
        *map(mirrored, _TANK_WHEELS),
        tube((0.14, -0.155, 0.034, 0.03), (0.24, -0.157, 0.026, 0.024), material="turret_k"),
        tube((0.24, -0.157, 0.018, 0.018), (0.8, -0.167, 0.014, 0.014), material="barrel_k"),
        tube((0.46, -0.161, 0.027, 0.027), (0.58, -0.163, 0.027, 0.027), material="barrel_k"),
        plate(((-0.02, 0.03), (-0.02, 0.10), (-0.10, 0.10), (-0.10, 0.03)), -0.25, -0.20),
    )

    length_m: Length = 7.0
    """Length of the hull, m; the barrel extends beyond it by 0.3 hull lengths, as common 120 and 125 mm guns do."""
    temperature_k: Kelvin = 298.0
    """Temperature of the hull, kelvin."""
    engine_k: Kelvin = 350.0
    """Temperature of the engine deck, kelvin."""
    turret_k: Kelvin = 304.0
    """Temperature of the turret, kelvin."""
    barrel_k: Kelvin = 316.0
    """Temperature of the barrel, kelvin; the default is for a gun fired recently."""
    tracks_k: Kelvin = 308.0
    """Temperature of the tracks, kelvin."""
    wheels_k: Kelvin = 322.0
    """Temperature of the road wheels, kelvin: flexing of the rubber heats them."""


# The part above water of a patrol boat of 25 m, with the water line at z = 0.
_BOAT_WINDOWS = block((0.05, 0.088, -0.2), (0.2, 0.094, -0.165), "windows_k")


class Boat(Body):
    """A patrol boat above its water line: hull, deck house with windows, mast, and a hot funnel."""

    default_posture: ClassVar[Posture] = UPRIGHT
    grounded: ClassVar[bool] = True
    picture_poses: ClassVar[tuple[Angles, ...]] = ((115.0, 0.0, 0.0), (90.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    picture_background_k: ClassVar[float] = 282.0
    picture_depression_deg: ClassVar[float] = 4.0
    # The Skjold class of patrol boats: 60 kn, 31 m/s; the hydrofoil HMCS Bras d'Or: 63 kn (1969).
    max_speed_m_s: ClassVar[float | None] = 40.0
    solids: ClassVar[tuple[Solid, ...]] = (
        Solid(
            (
                *_both_sides(*((x, y, -0.09) for x, y in ((-0.5, 0.1), (0.18, 0.12), (-0.1, 0.125)))),
                *_both_sides((0.36, 0.07, -0.112), (-0.48, 0.09, 0.0), (0.12, 0.09, 0.0)),
                (0.5, 0.0, -0.125),
                (0.42, 0.0, 0.0),
            ),
            "hull_k",
        ),
        profile(((0.24, -0.095), (0.21, -0.15), (-0.26, -0.15), (-0.26, -0.09)), -0.09, 0.09),
        profile(((0.21, -0.15), (0.17, -0.225), (0.0, -0.225), (-0.02, -0.15)), -0.085, 0.085),
        _BOAT_WINDOWS,
        mirrored(_BOAT_WINDOWS),
        Solid(
            _both_sides((0.207, 0.075, -0.163), (0.187, 0.075, -0.2), (0.195, 0.075, -0.16), (0.175, 0.075, -0.2)),
            "windows_k",
        ),
        profile(((-0.08, -0.15), (-0.1, -0.25), (-0.18, -0.25), (-0.18, -0.15)), -0.04, 0.04, "funnel_k"),
        limb((0.02, 0.0, -0.22), (-0.01, 0.0, -0.42), 0.012, 0.006),
        block((-0.012, -0.055, -0.34), (0.012, 0.055, -0.328)),
        block((-0.46, -0.05, -0.13), (-0.34, 0.05, -0.09)),
    )

    length_m: Length = 25.0
    """Length, m."""
    temperature_k: Kelvin = 294.0
    """Temperature of the deck house and mast, kelvin."""
    hull_k: Kelvin = 291.0
    """Temperature of the hull, kelvin."""
    funnel_k: Kelvin = 325.0
    """Temperature of the funnel, kelvin."""
    windows_k: Kelvin = 284.0
    """Apparent temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.9
    """Emissivity of the windows: glass in the thermal infrared."""
