"""Trajectory of a target over all frames of a scenario."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.motion import CameraTrajectory, attitudes
from irsim.targets import View
from irsim.targets.target import Target
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class TargetTrajectory:
    """Positions and attitudes of a target, in the first camera frame, and the camera's trajectory.

    positions  (n, 3) m at frame numbers offset, 1 + offset, ...
    attitudes  (n, 3, 3) rotations from body vectors to vectors of the first camera frame
    camera     trajectory of the camera at these frames
    """

    target: Target
    camera: CameraTrajectory
    positions: Floats
    attitudes: Floats
    offset: float = 0.0

    @classmethod
    def of(
        cls, target: Target, camera: CameraTrajectory, context: SceneContext, offset: float = 0.0
    ) -> TargetTrajectory:
        """Return the trajectory at the frames of a camera trajectory, each `offset` frames later."""
        numbers = np.arange(float(len(camera.turns))) + offset
        attitude = attitudes(
            target.path, numbers, context, target.id, target.attitude_deg, target.spin_deg_s, target.shape.posture
        )
        return cls(target, camera, target.path.positions(numbers, context, target.id), attitude, offset)

    @cached_property
    def _poses(self) -> tuple[Floats, Floats]:
        """Positions (n, 3) m and attitudes (n, 3, 3) in the camera frame of each frame.

        They are computed for all frames at once: separate products for each frame take a hundred times as long.
        """
        camera = self.camera
        positions = np.einsum("nij,nj->ni", camera.rotations, self.positions - camera.places)
        return positions, np.einsum("nij,njk->nik", camera.rotations, self.attitudes)

    def range_from_origin_m(self, index: int, pose: CameraPose) -> float | None:
        """Return the distance from the first camera position at frame `index`, m; None if the camera has not moved."""
        return float(np.linalg.norm(self.positions[index])) if pose.has_moved else None

    def view(self, index: int, pose: CameraPose) -> View:
        """Return the view from the camera of frame `index`."""
        positions, attitudes = self._poses
        rate_hz, number, target = pose.context.rate_hz, index + self.offset, self.target
        age = max(number - target.path.begins, 0.0) / rate_hz
        return View(positions[index], attitudes[index], pose.zoomed, number / rate_hz, target.id, age)
