"""Drones beside the quadrotor: hexacopter and fixed wing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, Length, NotNegative
from irsim.motion.attitude import AEROPLANE, MULTIROTOR, Posture
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
    tilted,
    tube,
)

# Proportions of the common cargo and survey hexacopters: 1.67 m over the rotor tips, rotors of 0.53 m.
_RADIUS, _ROTOR_RADIUS, _ROTOR_Z = 0.393, 0.16, -0.075
_HUBS = {
    f"rotor{number}": (_RADIUS * math.cos(math.radians(angle)), _RADIUS * math.sin(math.radians(angle)))
    for number, angle in enumerate(range(30, 390, 60), 1)
}


def _arm(name: str) -> tuple[Solid, ...]:
    """Return arm, motor and rotor at one hub of the hexacopter."""
    x, y = _HUBS[name]
    tip, chord = _ROTOR_RADIUS, 0.015
    blades = plate(
        tuple((x + dx, y + dy) for dx, dy in ((tip, chord), (tip, -chord), (-tip, -chord), (-tip, chord))),
        _ROTOR_Z - 0.008,
        _ROTOR_Z,
        "rotors_k",
    )
    return (
        limb((x * 0.2, y * 0.2, -0.01), (x * 0.92, y * 0.92, -0.01), 0.02, 0.016),
        limb((x, y, 0.005), (x, y, _ROTOR_Z), 0.03, 0.028, "motors_k", sides=8),
        *attached(name, blades),
    )


class Hexacopter(Body):
    """A larger drone: six arms with warm motors and turning rotors, a warm battery, landing gear."""

    default_posture: ClassVar[Posture] = MULTIROTOR
    switches: ClassVar[Switches] = {"rotor": ("rotor_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"rotor_hz": 2}
    picture_poses: ClassVar[tuple[Angles, ...]] = ((30.0, 0.0, 0.0), (60.0, -20.0, 0.0), (80.0, -4.0, 8.0))
    picture_depression_deg: ClassVar[float] = -20.0
    # As for the quadrotor: Guinness World Records of 2024, a racing drone: 480 km/h, 133 m/s.
    max_speed_m_s: ClassVar[float | None] = 135.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.12, -0.01, 0.05, 0.03),
            (0.08, -0.015, 0.09, 0.045),
            (-0.08, -0.015, 0.09, 0.045),
            (-0.12, -0.01, 0.05, 0.03),
        ),
        plate(((0.07, -0.06), (0.07, 0.06), (-0.07, 0.06), (-0.07, -0.06)), -0.1, -0.062, "battery_k"),
        ball((0.05, 0.0, 0.09), (0.035, 0.035, 0.035), "motors_k"),
        *(solid for name in _HUBS for solid in _arm(name)),
        *(limb((x, side * 0.09, 0.02), (x, side * 0.17, 0.21), 0.01, 0.01) for x in (0.07, -0.07) for side in (-1, 1)),
        *(limb((-0.16, side * 0.17, 0.21), (0.16, side * 0.17, 0.21), 0.01, 0.01) for side in (-1, 1)),
    )

    length_m: Length = 1.67
    """Length from the front to the rear rotor tips, m."""
    temperature_k: Kelvin = 294.0
    """Temperature of body and arms, kelvin."""
    motors_k: Kelvin = 318.0
    """Temperature of motors and camera, kelvin."""
    battery_k: Kelvin = 308.0
    """Temperature of the battery, kelvin."""
    rotors_k: Kelvin = 288.0
    """Temperature of the rotors, kelvin."""
    rotor_hz: NotNegative = 52.0
    """Rotation rate of the rotors, turns a second; adjacent rotors turn in opposite directions."""
    rotor_deg: JointAngle = 20.0
    """Angle of the rotors in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        turn = joint_angle(self.rotor_deg, self.rotor_hz, time)
        return {
            name: hinge((x, y, 0.0), (0.0, 0.0, 1.0), turn if number % 2 else -turn)
            for number, (name, (x, y)) in enumerate(_HUBS.items())
        }


# Proportions of the common small reconnaissance drones without a tail: 1.6 m long, 3.1 m span, winglets, a pusher
# propeller.
_WING = tilted(plate(((0.04, 0.04), (-0.21, 0.97), (-0.31, 0.97), (-0.16, 0.04)), -0.055, -0.035), 0.02)
_WINGLET = profile(((-0.2, -0.05), (-0.29, -0.22), (-0.34, -0.22), (-0.32, -0.05)), 0.962, 0.972)
_HUB = (-0.46, 0.0, -0.01)


class FixedWing(Body):
    """A drone with swept wings, winglets, a warm engine and a pusher propeller."""

    default_posture: ClassVar[Posture] = AEROPLANE
    switches: ClassVar[Switches] = {"propeller": ("propeller_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"propeller_hz": 2}
    picture_poses: ClassVar[tuple[Angles, ...]] = ((70.0, 10.0, -50.0), (90.0, 0.0, 0.0), (20.0, 10.0, -60.0))
    # MQ-9 Reaper, a large one: 240 kn, 123 m/s (US Air Force, fact sheet).
    max_speed_m_s: ClassVar[float | None] = 125.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.5, 0.0, 0.02, 0.02), (0.44, 0.0, 0.05, 0.05), (0.34, -0.01, 0.065, 0.07)),
        tube((0.34, -0.01, 0.065, 0.07), (-0.2, -0.01, 0.06, 0.065), (-0.3, -0.01, 0.05, 0.055)),
        tube(
            (-0.28, -0.01, 0.052, 0.058), (-0.4, -0.01, 0.045, 0.045), (-0.44, -0.01, 0.02, 0.02), material="engine_k"
        ),
        _WING,
        mirrored(_WING),
        _WINGLET,
        mirrored(_WINGLET),
        ball((0.37, 0.0, 0.075), (0.04, 0.04, 0.04), "camera_k"),
        limb((-0.43, 0.0, -0.01), _HUB, 0.012, 0.012),
        *attached("propeller", block((-0.468, -0.014, -0.14), (-0.456, 0.014, 0.12), "propeller_k")),
    )

    length_m: Length = 1.6
    """Length, m; the span is 1.94 lengths."""
    temperature_k: Kelvin = 284.0
    """Temperature of the skin, kelvin."""
    engine_k: Kelvin = 345.0
    """Temperature of the engine's cowling, kelvin."""
    camera_k: Kelvin = 296.0
    """Temperature of the camera, kelvin."""
    propeller_k: Kelvin = 284.0
    """Temperature of the propeller, kelvin."""
    propeller_hz: NotNegative = 97.0
    """Rotation rate of the propeller, turns a second."""
    propeller_deg: JointAngle = 20.0
    """Angle of the propeller in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        return {"propeller": hinge(_HUB, (1.0, 0.0, 0.0), joint_angle(self.propeller_deg, self.propeller_hz, time))}
