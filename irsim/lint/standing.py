"""Targets below or above the ground or the sea, which are drawn before it all the same."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice
from irsim.lint.looked import existing, watched
from irsim.motion import CrossesM, MetrePath
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED
from irsim.targets.target import Target
from irsim.types import Floats

DEEP_M = 1.0
"""Ground that is not quite level may be so much lower."""
FARTHER = 1.5
"""A path in pixels says a direction, and its range is written by eye: up to so many times as far away as the ground or
the sea in that direction, a target looks too small by as much. Shipped scenes have 1.3."""
TALL_M = 5.0
"""The middle of what stands on the ground or the sea is no higher above it, but for half its length and
for hills."""
STEEP = 4.0
"""So many standard deviations above the mean, hills end."""
AGREES = 0.1
"""By such a share of the camera's height a target's level may be off: it looks too large or too small by as much."""


def unlike_level(scenario: Scenario) -> Iterator[Notice]:
    """Targets on a ground (`ground_m`) that is not the background's: deeper, or higher than half their length, for it
    is their middle that goes there."""
    background = scenario.background
    level = background.surface_m
    if level is None:
        return
    for index, target in enumerate(scenario.targets):
        ground_m = target.path.level_m
        if ground_m is None:
            continue
        _, _, range_m = _way(scenario, target, level)
        hills_m = STEEP * getattr(background, "hills_mrad", 0.0) * 1e-3 * float(range_m.max(initial=0))
        near = max(AGREES * level, DEEP_M) + hills_m
        half_m = getattr(target.shape, "length_m", 0.0) / 2
        if not -near <= level - ground_m <= max(near, half_m + hills_m):
            yield Notice(
                ("targets", index, "path", "ground_m"),
                f"the background has its {background.surface} {level:g} m below the camera, {target.id} goes "
                f"{ground_m:g} m below it and is {'farther' if ground_m > level else 'nearer'} than the "
                f"{background.surface} where it stands; try {level:g}",
            )


def buried(scenario: Scenario) -> Iterator[Notice]:
    """Targets that go below the ground or the sea, which does not hide them; not those that say how deep it is."""
    level = scenario.background.surface_m
    if level is None:
        return
    surface = scenario.background.surface
    for index, target in enumerate(scenario.targets):
        if target.path.level_m is not None:
            continue
        frames, deep, range_m = _way(scenario, target, level)
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        too_deep = DEEP_M if in_metres else max((FARTHER - 1) * level, DEEP_M)
        if deep.max(initial=0) > too_deep:
            first = int(np.argmax(deep > too_deep))
            there = range_m[first] * level / (level + deep[first])
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id} goes below the {surface}, {level:g} m under the camera, by "
                f"{deep.max():.3g} m at most, and is drawn before it: it is {range_m[first]:.0f} m away where the "
                f"{surface} is at {there:.0f} m",
            )


def aloft(scenario: Scenario) -> Iterator[Notice]:
    """Targets that stand on the ground or float, high above it; not those that say how deep it is."""
    background = scenario.background
    level = background.surface_m
    if level is None:
        return
    for index, target in enumerate(scenario.targets):
        if not target.shape.grounded or target.path.level_m is not None:
            continue
        frames, deep, range_m = _way(scenario, target, level)
        hills_m = getattr(background, "hills_mrad", 0.0) * 1e-3 * range_m
        high = -deep - getattr(target.shape, "length_m", 0.0) / 2 - STEEP * hills_m
        if high.max(initial=0) > TALL_M:
            first = int(np.argmax(high > TALL_M))
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id}, a {target.shape.kind}, is {-deep[first]:.3g} m above the "
                f"{background.surface}, {level:g} m under the camera; on it are paths in "
                f"pixels below the horizon with ground_m: {level:g}",
            )


def _way(scenario: Scenario, target: Target, level: float) -> tuple[Floats, Floats, Floats]:
    """Frames (n,) in which it is there, how far below the surface it is in them, m, and its range, m.

    level: how far the surface lies below the camera's first place, m.
    """
    context = scenario.context
    frames = existing(target, watched(scenario.frames, LOOKED))
    if not len(frames):
        return frames, frames, frames
    places = target.path.positions(frames, context, target.id)
    return frames, np.asarray(places @ context.geometry.down - level), np.linalg.norm(places, axis=1)
