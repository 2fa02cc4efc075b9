"""Paths of targets and directions of the picture at sampled frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from irsim.config.base import KeyPath
from irsim.geometry.context import SceneContext
from irsim.motion import CameraTrajectory
from irsim.motion.camera_trajectory import camera_positions
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import frames_present, sampled_frames
from irsim.targets.target import Target
from irsim.types import Floats


class SampledPath(NamedTuple):
    """Path of a target at the n >= 1 sampled frames in which it exists.

    at         key path of the target's path in the scenario
    frames     (n,)
    positions  (n, 3) m, of the target in the first camera frame
    camera     (n, 3) m, of the camera in the first camera frame
    """

    target: Target
    at: KeyPath
    frames: Floats
    positions: Floats
    camera: Floats

    @property
    def relative(self) -> Floats:
        """Return the positions relative to the camera, (n, 3) m."""
        return self.positions - self.camera


def sampled_paths(scenario: Scenario, frames: Floats) -> Iterator[SampledPath]:
    """Yield the path of each target, at those of `frames` in which the target exists."""
    context, motions = scenario.context, scenario.motions
    for index, target in enumerate(scenario.targets):
        present = frames_present(target, frames)
        if len(present):
            positions = target.path.positions(present, context, target.id)
            camera = camera_positions(motions, present, context)
            yield SampledPath(target, ("targets", index, "path"), present, positions, camera)


def target_to_follow(scenario: Scenario) -> tuple[int, Target] | None:
    """Return index and model of the target to follow; None without a target, or if that target is switched off."""
    for index, target in enumerate(scenario.targets):
        if scenario.follow in (None, target.id):
            return (index, target) if scenario.is_on(target.id) else None
    return None


def world_directions(scenario: Scenario, pixels: Floats) -> tuple[Floats, Floats]:
    """Return the sampled frames (n,), and directions (right, down, ahead) of pixels (..., 2) in them, (n, ..., 3)."""
    context, frames = scenario.context, sampled_frames(scenario.frames)
    camera = CameraTrajectory.of(scenario.motions, frames, context)
    rotations = context.geometry.world_rotation(camera.turns)
    return frames, np.stack([camera.lens(k).directions(pixels) @ rotation for k, rotation in enumerate(rotations)])


def elevation_range(context: SceneContext) -> tuple[float, float]:
    """Return the elevations of the lower and upper edge of the picture of the camera at rest, rad."""
    axis, half = context.geometry.elevation_rad, math.atan(context.geometry.ifov_rad * context.geometry.size[1] / 2)
    return axis - half, axis + half
