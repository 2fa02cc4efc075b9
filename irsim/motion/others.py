"""Paths that refer to another target's: following it, crossing it, thrown from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.errors import InputError
from irsim.kinds import Name, NotNegative, Number, Pair, PixelSpeed, Positive, Velocity
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import Path
from irsim.motion.dynamics import Dynamics, constant_velocity
from irsim.motion.straight import unit
from irsim.stage import Stage
from irsim.types import Floats

STILL_PX = 1e-6
"""What moves less than this in a frame has no direction in the picture, px."""


class Companion(Path):
    """A path that asks for another target's."""

    target: Name
    """Id of the other target; switched off with --without it is not drawn but still flies."""

    def refers(self) -> Mapping[str, str]:
        return {"target": self.target}

    def other(self, frames: Floats, stage: Stage) -> Floats:
        """(n, 3) m, first camera frame: where the other target is."""
        if stage.cast is None:
            raise InputError(f"there is no target '{self.target}' to refer to; allowed: a target of the scenario")
        return stage.cast.way(self.target, np.asarray(frames, dtype=np.float64), stage)


class Follow(Companion):
    """Where another target was a while ago, beside it in the picture."""

    lag_frames: NotNegative = 0.0
    """How far behind it is, frames."""
    offset_px: Pair = (0.0, 0.0)
    """[right, down] of the other's place, px of the unmoved camera."""
    farther_m: Number = 0.0
    """How much farther away it is, m; negative: nearer."""

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        leader = self.other(np.asarray(frames, dtype=np.float64) - self.lag_frames, stage)
        if not any(self.offset_px) and not self.farther_m:
            return leader
        pixels = stage.geometry.project(leader) + np.asarray(self.offset_px)
        return stage.geometry.place(pixels, np.linalg.norm(leader, axis=1) + self.farther_m)


class Crosses(Companion):
    """A straight line in the picture that meets another target's way at a given frame and angle."""

    at_frame: NotNegative
    """Frame at which their places are nearest to each other in the picture; the middle of a body's outline may lie
    beside its place."""
    angle_deg: Annotated[float, Field(ge=-180, le=180)] = 90.0
    """Its direction less the other's, degrees, positive clockwise; a target that stands counts as going right."""
    miss_px: Number = 0.0
    """How near they come: distance of their places at that frame, across their relative motion, px."""
    speed: PixelSpeed = 2.0
    """Px per frame."""
    farther_m: Number = 0.0
    """How much farther away than the other it is at that frame, m; negative: nearer, so it hides the other."""

    def meeting(self, stage: Stage) -> tuple[Floats, Floats, Floats, float]:
        """At that frame: the other's place (2,) px, its velocity (2,) px per frame, ours, and its range in m."""
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), stage)
        before, here, after = stage.geometry.project(around)
        step = after - before
        heading = np.degrees(np.arctan2(step[1], step[0])) if np.hypot(*step) > STILL_PX else 0.0
        return here, step, self.speed * unit(heading + self.angle_deg), float(np.linalg.norm(around[1]))

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        here, step, own, range_m = self.meeting(stage)
        relative = own - step
        length = np.hypot(*relative)
        across = np.array([-relative[1], relative[0]]) / length if length > STILL_PX else np.zeros(2)
        since = np.asarray(frames, dtype=np.float64)[:, None] - self.at_frame
        pixels = here + self.miss_px * across + since * own
        return stage.geometry.place(pixels, np.full(len(pixels), range_m + self.farther_m))

    def dynamics(self, stage: Stage) -> Dynamics:
        return constant_velocity(("x", "y"))


class Thrown(Companion):
    """Thrown from another target at a given frame; it slows down in the air and falls. Before that it is not there."""

    at_frame: NotNegative
    """Frame at which it is thrown."""
    velocity_m_s: Velocity = (0.0, 0.0, -20.0)
    """[right, ahead, up] of the thrower's way, as seen from above, on top of the thrower's velocity, m/s."""
    slow_s: Positive = 1.0
    """Time in which the air takes most of its speed, s: velocity goes to g slow_s downwards as exp(-t / slow_s)
    (drag in proportion to speed)."""

    @property
    def begins(self) -> float:
        return self.at_frame

    def positions(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), stage)
        carried = (around[2] - around[0]) * stage.rate_hz
        down = stage.geometry.down
        ahead = carried - (carried @ down) * down
        length = np.linalg.norm(ahead)
        # A thrower that stands or climbs straight up counts as going right in the picture.
        ahead = ahead / length if length > 1e-9 else np.array([1.0, 0.0, 0.0])
        aside, along, up = self.velocity_m_s
        first = carried + aside * np.cross(down, ahead) + along * ahead - up * down
        falling = STANDARD_GRAVITY * self.slow_s * down
        seconds = np.maximum(frames - self.at_frame, 0.0)[:, None] / stage.rate_hz
        flown = falling * seconds - (first - falling) * self.slow_s * np.expm1(-seconds / self.slow_s)
        return np.where(frames[:, None] < self.at_frame, self.other(frames, stage), around[1] + flown)
