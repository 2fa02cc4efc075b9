"""A target's whole way through a scenario, made ready."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.motion import Mount, attitudes
from irsim.shapes import View
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

    def view(self, index: int, mount: Mount, stage: Stage) -> View:
        """How the camera sees it at frame `index`."""
        rotation = mount.rotation(index)
        return View(
            rotation @ (self.positions[index] - mount.places[index]),
            rotation @ self.attitudes[index],
            zoomed(stage, mount, index),
            (index + self.offset) / stage.rate_hz,
            self.target.id,
            max(index + self.offset - self.target.path.begins, 0.0) / stage.rate_hz,
        )


def zoomed(stage: Stage, mount: Mount, index: int) -> Stage:
    """The stage with the geometry of frame `index`."""
    lens = mount.lens(index)
    return stage if lens is stage.geometry else replace(stage, geometry=lens)
