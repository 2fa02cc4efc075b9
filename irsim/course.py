"""A target's whole way through a scenario, made ready."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.motion import attitudes
from irsim.shapes import View
from irsim.sight import Sight
from irsim.stage import Stage
from irsim.target import Target
from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Course:
    """positions (n, 3) m and attitudes (n, 3, 3), body to vectors, at frames 0 .. n-1 and `offset` more, in the
    first camera frame."""

    target: Target
    positions: Floats
    attitudes: Floats
    offset: float = 0.0

    @classmethod
    def of(cls, target: Target, frames: int, stage: Stage, offset: float = 0.0) -> Course:
        """The course of a target over frames 0 .. frames-1, each `offset` frames later."""
        numbers = np.arange(float(frames)) + offset
        attitude = attitudes(
            target.path, numbers, stage, target.id, target.attitude_deg, target.spin_deg_s, target.shape.posture
        )
        return cls(target, target.path.positions(numbers, stage, target.id), attitude, offset)

    def first_m(self, index: int, sight: Sight) -> float | None:
        """How far it is from the camera's first place at frame `index`, m; None where the camera is still there."""
        return float(np.linalg.norm(self.positions[index])) if sight.carried else None

    def view(self, index: int, sight: Sight) -> View:
        """How the camera of frame `index` sees it."""
        rotation, rate_hz = sight.rotation, sight.stage.rate_hz
        return View(
            rotation.dot(self.positions[index] - sight.place),  # half the time of @, for matrices as small as these
            rotation.dot(self.attitudes[index]),
            sight.zoomed,
            (index + self.offset) / rate_hz,
            self.target.id,
            max(index + self.offset - self.target.path.begins, 0.0) / rate_hz,
        )
