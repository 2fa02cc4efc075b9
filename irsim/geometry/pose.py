"""How the camera of one frame sees a scene."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.types import Box, Floats


@dataclass(frozen=True, eq=False)
class CameraPose:
    """How the camera sees what stands about it, in one frame.

    stage     of the scene: its geometry is that of the first, unmoved camera
    lens      the geometry of this frame: the first one's, zoomed
    rotation  (3, 3) first-camera vectors to the vectors of this frame's camera
    place     (3,) m, first camera frame: where the camera is now
    time      s since frame 0
    """

    context: SceneContext
    lens: Geometry
    rotation: Floats
    place: Floats
    time: float = 0.0

    @classmethod
    def first(cls, context: SceneContext) -> CameraPose:
        """What the unmoved camera sees at frame 0."""
        return cls(context, context.geometry, np.eye(3), np.zeros(3))

    @cached_property
    def zoomed(self) -> SceneContext:
        """The stage with the geometry and the blur of this frame."""
        return self.context if self.lens is self.context.geometry else self.context.zoomed(self.lens)

    @cached_property
    def carried(self) -> bool:
        """Whether the camera is elsewhere than at first."""
        return any(self.place.tolist())

    @cached_property
    def climbed_m(self) -> float:
        """How much higher the camera is than at first, m."""
        return -float(self.place @ self.context.geometry.down) if self.carried else 0.0

    def away_m(self, first: Box, range_m: float) -> float:
        """How far the camera is now, m, from the middle of what the unmoved camera sees in a box `first`, `range_m`
        away."""
        if not self.carried:
            return range_m
        middle = self.context.geometry.place(np.array([first.cx, first.cy]), range_m)
        return float(np.linalg.norm(middle - self.place))

    def pixels(self, first: Floats, range_m: float) -> Floats:
        """(..., 2) px in this frame of what the unmoved camera sees at px `first` (..., 2), `range_m` away."""
        points = self.context.geometry.directions(first)
        if self.carried:
            points = points * range_m - self.place
        return self.lens.project(points @ np.asarray(self.rotation).T)
