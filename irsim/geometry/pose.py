"""The camera's pose in one frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry
from irsim.types import Box, Floats


@dataclass(frozen=True, eq=False)
class CameraPose:
    """Pose of the camera in one frame, relative to the first camera frame.

    context   of the scene; its geometry is that of the first, unmoved camera
    lens      geometry of this frame: the first one, zoomed
    rotation  (3, 3) matrix from vectors of the first camera frame to vectors of this camera frame
    place     (3,) m, camera position in the first camera frame
    time      s since frame 0
    """

    context: SceneContext
    lens: Geometry
    rotation: Floats
    place: Floats
    time: float = 0.0

    @classmethod
    def first(cls, context: SceneContext) -> CameraPose:
        """Return the pose of the unmoved camera at frame 0."""
        return cls(context, context.geometry, np.eye(3), np.zeros(3))

    @cached_property
    def zoomed(self) -> SceneContext:
        """Scene context with the geometry and the blur of this frame."""
        return self.context if self.lens is self.context.geometry else self.context.zoomed(self.lens)

    @cached_property
    def has_moved(self) -> bool:
        """True if the camera has left its first position."""
        return any(self.place.tolist())

    @cached_property
    def height_gain_m(self) -> float:
        """Height of the camera above its first position, m."""
        return -float(self.place @ self.context.geometry.down) if self.has_moved else 0.0

    def distance_m(self, first: Box, range_m: float) -> float:
        """Return the distance, m, from the camera to the middle of a box seen by the first camera at `range_m`."""
        if not self.has_moved:
            return range_m
        middle = self.context.geometry.place(np.array([first.cx, first.cy]), range_m)
        return float(np.linalg.norm(middle - self.place))

    def pixels(self, first: Floats, range_m: float) -> Floats:
        """Return (..., 2) px in this frame of points that the first camera sees at px `first` (..., 2), `range_m`."""
        points = self.context.geometry.directions(first)
        if self.has_moved:
            points = points * range_m - self.place
        return self.lens.project(points @ np.asarray(self.rotation).T)
