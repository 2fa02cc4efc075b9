"""Light of a background without what stands or lies on it, for warnings of pictures that show nothing of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.doubts.looked import watched
from irsim.instant import Instant
from irsim.scenario import Scenario
from irsim.types import Floats

LOOKED = 3
"""Frames, evenly spread, at which grounds and seas are looked at."""


def bare(scenario: Scenario) -> Iterator[tuple[str, Floats]]:
    """Its name and its light, W/m2/sr, of the clear sky and of the ground or the sea, as far as they are seen."""
    yield from _sky(scenario)
    yield from _land(scenario)


def _sky(scenario: Scenario) -> Iterator[tuple[str, Floats]]:
    """The clear sky's light at the heights that the unmoved camera sees."""
    background, stage = scenario.background, scenario.stage
    axis, half = stage.geometry.elevation_rad, math.atan(stage.geometry.ifov_rad * stage.geometry.size[1] / 2)
    lowest = axis - half if background.surface_m is None else max(axis - half, 0.0)
    clear = background.clear(stage)
    if clear is not None and axis + half > lowest:
        yield "the clear sky", clear.radiance(np.array([[lowest, axis + half]]))


def _land(scenario: Scenario) -> Iterator[tuple[str, Floats]]:
    """Light of the pixels below the horizon, or of all, in LOOKED frames in which there are some."""
    background, stage = scenario.background, scenario.stage
    light = background.land(stage)
    if light is None:
        return
    now = Instant.of(scenario, stage)
    below = np.concatenate([light(now.gaze(frame)) for frame in watched(scenario.frames, LOOKED).astype(int).tolist()])
    if below.size:
        yield f"the {background.surface}", below
