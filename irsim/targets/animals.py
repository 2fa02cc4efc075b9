"""Animals and people: bird and pedestrian."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, Length, NotNegative
from irsim.motion.attitude import BIRD, UPRIGHT, Posture
from irsim.targets.base import Angles
from irsim.targets.body import Body
from irsim.targets.parts import (
    JointAngle,
    RigidTransform,
    Solid,
    attached,
    ball,
    hinge,
    joint_angle,
    limb,
    mirrored,
    plate,
    tube,
)

# A gull: span 2.2 times the length from bill to tail.
_BEND_Y = 0.5
_INNER_WING = plate(((0.19, 0.06), (0.24, _BEND_Y), (0.02, _BEND_Y), (-0.08, 0.06)), -0.035, -0.015, "wings_k")
_OUTER_WING = plate(
    ((0.24, _BEND_Y), (0.1, 0.95), (-0.02, 1.1), (-0.03, 0.9), (0.02, _BEND_Y)), -0.032, -0.018, "wings_k"
)


class Bird(Body):
    """A gull-like bird: warm head and body, cooler wings that beat and bend, a fan of a tail."""

    default_posture: ClassVar[Posture] = BIRD
    switches: ClassVar[Switches] = {"beat": ("beat_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"beat_hz": 1}
    picture_poses: ClassVar[tuple[Angles, ...]] = ((55.0, 15.0, 15.0), (90.0, 0.0, 0.0), (20.0, 5.0, 0.0))
    # A peregrine's stoop: 242 mph, 108 m/s (K. Franklin's Frightful, 1999).
    max_speed_m_s: ClassVar[float | None] = 110.0
    solids: ClassVar[tuple[Solid, ...]] = (
        tube((0.32, -0.01, 0.06, 0.06), (0.2, 0.0, 0.095, 0.095), (0.0, 0.005, 0.1, 0.1), (-0.22, 0.0, 0.05, 0.045)),
        ball((0.38, 0.0, -0.015), (0.085, 0.07, 0.07), "head_k"),
        limb((0.467, 0.0, 0.005), (0.54, 0.0, 0.017), 0.03, 0.006),
        plate(((-0.22, -0.05), (-0.22, 0.05), (-0.5, 0.13), (-0.5, -0.13)), -0.02, 0.005, "wings_k"),
        *attached("left_arm", mirrored(_INNER_WING)),
        *attached("right_arm", _INNER_WING),
        *attached("left_hand", mirrored(_OUTER_WING)),
        *attached("right_hand", _OUTER_WING),
    )

    length_m: Length = 0.6
    """Length from bill to tail, m; the wings span 2.2 times this length."""
    temperature_k: Kelvin = 300.0
    """Temperature of the plumage of the body, kelvin."""
    head_k: Kelvin = 307.0
    """Temperature of the head, kelvin."""
    wings_k: Kelvin = 290.0
    """Temperature of wings and tail, kelvin."""
    beat_hz: NotNegative = 3.0
    """Rate of the wing beats, beats a second."""
    beat_deg: Annotated[float, Field(ge=0, le=80)] = 38.0
    """Amplitude of the beat: angle of the wings above and below level, degrees."""
    phase_deg: JointAngle = 70.0
    """Phase of the beat in frame 0, degrees; at 90 the wings are up."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        phase = joint_angle(self.phase_deg, self.beat_hz, time)
        lift = math.radians(self.beat_deg) * math.sin(phase)
        # The outer wing lags behind, and bends down more than up.
        bend = math.radians(self.beat_deg) * (0.6 * math.sin(phase - 1.2) - 0.25)
        right = hinge((0.0, 0.05, -0.025), (1.0, 0.0, 0.0), -lift)
        left = hinge((0.0, -0.05, -0.025), (1.0, 0.0, 0.0), lift)
        return {
            "right_arm": right,
            "left_arm": left,
            "right_hand": right @ hinge((0.0, _BEND_Y, -0.025), (1.0, 0.0, 0.0), -bend),
            "left_hand": left @ hinge((0.0, -_BEND_Y, -0.025), (1.0, 0.0, 0.0), bend),
        }


# Joints of an adult, shares of the height, the hips at the origin (Drillis and Contini, 1966).
_HIP, _KNEE, _ANKLE = (0.0, 0.05, 0.0), (0.0, 0.05, 0.245), (0.0, 0.05, 0.47)
_SHOULDER, _ELBOW, _WRIST = (0.0, 0.125, -0.27), (0.0, 0.14, -0.09), (0.0, 0.14, 0.05)
_Y_AXIS = (0.0, 1.0, 0.0)


def _body_side(side: int) -> tuple[Solid, ...]:
    """Return arm and leg of one side: 1 right, -1 left."""
    name = "right" if side > 0 else "left"

    def at(point: tuple[float, float, float], x: float = 0.0, z: float = 0.0) -> tuple[float, float, float]:
        return point[0] + x, side * point[1], point[2] + z

    return (
        *attached(f"{name}_hip", limb(at(_HIP, z=-0.02), at(_KNEE), 0.056, 0.036, sides=8)),
        *attached(
            f"{name}_knee",
            limb(at(_KNEE, z=-0.02), at(_ANKLE), 0.036, 0.024),
            limb(at(_ANKLE, x=-0.03, z=0.015), at(_ANKLE, x=0.1, z=0.025), 0.024, 0.018, "shoes_k"),
        ),
        *attached(f"{name}_shoulder", limb(at(_SHOULDER, z=-0.015), at(_ELBOW), 0.034, 0.027)),
        *attached(
            f"{name}_elbow",
            limb(at(_ELBOW, z=-0.01), at(_WRIST), 0.027, 0.02),
            ball(at(_WRIST, z=0.03), (0.022, 0.016, 0.035), "face_k"),
        ),
    )


def _torso(*stations: tuple[float, float, float]) -> Solid:
    """Return an upright solid with hexagonal cross-sections (z, half width, half depth)."""
    hexagon = ((1, 0.5), (1, -0.5), (-1, 0.5), (-1, -0.5), (0, 1), (0, -1))
    return Solid(tuple((x * deep, y * wide, z) for z, wide, deep in stations for x, y in hexagon))


class Pedestrian(Body):
    """A walking person: warm face and hands, cooler clothes, cool shoes; each arm swings opposite to the leg of its
    side."""

    default_posture: ClassVar[Posture] = UPRIGHT
    switches: ClassVar[Switches] = {"stride": ("stride_hz", 0.0)}
    rotational_symmetry: ClassVar[Mapping[str, int]] = {"stride_hz": 1}
    grounded: ClassVar[bool] = True
    picture_poses: ClassVar[tuple[Angles, ...]] = ((120.0, 0.0, 0.0), (90.0, 0.0, 0.0), (180.0, 0.0, 0.0))
    picture_background_k: ClassVar[float] = 287.0
    picture_depression_deg: ClassVar[float] = 8.0
    # U. Bolt, Berlin 2009: 12.4 m/s.
    max_speed_m_s: ClassVar[float | None] = 12.5
    solids: ClassVar[tuple[Solid, ...]] = (
        ball((0.005, 0.0, -0.425), (0.054, 0.044, 0.068), "hair_k"),
        ball((0.03, 0.0, -0.412), (0.036, 0.036, 0.05), "face_k"),
        limb((0.005, 0.0, -0.37), (0.0, 0.0, -0.29), 0.028, 0.032, "face_k"),
        _torso((-0.305, 0.06, 0.04), (-0.285, 0.115, 0.055), (-0.2, 0.112, 0.066), (0.0, 0.088, 0.056)),
        _torso((-0.04, 0.09, 0.056), (0.045, 0.098, 0.066)),
        *_body_side(1),
        *_body_side(-1),
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
    """Stride rate, strides (two steps each) a second."""
    stride_deg: Annotated[float, Field(ge=0, le=60)] = 24.0
    """Amplitude of the stride: angle of the thighs ahead of and behind upright, degrees."""
    phase_deg: JointAngle = 80.0
    """Phase of the stride in frame 0, degrees; at 90 the right leg is ahead."""

    def joints(self, time: float) -> Mapping[str, RigidTransform]:
        phase = joint_angle(self.phase_deg, self.stride_hz, time)
        size = math.radians(self.stride_deg)
        joints: dict[str, RigidTransform] = {}
        for name, side, own in (("right", 1, phase), ("left", -1, phase + math.pi)):
            hip, knee, shoulder, elbow = ((x, side * y, z) for x, y, z in (_HIP, _KNEE, _SHOULDER, _ELBOW))
            thigh = hinge(hip, _Y_AXIS, size * math.sin(own))
            # The knee bends while the leg swings forward, most strongly 90 degrees of phase before the leg is ahead.
            shin = hinge(knee, _Y_AXIS, -size * (0.35 + 1.0 * max(0.0, math.cos(own + 0.35)) ** 2))
            arm = hinge(shoulder, _Y_AXIS, -0.9 * size * math.sin(own))
            joints |= {
                f"{name}_hip": thigh,
                f"{name}_knee": thigh @ shin,
                f"{name}_shoulder": arm,
                f"{name}_elbow": arm @ hinge(elbow, _Y_AXIS, 0.9 * size),
            }
        return joints
