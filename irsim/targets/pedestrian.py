"""A person who walks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, Length, NotNegative
from irsim.motion.attitude import UPRIGHT, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.joints import Rigid, Turn, hinge, turned
from irsim.targets.solids import Solid, ball, limb, on

# Joints of an adult, shares of the height, the hips at the origin (Drillis and Contini, 1966).
_HIP, _KNEE, _ANKLE = (0.0, 0.05, 0.0), (0.0, 0.05, 0.245), (0.0, 0.05, 0.47)
_SHOULDER, _ELBOW, _WRIST = (0.0, 0.125, -0.27), (0.0, 0.14, -0.09), (0.0, 0.14, 0.05)
_ACROSS = (0.0, 1.0, 0.0)


def _side(side: int) -> tuple[Solid, ...]:
    """Arm and leg of one side: 1 right, -1 left."""
    name = "right" if side > 0 else "left"

    def at(point: tuple[float, float, float], x: float = 0.0, z: float = 0.0) -> tuple[float, float, float]:
        return point[0] + x, side * point[1], point[2] + z

    return (
        *on(f"{name}_hip", limb(at(_HIP, z=-0.02), at(_KNEE), 0.056, 0.036, sides=8)),
        *on(
            f"{name}_knee",
            limb(at(_KNEE, z=-0.02), at(_ANKLE), 0.036, 0.024),
            limb(at(_ANKLE, x=-0.03, z=0.015), at(_ANKLE, x=0.1, z=0.025), 0.024, 0.018, "shoes_k"),
        ),
        *on(f"{name}_shoulder", limb(at(_SHOULDER, z=-0.015), at(_ELBOW), 0.034, 0.027)),
        *on(
            f"{name}_elbow",
            limb(at(_ELBOW, z=-0.01), at(_WRIST), 0.027, 0.02),
            ball(at(_WRIST, z=0.03), (0.022, 0.016, 0.035), "face_k"),
        ),
    )


class Pedestrian(Body):
    """A walking person: warm face and hands, clothes less so, cool shoes; arms swing against the legs."""

    lies: ClassVar[Posture] = UPRIGHT
    switches: ClassVar[Switches] = {"stride": ("stride_hz", 0.0)}
    alike: ClassVar[Mapping[str, int]] = {"stride_hz": 1}
    grounded: ClassVar[bool] = True
    poses: ClassVar[tuple[Angles, ...]] = ((120.0, 0.0, 0.0), (90.0, 0.0, 0.0), (180.0, 0.0, 0.0))
    behind_k: ClassVar[float] = 287.0
    from_above_deg: ClassVar[float] = 8.0
    # U. Bolt, Berlin 2009: 12.4 m/s.
    fastest_m_s: ClassVar[float | None] = 12.5
    solids: ClassVar[tuple[Solid, ...]] = (
        ball((0.005, 0.0, -0.425), (0.054, 0.044, 0.068), "hair_k"),
        ball((0.03, 0.0, -0.412), (0.036, 0.036, 0.05), "face_k"),
        limb((0.005, 0.0, -0.37), (0.0, 0.0, -0.29), 0.028, 0.032, "face_k"),
        Solid(
            tuple(
                (x * deep, y * wide, z)
                for z, wide, deep in (
                    (-0.305, 0.06, 0.04),
                    (-0.285, 0.115, 0.055),
                    (-0.2, 0.112, 0.066),
                    (0.0, 0.088, 0.056),
                )
                for x, y in ((1, 0.5), (1, -0.5), (-1, 0.5), (-1, -0.5), (0, 1), (0, -1))
            )
        ),
        Solid(
            tuple(
                (x * deep, y * wide, z)
                for z, wide, deep in ((-0.04, 0.09, 0.056), (0.045, 0.098, 0.066))
                for x, y in ((1, 0.5), (1, -0.5), (-1, 0.5), (-1, -0.5), (0, 1), (0, -1))
            )
        ),
        *_side(1),
        *_side(-1),
    )

    length_m: Length = 1.75
    """Height, m."""
    temperature_k: Kelvin = 298.0
    """Temperature of the clothes, kelvin."""
    face_k: Kelvin = 306.0
    """Temperature of face, neck and hands, kelvin."""
    hair_k: Kelvin = 300.0
    """Temperature of the hair, kelvin."""
    shoes_k: Kelvin = 293.0
    """Temperature of the shoes, kelvin."""
    stride_hz: NotNegative = 0.95
    """Strides (two steps) a second."""
    stride_deg: Annotated[float, Field(ge=0, le=60)] = 24.0
    """The thighs' angle ahead of upright and behind it at the ends of a step, degrees."""
    phase_deg: Turn = 80.0
    """Place in the stride in frame 0, degrees; at 90 the right leg is ahead."""

    def joints(self, time: float) -> Mapping[str, Rigid]:
        phase = turned(self.phase_deg, self.stride_hz, time)
        size = math.radians(self.stride_deg)
        joints: dict[str, Rigid] = {}
        for name, side, own in (("right", 1, phase), ("left", -1, phase + math.pi)):
            hip, knee, shoulder, elbow = ((x, side * y, z) for x, y, z in (_HIP, _KNEE, _SHOULDER, _ELBOW))
            thigh = hinge(hip, _ACROSS, size * math.sin(own))
            # The knee bends while the leg swings forward, most a quarter of a turn before it is ahead.
            shin = hinge(knee, _ACROSS, -size * (0.35 + 1.0 * max(0.0, math.cos(own + 0.35)) ** 2))
            arm = hinge(shoulder, _ACROSS, -0.9 * size * math.sin(own))
            joints |= {
                f"{name}_hip": thigh,
                f"{name}_knee": thigh @ shin,
                f"{name}_shoulder": arm,
                f"{name}_elbow": arm @ hinge(elbow, _ACROSS, 0.9 * size),
            }
        return joints
