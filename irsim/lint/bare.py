"""Light of a background without what stands or lies on it, for warnings of pictures that show nothing of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from irsim.backgrounds import Background
from irsim.geometry.context import SceneContext
from irsim.lint.looked import watched
from irsim.render.exposure import Instant
from irsim.scenario.model import Scenario
from irsim.types import Floats

LOOKED = 3
"""Frames, evenly spread, at which grounds and seas are looked at."""

HEIGHTS = 65
"""Evenly spread ones, at which clear skies are looked at."""


class Bare(NamedTuple):
    """A part of the background: its name, its light, W/m2/sr, where it was looked at, and what share of the pictures
    it fills, 0..1."""

    what: str
    light: Floats
    share: float


def bare(scenario: Scenario) -> Iterator[Bare]:
    """The clear sky, and the ground or the sea, as far as they are seen."""
    yield from _sky(scenario)
    yield from _land(scenario)


def _sky(scenario: Scenario) -> Iterator[Bare]:
    """The clear sky's light at the heights that the unmoved camera sees."""
    background, context = scenario.background, scenario.context
    axis, half = context.geometry.elevation_rad, math.atan(context.geometry.ifov_rad * context.geometry.size[1] / 2)
    lowest = axis - half if background.surface_m is None else max(axis - half, 0.0)
    clear = background.clear(context)
    if clear is not None and axis + half > lowest:
        heights = np.linspace(lowest, axis + half, HEIGHTS)[None]
        yield Bare("the clear sky", clear.radiance(heights), (axis + half - lowest) / (2 * half))


def _land(scenario: Scenario) -> Iterator[Bare]:
    """Light of the pixels below the horizon, or of all, in LOOKED frames in which there are some."""
    context = scenario.context
    camera = Instant.of(scenario.model_copy(update={"targets": ()}), context)  # whose ways need not be worked out
    below = _below(_Outlook(scenario.background.bare, context, camera, scenario.frames))
    if below.size:
        pixels = math.prod(context.geometry.size) * min(scenario.frames, LOOKED)
        yield Bare(f"the {scenario.background.surface}", below, below.size / pixels)


class _Outlook:
    """All that the light of a bare ground or sea depends on: severities that change nothing of it are the same."""

    def __init__(self, background: Background, context: SceneContext, now: Instant, frames: int) -> None:
        self.background, self.context, self.now, self.frames = background, context, now, frames
        self._moved = tuple(way.tobytes() for way in (now.mount.turns, now.mount.places, now.mount.zooms))

    def __hash__(self) -> int:
        return hash(self._moved)

    def __eq__(self, other: object) -> bool:
        mine = (self.frames, self._moved, self.context, self.background)
        return isinstance(other, _Outlook) and mine == (other.frames, other._moved, other.context, other.background)


@lru_cache(maxsize=1)
def _below(outlook: _Outlook) -> Floats:
    """Light of the pixels below the horizon: worked out once for all warnings, and for severities that are alike."""
    light = outlook.background.ground_radiance(outlook.context)
    if light is None:
        return np.zeros(0)
    frames = watched(outlook.frames, LOOKED).astype(int).tolist()
    below = np.concatenate([light(outlook.now.view_direction(frame)) for frame in frames])
    below.setflags(write=False)
    return below
