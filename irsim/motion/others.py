"""Paths that refer to another target's: following it, thrown from it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from irsim.config.base import Name
from irsim.config.quantities import NotNegative, Number, Pair, Positive, Velocity
from irsim.errors import InputError
from irsim.geometry.context import SceneContext
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import Path
from irsim.types import Floats


class Companion(Path):
    """A path that asks for another target's."""

    target: Name
    """Id of the other target; switched off with --without it is not drawn but still flies."""

    def refers(self) -> Mapping[str, str]:
        return {"target": self.target}

    def other(self, frames: Floats, context: SceneContext) -> Floats:
        """(n, 3) m, first camera frame: where the other target is."""
        if context.cast is None:
            raise InputError(f"there is no target '{self.target}' to refer to; allowed: a target of the scenario")
        return context.cast.way(self.target, np.asarray(frames, dtype=np.float64), context)


def level_course(velocity: Floats, context: SceneContext) -> Floats:
    """(3,) unit vector: a velocity's direction over the ground. What stands or goes straight up or down counts as going
    right in the picture."""
    down = context.geometry.down
    ahead = velocity - (velocity @ down) * down
    length = np.linalg.norm(ahead)
    return np.asarray(ahead / length if length > 1e-9 else np.array([1.0, 0.0, 0.0]))


class Follow(Companion):
    """Where another target was a while ago, beside it in the picture."""

    lag_frames: NotNegative = 0.0
    """How far behind it is, frames."""
    offset_px: Pair = (0.0, 0.0)
    """[right, down] of the other's place, px of the unmoved camera."""
    farther_m: Number = 0.0
    """How much farther away it is, m; negative: nearer."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        leader = self.other(np.asarray(frames, dtype=np.float64) - self.lag_frames, context)
        if not any(self.offset_px) and not self.farther_m:
            return leader
        pixels = context.geometry.project(leader) + np.asarray(self.offset_px)
        return context.geometry.place(pixels, np.linalg.norm(leader, axis=1) + self.farther_m)


class Thrown(Companion):
    """Thrown from another target at a given frame; it slows down in the air and falls. Before that it is not there."""

    at_frame: NotNegative
    """Frame at which it is thrown: the first in which it is there (a flare is dark in it, unless its rise_s is 0)."""
    velocity_m_s: Velocity = (0.0, 0.0, -20.0)
    """[right, ahead, up] of the thrower's way, as seen from above, on top of the thrower's velocity, m/s."""
    slow_s: Positive = 1.0
    """Time in which the air takes most of its speed, s: velocity goes to g slow_s downwards as exp(-t / slow_s)
    (drag in proportion to speed)."""

    @property
    def begins(self) -> float:
        return self.at_frame

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        around = self.other(self.at_frame + np.array([-0.5, 0.0, 0.5]), context)
        carried = (around[2] - around[0]) * context.rate_hz
        down, ahead = context.geometry.down, level_course(carried, context)
        aside, along, up = self.velocity_m_s
        first = carried + aside * np.cross(down, ahead) + along * ahead - up * down
        falling = STANDARD_GRAVITY * self.slow_s * down
        seconds = np.maximum(frames - self.at_frame, 0.0)[:, None] / context.rate_hz
        flown = falling * seconds - (first - falling) * self.slow_s * np.expm1(-seconds / self.slow_s)
        return np.where(frames[:, None] < self.at_frame, self.other(frames, context), around[1] + flown)
