"""A camera over open country, as tests of landscapes have it."""

from __future__ import annotations

import math

import numpy as np

from irsim.backgrounds import ViewDirection
from irsim.backgrounds.chart import Chart
from irsim.geometry.context import SceneContext
from irsim.geometry.projection import Geometry


def context(elevation_deg: float = 1.0, size: tuple[int, int] = (161, 121), psf_px: float = 0.0) -> SceneContext:
    return SceneContext(1, Geometry(size, 0.5e-3, math.radians(elevation_deg)), 30.0, "lwir", psf_px)


def view_direction(
    scene: SceneContext, place: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: tuple[float, ...] = (0, 0, 0)
) -> ViewDirection:
    return ViewDirection(
        0.0, Chart.at(scene.geometry, scene.geometry.world_rotation(np.array(turn, float))), place=place
    )


def view_at(
    scene: SceneContext, time: float = 0.0, turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> ViewDirection:
    """Return the view at a time, s, of a camera that stays in its first place."""
    return ViewDirection(time, Chart.at(scene.geometry, scene.geometry.world_rotation(np.array(turn))))
