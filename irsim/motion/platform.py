"""A camera that is carried along."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np

from irsim.config.base import Switches
from irsim.config.quantities import Positive, Triple, Velocity
from irsim.geometry.context import SceneContext
from irsim.motion.base import MetrePath, Pointing, world_to_first
from irsim.motion.paths import METRE_PATHS
from irsim.types import Floats


class Platform(Pointing):
    """A camera carried along from frame 0 on, evenly or on a path: near things pass by before far ones, clouds as their
    range has it, and what is infinitely far stays: the clear sky, and ground without a height.

    It goes on looking where it looked; other motions turn it.
    """

    switches: ClassVar[Switches] = {"sway": ("sway_m", (0.0, 0.0, 0.0))}

    velocity_m_s: Velocity = (0.0, 0.0, 0.0)
    """[east, north, up], metres a second; north is level ahead at the first pointing."""
    path: Annotated[MetrePath, METRE_PATHS] | None = None
    """A path that carries it too, one of those that targets have in metres (`waypoints_m`, `turns_m`, ...): by as
    much as the path has gone from where it is at frame 0."""
    sway_m: Triple = (0.0, 0.0, 0.0)
    """Largest distance from its way, [east, north, up], m: a ship that rolls, a drone in gusts."""
    sway_period_s: Positive = 5.0
    """Time of one sway, s."""

    def shifts(self, frames: Floats, context: SceneContext) -> Floats:
        seconds = np.asarray(frames, dtype=np.float64)[:, None] / context.rate_hz
        sway = np.sin(2 * np.pi * seconds / self.sway_period_s) * np.array(self.sway_m)
        even = world_to_first(seconds * np.array(self.velocity_m_s) + sway, context)
        if self.path is None:
            return even
        first, way = (self.path.positions(at, context, self.name) for at in (np.zeros(1), np.asarray(frames)))
        return even + way - first
