"""Straight paths that cross another target's way: in the picture, and in space."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.quantities import TOP_SPEED, Degrees, NotNegative, Number, PixelSpeed
from irsim.geometry.context import SceneContext
from irsim.motion.dynamics import Dynamics, constant_velocity
from irsim.motion.others import Companion, level_course
from irsim.motion.straight import unit
from irsim.types import Floats

STILL_PX = 1e-6
"""What moves less than this in a frame has no direction in the picture, px."""
STILL_M_S = 1e-6
"""What is slower has no direction in space, m/s."""

Angle = Annotated[float, Field(ge=-180, le=180)]


class Crossing(Companion):
    """A straight line that meets another target's way at a given frame and angle."""

    at_frame: NotNegative
    """Frame at which their places are nearest to each other; the middle of a body's outline may lie beside its
    place."""

    @abstractmethod
    def parting_px(self, context: SceneContext) -> float:
        """How fast the two part at that frame, px per frame, or what as much is at the other's range."""


class Crosses(Crossing):
    """A straight line in the picture that meets another target's way at a given frame and angle."""

    angle_deg: Angle = 90.0
    """Its direction less the other's, degrees, positive clockwise, as a camera that stands still sees them; in the
    picture of one that turns, moves or zooms both have its motion, too, and the angle between them is another. A target
    that stands counts as going right."""
    miss_px: Number = 0.0
    """How near they come: distance of their places at that frame, across their relative motion, px; positive where it
    passes to the right of the other, negative to the left, as seen along its motion relative to it."""
    speed: PixelSpeed = 2.0
    """Px per frame."""
    farther_m: Number = 0.0
    """How much farther away than the other it is at that frame, m; negative: nearer, so it hides the other."""

    def meeting(self, context: SceneContext) -> tuple[Floats, Floats, Floats, float]:
        """At that frame: the other's place (2,) px, its velocity (2,) px per frame, ours, and its range in m."""
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        before, here, after = context.geometry.project(around)
        step = after - before
        heading = np.degrees(np.arctan2(step[1], step[0])) if np.hypot(*step) > STILL_PX else 0.0
        return here, step, self.speed * unit(heading + self.angle_deg), float(np.linalg.norm(around[1]))

    def parting_px(self, context: SceneContext) -> float:
        _, step, own, _ = self.meeting(context)
        return float(np.hypot(*(own - step)))

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        here, step, own, range_m = self.meeting(context)
        relative = own - step
        length = np.hypot(*relative)
        across = np.array([-relative[1], relative[0]]) / length if length > STILL_PX else np.zeros(2)
        since = np.asarray(frames, dtype=np.float64)[:, None] - self.at_frame
        pixels = here + self.miss_px * across + since * own
        return context.geometry.place(pixels, np.full(len(pixels), range_m + self.farther_m))

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(("x", "y"))


class CrossesM(Crossing):
    """A straight line in space at constant speed that passes another target at a given frame, angle and distance.

    The angle is that in space: what it looks like depends on where the camera stands. `crosses` has it in the picture.
    """

    angle_deg: Angle = 90.0
    """Angle in space between the two directions, degrees, positive to the right of the other's; a target that stands
    counts as going right in the picture."""
    tilt_deg: Degrees = 0.0
    """Plane of the two directions, turned about the other's, degrees: 0 it goes off level to the right, 90 upwards.
    Where the other goes across the line of sight, 0 is towards the camera or away, and 90 across the picture."""
    miss_m: NotNegative = 0.0
    """How near they come: distance of their places at that frame, across their relative motion, m."""
    miss_deg: Degrees = 0.0
    """To which side it misses, as seen along its motion relative to the other, degrees: 0 to the right and 180 to the
    left in the plane of the two directions (it passes before or behind the other); 90 square to that plane, above the
    other where the plane is level."""
    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 200.0
    """Metres a second."""

    def meeting(self, context: SceneContext) -> tuple[Floats, Floats, Floats, Floats]:
        """At that frame: the other's place (3,) m, its velocity (3,) m/s, ours, and (3,) the unit normal of the plane
        of the two; first camera frame."""
        before, here, after = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        velocity = (after - before) * context.rate_hz
        course, speed = level_course(velocity, context), np.linalg.norm(velocity)
        ahead = velocity / speed if speed > STILL_M_S else course
        right = np.cross(context.geometry.down, course)
        tilt, angle = math.radians(self.tilt_deg), math.radians(self.angle_deg)
        aside = math.cos(tilt) * right + math.sin(tilt) * np.cross(right, ahead)
        own = self.speed_m_s * (math.cos(angle) * ahead + math.sin(angle) * aside)
        return here, velocity, own, np.cross(aside, ahead)

    def parting_px(self, context: SceneContext) -> float:
        here, velocity, own, _ = self.meeting(context)
        across_m = np.linalg.norm(own - velocity) / context.rate_hz
        return float(across_m / (np.linalg.norm(here) * context.geometry.ifov_rad))

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        here, velocity, own, normal = self.meeting(context)
        relative = own - velocity
        length = np.linalg.norm(relative)
        right = np.cross(relative, normal) / length if length > STILL_M_S else np.zeros(3)
        side = math.radians(self.miss_deg)
        seconds = (np.asarray(frames, dtype=np.float64)[:, None] - self.at_frame) / context.rate_hz
        return np.asarray(here + self.miss_m * (math.cos(side) * right + math.sin(side) * normal) + seconds * own)

    def dynamics(self, context: SceneContext) -> Dynamics:
        return constant_velocity(("right", "down", "ahead"), 1 / context.rate_hz)
