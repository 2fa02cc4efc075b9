"""Paths relative to another target: follow, thrown, crossing."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.base import Name
from irsim.config.quantities import TOP_SPEED, Degrees, NotNegative, Number, Pair, PixelSpeed, Positive, Velocity
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import Dynamics, Path, constant_velocity, unit
from irsim.types import Floats


class RelativePath(Path):
    """Path that depends on the path of another target."""

    target: Name
    """Id of the other target. Its path remains if the target is switched off with --without."""

    def refers(self) -> Mapping[str, str]:
        return {"target": self.target}

    def other(self, frames: Floats, context: SceneContext) -> Floats:
        """Return the positions of the other target at frame numbers (n,): (n, 3) m, first camera frame."""
        if context.objects is None:
            raise InputError(f"there is no target '{self.target}' to refer to; allowed: a target of the scenario")
        return context.objects.target_positions(self.target, np.asarray(frames, dtype=np.float64), context)


def level_heading(velocity: Floats, context: SceneContext) -> Floats:
    """Return the horizontal direction of a velocity, (3,) unit vector; right in the picture if the velocity is
    vertical."""
    down = context.geometry.down
    ahead = velocity - (velocity @ down) * down
    length = np.linalg.norm(ahead)
    return np.asarray(ahead / length if length > 1e-9 else np.array([1.0, 0.0, 0.0]))


class Follow(RelativePath):
    """Path of another target, delayed and offset in the picture."""

    lag_frames: NotNegative = 0.0
    """Delay, frames."""
    offset_px: Pair = (0.0, 0.0)
    """Offset [right, down] from the other target, px of the unmoved camera."""
    farther_m: Number = 0.0
    """Range minus that of the other target, m; with a negative value this target is nearer."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        leader = self.other(np.asarray(frames, dtype=np.float64) - self.lag_frames, context)
        if not any(self.offset_px) and not self.farther_m:
            return leader
        pixels = context.geometry.project(leader) + np.asarray(self.offset_px)
        return context.geometry.place(pixels, np.linalg.norm(leader, axis=1) + self.farther_m)


class Thrown(RelativePath):
    """Ballistic path with drag, released from another target at a given frame. The target does not exist before."""

    at_frame: NotNegative
    """Frame of release, the first in which the target exists; a flare is dark in it unless `rise_s` is 0."""
    velocity_m_s: Velocity = (0.0, 0.0, -20.0)
    """Velocity relative to the other target, [right, ahead, up] along its heading, m/s."""
    slow_s: Positive = 1.0
    """Time constant of the drag, s. Drag is linear in the velocity, which approaches g times `slow_s` downwards; the
    difference falls as exp(-t / slow_s)."""

    @property
    def begins(self) -> float:
        return self.at_frame

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        carried = (around[2] - around[0]) * context.rate_hz
        down, ahead = context.geometry.down, level_heading(carried, context)
        aside, along, up = self.velocity_m_s
        first = carried + aside * np.cross(down, ahead) + along * ahead - up * down
        falling = STANDARD_GRAVITY * self.slow_s * down
        seconds = np.maximum(frames - self.at_frame, 0.0)[:, None] / context.rate_hz
        flown = falling * seconds - (first - falling) * self.slow_s * np.expm1(-seconds / self.slow_s)
        return np.where(frames[:, None] < self.at_frame, self.other(frames, context), around[1] + flown)


STILL_PX = 1e-6
"""Least displacement per frame that defines a direction in the picture, px."""
STILL_M_S = 1e-6
"""Least speed that defines a direction in space, m/s."""

Angle = Annotated[float, Field(ge=-180, le=180)]


class Crossing(RelativePath):
    """Straight line that meets another target's path at a given frame and angle."""

    at_frame: NotNegative
    """Frame in which the two targets are closest."""

    @abstractmethod
    def separation_speed_px(self, context: SceneContext) -> float:
        """Return the speed relative to the other target at `at_frame`, px per frame at the other target's range."""


class Crosses(Crossing):
    """Straight line in the picture that meets another target's path at a given frame and angle."""

    angle_deg: Angle = 90.0
    """Angle from the other target's direction of motion to this target's, degrees, positive clockwise, in the picture
    of a fixed camera; camera motion changes the angle. If the other target is at rest, its direction is taken as
    right."""
    miss_px: Number = 0.0
    """Miss distance at `at_frame`, across the relative motion, px; positive: to the right of the other target, as seen
    along the relative motion."""
    speed: PixelSpeed = 2.0
    """Speed, px per frame."""
    farther_m: Number = 0.0
    """Range minus that of the other target at `at_frame`, m; with a negative value this target is nearer and occludes
    the other."""

    def meeting(self, context: SceneContext) -> tuple[Floats, Floats, Floats, float]:
        """Return the other target's position (2,) px at `at_frame`, its velocity and this target's, (2,) px per frame,
        and the other target's range, m."""
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        before, here, after = context.geometry.project(around)
        step = after - before
        heading = np.degrees(np.arctan2(step[1], step[0])) if np.hypot(*step) > STILL_PX else 0.0
        return here, step, self.speed * unit(heading + self.angle_deg), float(np.linalg.norm(around[1]))

    def separation_speed_px(self, context: SceneContext) -> float:
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
    """Straight line in space at constant speed that passes another target at a given frame, angle and distance.

    The angle is measured in space; `crosses` sets the angle in the picture.
    """

    angle_deg: Angle = 90.0
    """Angle in space from the other target's direction of motion to this target's, degrees, positive to the right. If
    the other target is at rest, its direction is taken as right in the picture."""
    tilt_deg: Degrees = 0.0
    """Rotation of the plane of the two directions about the other target's direction, degrees: 0 level to the right, 90
    upwards. If the other target moves level across the line of sight and `angle_deg` is 90, this target moves along the
    line of sight at 0, and up or down in the picture at 90."""
    miss_m: NotNegative = 0.0
    """Miss distance at `at_frame`, across the relative motion, m."""
    miss_deg: Degrees = 0.0
    """Side of the miss as seen along the relative motion, degrees: 0 right and 180 left in the plane of the two
    directions (before or behind the other target); 90 perpendicular to the plane (above, if the plane is level)."""
    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 200.0
    """Speed, m/s."""

    def meeting(self, context: SceneContext) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the other target's position (3,) m at `at_frame`, its velocity and this target's, (3,) m/s, and the
        unit vector (3,) normal to the plane of both, first camera frame."""
        before, here, after = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        velocity = (after - before) * context.rate_hz
        course, speed = level_heading(velocity, context), np.linalg.norm(velocity)
        ahead = velocity / speed if speed > STILL_M_S else course
        right = np.cross(context.geometry.down, course)
        tilt, angle = math.radians(self.tilt_deg), math.radians(self.angle_deg)
        aside = math.cos(tilt) * right + math.sin(tilt) * np.cross(right, ahead)
        own = self.speed_m_s * (math.cos(angle) * ahead + math.sin(angle) * aside)
        return here, velocity, own, np.cross(aside, ahead)

    def separation_speed_px(self, context: SceneContext) -> float:
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
