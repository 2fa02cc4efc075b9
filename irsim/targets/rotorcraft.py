"""Rotorcraft: helicopter and quadrotor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Kelvin, Length, NotNegative
from irsim.motion.attitude import HELICOPTER, MULTIROTOR, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.parts import (
    JointAngle,
    RigidTransform,
    Solid,
    attached,
    ball,
    block,
    hinge,
    joint_angle,
    limb,
    mirrored,
    plate,
    profile,
    shifted,
    tube,
)

_MAST = (0.1, 0.0, -0.24)
_TAIL_HUB = (-0.56, 0.035, -0.2)


def _main_blade(quarter: int) -> Solid:
    """Return one of the four main blades, a quarter turn after the previous one."""
    along = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter]
    corners = ((0.023, 0.018), (0.56, 0.018), (0.56, -0.018), (0.023, -0.018))
    outline = tuple((r * along[0] - s * along[1] + _MAST[0], r * along[1] + s * along[0]) for r, s in corners)
    return plate(outline, _MAST[2] - 0.008, _MAST[2] + 0.004, "rotor_k")


_TAIL_BLADES = tuple(
    shifted(profile(outline, -0.006, 0.006, "rotor_k"), _TAIL_HUB)
    for outline in (
        ((0.09, 0.014), (0.09, -0.014), (-0.09, -0.014), (-0.09, 0.014)),
        ((0.014, 0.09), (-0.014, 0.09), (-0.014, -0.09), (0.014, -0.09)),
    )
)
_WINDOW = Solid(
    ((0.43, 0.072, 0.0), (0.3, 0.094, 0.0), (0.3, 0.082, -0.075), (0.39, 0.05, -0.07), (0.3, 0.05, -0.05)), "windows_k"
)
_SKID = limb((0.38, 0.085, 0.165), (-0.06, 0.085, 0.165), 0.01, 0.01)
_STRUTS = tuple(limb((x, 0.085, 0.165), (x, 0.05, 0.08), 0.009, 0.009) for x in (0.28, 0.03))
_EXHAUST = shifted(
    tube((-0.08, -0.155, 0.03, 0.03), (-0.14, -0.16, 0.026, 0.026), material="engine_k"), (0.0, 0.045, 0.0)
)


class Helicopter(Body):
    """A four-bladed helicopter: cabin, tail boom, turning main and tail rotor, hot exhausts below the mast."""

    default_posture: ClassVar[Posture] = HELICOPTER
    switches: ClassVar[Switches] = {"rotor": ("rotor_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"rotor_hz": 4}
    picture_poses: ClassVar[tuple[Angles, ...]] = ((65.0, -4.0, 8.0), (90.0, 0.0, 0.0), (150.0, 0.0, 0.0))
    # Eurocopter X3, a compound helicopter: 255 kn, 131 m/s (2013); Westland Lynx: 111 m/s (1986).
    max_speed_m_s: ClassVar[float | None] = 135.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.47, 0.04, 0.03, 0.03),
            (0.42, 0.025, 0.068, 0.065),
            (0.31, -0.002, 0.09, 0.1),
            (0.04, -0.005, 0.09, 0.105),
        ),
        tube((0.04, -0.005, 0.09, 0.105), (-0.08, -0.035, 0.06, 0.07), (-0.16, -0.055, 0.035, 0.04)),
        tube((-0.12, -0.055, 0.035, 0.036), (-0.54, -0.085, 0.018, 0.02)),
        profile(((-0.46, -0.08), (-0.55, -0.235), (-0.6, -0.235), (-0.56, -0.07)), -0.009, 0.009),
        plate(((-0.42, -0.13), (-0.42, 0.13), (-0.48, 0.13), (-0.48, -0.13)), -0.09, -0.078),
        block((-0.08, -0.06, -0.17), (0.2, 0.06, -0.1)),
        _EXHAUST,
        mirrored(_EXHAUST),
        limb((_MAST[0], 0.0, -0.16), _MAST, 0.022, 0.016, "engine_k"),
        _WINDOW,
        mirrored(_WINDOW),
        ball((0.4, 0.0, 0.095), (0.035, 0.035, 0.03), "windows_k"),
        _SKID,
        mirrored(_SKID),
        *_STRUTS,
        *map(mirrored, _STRUTS),
        *attached("rotor", *map(_main_blade, range(4))),
        *attached("tail", *_TAIL_BLADES),
    )

    length_m: Length = 14.0
    """Length of the fuselage with its tail, m; the diameter of the main rotor is 1.16 times this length."""
    temperature_k: Kelvin = 290.0
    """Temperature of the skin, kelvin."""
    engine_k: Kelvin = 460.0
    """Temperature of exhausts and rotor head, kelvin."""
    rotor_k: Kelvin = 283.0
    """Temperature of the blades, kelvin."""
    windows_k: Kelvin = 278.0
    """Temperature of the windows, kelvin."""
    windows_emissivity: Fraction = 0.85
    """Emissivity of the windows: glass in the thermal infrared."""
    rotor_hz: NotNegative = 4.3
    """Rotation rate of the main rotor, turns a second; the tail rotor turns five times as fast."""
    rotor_deg: JointAngle = 30.0
    """Angle of the main rotor in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        turn = joint_angle(self.rotor_deg, self.rotor_hz, time)
        return {"rotor": hinge(_MAST, (0.0, 0.0, 1.0), -turn), "tail": hinge(_TAIL_HUB, (0.0, 1.0, 0.0), 5 * turn)}


_MOTORS = {"fl": (0.29, -0.33), "fr": (0.29, 0.33), "rl": (-0.29, -0.33), "rr": (-0.29, 0.33)}
_ROTOR_Z = -0.1
_ROTOR_RADIUS = 0.21


def _motor_corner(name: str) -> tuple[Solid, ...]:
    """Return arm, motor, leg and rotor at one corner of a quadrotor."""
    x, y = _MOTORS[name]
    tip = _ROTOR_RADIUS
    blades = plate(
        tuple((x + dx, y + dy) for dx, dy in ((tip, 0.022), (tip, -0.022), (-tip, -0.022), (-tip, 0.022))),
        _ROTOR_Z - 0.012,
        _ROTOR_Z,
        "rotors_k",
    )
    return (
        limb((x * 0.25, y * 0.2, -0.02), (x * 0.89, y * 0.883, -0.03), 0.035, 0.028),
        limb((x, y, 0.0), (x, y, _ROTOR_Z), 0.045, 0.042, "motors_k", sides=8),
        limb((x, y, 0.0), (x, y, 0.11), 0.02, 0.012),
        *attached(name, blades),
    )


class Quadrotor(Body):
    """A drone: body with a warm battery, four arms with warm motors and turning rotors, a camera below."""

    default_posture: ClassVar[Posture] = MULTIROTOR
    switches: ClassVar[Switches] = {"rotor": ("rotor_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"rotor_hz": 2}
    picture_poses: ClassVar[tuple[Angles, ...]] = ((30.0, 0.0, 0.0), (60.0, -20.0, 0.0), (80.0, -4.0, 8.0))
    picture_depression_deg: ClassVar[float] = -20.0
    # Guinness World Records of 2024, a racing drone: 480 km/h, 133 m/s.
    max_speed_m_s: ClassVar[float | None] = 135.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.24, -0.01, 0.05, 0.04), (0.15, -0.02, 0.1, 0.07), (-0.17, -0.02, 0.1, 0.07), (-0.24, -0.02, 0.06, 0.04)
        ),
        plate(((0.0, -0.065), (0.0, 0.065), (-0.2, 0.065), (-0.2, -0.065)), -0.12, -0.085, "battery_k"),
        ball((0.2, 0.0, 0.067), (0.043, 0.043, 0.043), "motors_k"),
        *(solid for name in _MOTORS for solid in _motor_corner(name)),
    )

    length_m: Length = 0.45
    """Length from the front to the rear rotor tips, m: 0.45 for a camera drone, above 1 for a cargo drone."""
    temperature_k: Kelvin = 294.0
    """Temperature of body and arms, kelvin."""
    motors_k: Kelvin = 320.0
    """Temperature of motors and camera, kelvin."""
    battery_k: Kelvin = 309.0
    """Temperature of the battery, kelvin."""
    rotors_k: Kelvin = 288.0
    """Temperature of the rotors, kelvin."""
    rotor_hz: NotNegative = 87.0  # at 90, half turns fit into frames of 30 Hz: the rotors would appear at rest
    """Rotation rate of the rotors, turns a second; adjacent rotors turn in opposite directions."""
    rotor_deg: JointAngle = 20.0
    """Angle of the rotors in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        turn = joint_angle(self.rotor_deg, self.rotor_hz, time)
        signs = {"fl": 1, "fr": -1, "rl": -1, "rr": 1}
        return {name: hinge((x, y, 0.0), (0.0, 0.0, 1.0), signs[name] * turn) for name, (x, y) in _MOTORS.items()}
