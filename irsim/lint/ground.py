"""Warnings about the ground or sea, seen above the horizon or without parallax, and about targets below or above it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from irsim.backgrounds.ground_texture import LEAST_SINE
from irsim.errors import Notice
from irsim.lint.sampling import SampledPath, sampled_paths, world_directions
from irsim.motion import CrossesM, MetrePath
from irsim.motion.camera_trajectory import camera_positions
from irsim.physics.atmosphere import EARTH_KM
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, sampled_frames
from irsim.types import Floats

_SLIDE_PX = 1.0
"""Displacement, px, of an object relative to the ground beneath it up to which it is not visible."""
_MOVED_M = 1.0
"""Displacement of the camera, m, above which ground that stays in the picture is reported even without objects on
it."""
_DEPTH_M = 1.0
"""Accepted depth of a target below level ground, m: real ground is not quite level."""
RANGE_TOLERANCE = 1.5
"""Accepted ratio of a target's distance, which its author estimated for a path in pixels, to the distance of the ground
in the same direction. The target is drawn too small by this ratio. Shipped scenarios reach 1.3."""
_HEIGHT_M = 5.0
"""Largest accepted height of a standing object's center above the ground, m, besides half its length and the hills."""
_HILL_SIGMAS = 4.0
"""Height of the highest hills above the mean ground, in standard deviations."""
_LEVEL_TOLERANCE = 0.1
"""Accepted difference between a target's ground and the background's, as a fraction of the camera's height. A target's
size is wrong by the same fraction."""
_REFRACTION = 1 / 7
"""Curvature of a horizontal ray in standard air over that of the earth (A. T. Young, Distance to the Horizon,
aty.sdsu.edu): horizons are 3.86 km sqrt(height in m) away, without air 3.57 km sqrt(height in m)."""


def ground_above_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a ground without end that fills pictures above the horizon."""
    if not scenario.background.endless:
        return
    frames, sines = _corner_sines(scenario)
    down = sines.max(axis=1)
    if down.min() < 0:
        frame, lowest = frames[down.argmin()], np.degrees(np.arcsin(-down.min()))
        yield Notice(
            ("background",),
            f"at frame {frame:.0f} the picture begins {lowest:.1f} degrees above the horizon, and the ground fills the "
            "sky; try elevation_deg below 0, or a landscape or a sky",
        )


def ground_near_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of pictures up to the horizon over ground with a `height_m`: near the horizon it is not drawn as a plane."""
    background = scenario.background
    if not background.endless or background.surface_m is None:
        return
    frames, sines = _corner_sines(scenario)
    highest = sines.min(axis=1)
    if sines.max(axis=1).min() >= 0 and highest.min() < LEAST_SINE:
        frame, above = frames[highest.argmin()], np.degrees(np.arcsin(-highest.min()))
        where = f"{above:.1f} degrees above the horizon" if above > 0 else f"{-above:.1f} degrees below the horizon"
        yield Notice(
            ("background", "height_m"),
            f"at frame {frame:.0f} the picture reaches up to {where}; higher than "
            f"{math.degrees(math.asin(LEAST_SINE)):.1f} below it the ground seems to rise; try a landscape",
        )


def _corner_sines(scenario: Scenario) -> tuple[Floats, Floats]:
    """Return the sampled frames, (n,), and the sines of the depression angles of the picture's four corners, (n, 4)."""
    right, bottom = (length - 1 for length in scenario.camera.size)
    frames, directions = world_directions(scenario, np.array([[0, 0], [right, 0], [0, bottom], [right, bottom]]))
    return frames, directions[..., 1]


def ground_without_parallax(scenario: Scenario) -> Iterator[Notice]:
    """Warn of ground without parallax, as if infinitely far away, below a moving camera."""
    context, background = scenario.context, scenario.background
    if not background.endless or background.surface_m is not None:
        return
    frames = sampled_frames(scenario.frames)
    moved_m = float(np.linalg.norm(camera_positions(scenario.motions, frames, context), axis=1).max())
    if moved_m == 0:
        return
    enabled = (path for path in sampled_paths(scenario, frames) if scenario.is_on(path.target.id))
    ranges = [(max(float(np.linalg.norm(path.relative, axis=1).min()), 1.0), path.target.id) for path in enabled]
    nearest = min(ranges, default=None)
    slides = moved_m / (nearest[0] * context.geometry.ifov_rad) if nearest else np.inf
    if slides > _SLIDE_PX and (nearest or moved_m > _MOVED_M):
        example = f": {nearest[1]} slides over it by {slides:.0f} px" if nearest else ""
        yield Notice(
            ("background",),
            f"the camera moves by {moved_m:.3g} m, and the ground stays{example}; try height_m, or a landscape",
        )


class _PathOverGround(NamedTuple):
    """Path of a target over level ground or sea, at n sampled frames.

    level     depth of the background's surface below the camera's first position, m
    ground_m  depth of the surface that the target's path itself gives, m; None if it gives none
    depth_m   (n,) depth of the target below the background's surface
    range_m   (n,) distance of the target from the camera's first position
    hills_m   (n,) height of the highest hills above the mean surface
    """

    path: SampledPath
    level: float
    ground_m: float | None
    depth_m: Floats
    range_m: Floats
    hills_m: Floats

    @property
    def half_m(self) -> float:
        """Return half the length of the target, m: the center of a standing target is at most this high above its
        ground."""
        return getattr(self.path.target.shape, "length_m", 0.0) / 2


def _paths_over_ground(scenario: Scenario) -> Iterator[_PathOverGround]:
    """Yield the path of each target, if the background has a surface at a given depth."""
    background, down = scenario.background, scenario.context.geometry.down
    level = background.surface_m
    if level is None:
        return
    for path in sampled_paths(scenario, sampled_frames(scenario.frames, MAX_FRAMES)):
        range_m = np.linalg.norm(path.positions, axis=1)
        hills_m = _HILL_SIGMAS * getattr(background, "hills_mrad", 0.0) * 1e-3 * range_m
        yield _PathOverGround(path, level, path.target.path.level_m, path.positions @ down - level, range_m, hills_m)


def target_off_ground_level(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets whose ground (`ground_m`) lies at another height than the background's ground or sea."""
    surface = scenario.background.surface
    for each in _paths_over_ground(scenario):
        name, level, ground_m, hills_m = each.path.target.id, each.level, each.ground_m, float(each.hills_m.max())
        near_m = max(_LEVEL_TOLERANCE * level, _DEPTH_M) + hills_m
        if ground_m is not None and not -near_m <= level - ground_m <= max(near_m, each.half_m + hills_m):
            yield Notice(
                (*each.path.at, "ground_m"),
                f"the {surface} is {level:g} m below the camera, but {name} moves {ground_m:g} m below it and is "
                f"{'farther' if ground_m > level else 'nearer'} than the {surface} it stands on; try {level:g}",
            )


def target_below_ground(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets below the ground or sea, which does not hide them. Targets with a `ground_m` are exempt."""
    surface = scenario.background.surface
    for each in _paths_over_ground(scenario):
        target, level, depth_m = each.path.target, each.level, each.depth_m
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        allowed_m = _DEPTH_M if in_metres else max((RANGE_TOLERANCE - 1) * level, _DEPTH_M)
        if each.ground_m is None and depth_m.max() > allowed_m:
            first = int(np.argmax(depth_m > allowed_m))
            there = each.range_m[first] * level / (level + depth_m[first])
            yield Notice(
                each.path.at,
                f"at frame {each.path.frames[first]:.0f} {target.id} goes below the {surface}, {level:g} m under the "
                f"camera, by {depth_m.max():.3g} m at most, and is drawn in front of it: it is at "
                f"{each.range_m[first]:.0f} m where the {surface} is at {there:.0f} m",
            )


def target_above_ground(scenario: Scenario) -> Iterator[Notice]:
    """Warn of standing or floating targets high above the ground or sea. Targets with a `ground_m` are exempt."""
    for each in _paths_over_ground(scenario):
        target, level = each.path.target, each.level
        high = -each.depth_m - each.half_m - each.hills_m
        if target.shape.grounded and each.ground_m is None and high.max() > _HEIGHT_M:
            first = int(np.argmax(high > _HEIGHT_M))
            yield Notice(
                each.path.at,
                f"at frame {each.path.frames[first]:.0f} {target.id}, a {target.shape.kind}, is "
                f"{-each.depth_m[first]:.3g} m above the {scenario.background.surface}, {level:g} m under the camera; "
                f"to place it on the ground, use a path in pixels below the horizon with ground_m: {level:g}",
            )


def target_beyond_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets whose center the curvature of the earth would hide, if the camera's height is known."""
    level, down = scenario.background.surface_m, scenario.context.geometry.down
    if level is None:
        return
    for path in sampled_paths(scenario, sampled_frames(scenario.frames, MAX_FRAMES)):
        eye_m, middle_m = (np.maximum(level - points @ down, 0.0) for points in (path.camera, path.positions))
        range_km = np.linalg.norm(path.relative, axis=1) * 1e-3
        limit_km = horizon_km(eye_m) + horizon_km(middle_m)
        if (range_km > limit_km).any():
            first = int(np.argmax(range_km > limit_km))
            yield Notice(
                path.at,
                f"at frame {path.frames[first]:.0f} {path.target.id} is {range_km[first]:.3g} km away; from a camera "
                f"{eye_m[first]:.3g} m up a round earth hides a target {middle_m[first]:.3g} m up beyond "
                f"{limit_km[first]:.3g} km, but the {scenario.background.surface} here is flat",
            )


def horizon_km(height_m: Floats) -> Floats:
    """Return the distance to the horizon, km, for heights in m above a spherical earth with standard air, (n,)."""
    return np.asarray(np.sqrt(2 * EARTH_KM / (1 - _REFRACTION) * height_m * 1e-3))
