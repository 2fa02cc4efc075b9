"""A target's whole way through a scenario, made ready."""

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
    """positions (n, 3) m and attitudes (n, 3, 3), body to vectors, at frames 0 .. n-1 and `offset` more, in the
    first camera frame; mount, the camera at these frames."""

    target: Target
    mount: CameraTrajectory
    positions: Floats
    attitudes: Floats
    offset: float = 0.0

    @classmethod
    def of(
        cls, target: Target, mount: CameraTrajectory, context: SceneContext, offset: float = 0.0
    ) -> TargetTrajectory:
        """The course of a target over the frames of a camera, each `offset` frames later."""
        numbers = np.arange(float(len(mount.turns))) + offset
        attitude = attitudes(
            target.path, numbers, context, target.id, target.attitude_deg, target.spin_deg_s, target.shape.posture
        )
        return cls(target, mount, target.path.positions(numbers, context, target.id), attitude, offset)

    @cached_property
    def _poses(self) -> tuple[Floats, Floats]:
        """Positions (n, 3) m and attitudes (n, 3, 3) as the camera of each frame sees them: all at once, as for a frame
        alone such small products cost a hundred times as much."""
        mount = self.mount
        positions = np.einsum("nij,nj->ni", mount.rotations, self.positions - mount.places)
        return positions, np.einsum("nij,njk->nik", mount.rotations, self.attitudes)

    def first_m(self, index: int, pose: CameraPose) -> float | None:
        """How far it is from the camera's first place at frame `index`, m; None where the camera is still there."""
        return float(np.linalg.norm(self.positions[index])) if pose.carried else None

    def view(self, index: int, pose: CameraPose) -> View:
        """How the camera of frame `index` sees it."""
        positions, attitudes = self._poses
        rate_hz, number, target = pose.context.rate_hz, index + self.offset, self.target
        age = max(number - target.path.begins, 0.0) / rate_hz
        return View(positions[index], attitudes[index], pose.zoomed, number / rate_hz, target.id, age)
