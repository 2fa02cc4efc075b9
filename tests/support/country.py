"""A camera over open country, as tests of landscapes have it."""

from __future__ import annotations

import math

import numpy as np

from irsim.backgrounds import Gaze
from irsim.backgrounds.chart import Chart
from irsim.geometry.context import Stage
from irsim.geometry.projection import Geometry


def stage(elevation_deg: float = 1.0, size: tuple[int, int] = (161, 121), psf_px: float = 0.0) -> Stage:
    return Stage(1, Geometry(size, 0.5e-3, math.radians(elevation_deg)), 30.0, "lwir", psf_px)


def gaze(
    scene: Stage, place: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: tuple[float, ...] = (0, 0, 0)
) -> Gaze:
    return Gaze(0.0, Chart.at(scene.geometry, scene.geometry.world_rotation(np.array(turn, float))), place=place)
