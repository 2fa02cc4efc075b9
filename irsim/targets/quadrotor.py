"""A small drone with four rotors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, Length, NotNegative
from irsim.motion.attitude import MULTIROTOR, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.joints import Rigid, Turn, hinge, turned
from irsim.targets.solids import Solid, ball, limb, on, plate, tube

_HUBS = {"fl": (0.29, -0.33), "fr": (0.29, 0.33), "rl": (-0.29, -0.33), "rr": (-0.29, 0.33)}
_TOP = -0.1
_REACH = 0.21


def _corner(name: str) -> tuple[Solid, ...]:
    """Arm up to the motor, motor, leg and rotor of one corner."""
    x, y = _HUBS[name]
    blades = plate(
        tuple((x + dx, y + dy) for dx, dy in ((_REACH, 0.022), (_REACH, -0.022), (-_REACH, -0.022), (-_REACH, 0.022))),
        _TOP - 0.012,
        _TOP,
        "rotors_k",
    )
    return (
        limb((x * 0.25, y * 0.2, -0.02), (x * 0.89, y * 0.883, -0.03), 0.035, 0.028),
        limb((x, y, 0.0), (x, y, _TOP), 0.045, 0.042, "motors_k", sides=8),
        limb((x, y, 0.0), (x, y, 0.11), 0.02, 0.012),
        *on(name, blades),
    )


class Quadrotor(Body):
    """A drone: body with a warm battery, four arms with warm motors and turning rotors, a camera below."""

    lies: ClassVar[Posture] = MULTIROTOR
    switches: ClassVar[Switches] = {"rotor": ("rotor_hz", 0.0)}
    alike: ClassVar[Mapping[str, int]] = {"rotor_hz": 2}
    poses: ClassVar[tuple[Angles, ...]] = ((30.0, 0.0, 0.0), (60.0, -20.0, 0.0), (80.0, -4.0, 8.0))
    from_above_deg: ClassVar[float] = -20.0
    # Guinness World Records of 2024, a racing drone: 480 km/h, 133 m/s.
    fastest_m_s: ClassVar[float | None] = 135.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube(
            (0.24, -0.01, 0.05, 0.04), (0.15, -0.02, 0.1, 0.07), (-0.17, -0.02, 0.1, 0.07), (-0.24, -0.02, 0.06, 0.04)
        ),
        plate(((0.0, -0.065), (0.0, 0.065), (-0.2, 0.065), (-0.2, -0.065)), -0.12, -0.085, "battery_k"),
        ball((0.2, 0.0, 0.067), (0.043, 0.043, 0.043), "motors_k"),
        *(solid for name in _HUBS for solid in _corner(name)),
    )

    length_m: Length = 0.45
    """Length over the rotors of a side, m: 0.45 for a camera drone, above 1 for one that carries loads."""
    temperature_k: Kelvin = 294.0
    """Temperature of body and arms, kelvin."""
    motors_k: Kelvin = 320.0
    """Temperature of motors and camera, kelvin."""
    battery_k: Kelvin = 309.0
    """Temperature of the battery, kelvin."""
    rotors_k: Kelvin = 288.0
    """Temperature of the rotors, kelvin."""
    rotor_hz: NotNegative = 87.0  # at 90, half turns fit into frames of 30 Hz: they would seem to stand
    """Turns of the rotors a second; neighbours turn against each other."""
    rotor_deg: Turn = 20.0
    """Angle of the rotors in frame 0, degrees."""

    def joints(self, time: float) -> Mapping[str, Rigid]:
        turn = turned(self.rotor_deg, self.rotor_hz, time)
        signs = {"fl": 1, "fr": -1, "rl": -1, "rr": 1}
        return {name: hinge((x, y, 0.0), (0.0, 0.0, 1.0), signs[name] * turn) for name, (x, y) in _HUBS.items()}
