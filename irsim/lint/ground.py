"""Warnings about the ground or sea: seen above the horizon, without parallax, and targets below or above it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds.ground_texture import LEAST_SINE
from irsim.errors import Notice
from irsim.motion import CameraTrajectory, CrossesM, MetrePath
from irsim.physics.atmosphere import EARTH_KM
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, frames_present, sampled_frames
from irsim.targets.target import Target
from irsim.types import Floats

_SLIDE_PX = 1.0
"""Displacement of an object over the ground beneath it that is not visible."""
_MOVED_M = 1.0
"""Motion of the camera that must show in the ground even without objects on it."""
_DEPTH_M = 1.0
"""Depth below level ground that is accepted: real ground is not quite level."""
RANGE_TOLERANCE = 1.5
"""Factor by which the range of a path in pixels, an estimate by its author, may exceed that of the ground in the same
direction: the target is too small by the same factor. Shipped scenarios reach 1.3."""
_HEIGHT_M = 5.0
"""Height of the center of an object on the ground, without half its length and hills."""
_HILL_SIGMAS = 4.0
"""Height of the highest hills above the mean, in standard deviations."""
_LEVEL_TOLERANCE = 0.1
"""Fraction of the camera's height by which a target's ground may differ: the error of its size."""
_REFRACTION = 1 / 7
"""Curvature of a level ray in standard air over that of the earth (A. T. Young, Distance to the Horizon, aty.sdsu.edu):
horizons are 3.86 km sqrt(height in m) away, 3.57 km without air."""


def ground_above_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of ground in pictures that lie above the horizon."""
    if not scenario.background.endless:
        return
    frames = sampled_frames(scenario.frames)
    down = _sines(scenario, frames).max(axis=1)
    if down.min() < 0:
        frame, lowest = frames[down.argmin()], np.degrees(np.arcsin(-down.min()))
        yield Notice(
            ("background",),
            f"at frame {frame:.0f} the picture begins {lowest:.1f} degrees above the horizon, and the ground fills the "
            "sky; try elevation_deg below 0, or a landscape or a sky",
        )


def ground_near_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of ground of a given depth in pictures up to the horizon, near which it is not drawn as a plane.

    Pictures that lie above the horizon have a warning of their own.
    """
    background = scenario.background
    if not background.endless or background.surface_m is None:
        return
    frames = sampled_frames(scenario.frames)
    sines = _sines(scenario, frames)
    highest = sines.min(axis=1)
    if sines.max(axis=1).min() >= 0 and highest.min() < LEAST_SINE:
        frame, above = frames[highest.argmin()], np.degrees(np.arcsin(-highest.min()))
        where = f"{above:.1f} degrees above the horizon" if above > 0 else f"{-above:.1f} degrees below the horizon"
        yield Notice(
            ("background", "height_m"),
            f"at frame {frame:.0f} the picture reaches up to {where}; higher than "
            f"{math.degrees(math.asin(LEAST_SINE)):.1f} below it the ground seems to rise; try a landscape",
        )


def ground_without_parallax(scenario: Scenario) -> Iterator[Notice]:
    """Warn of ground at infinity below a moving camera."""
    context, background, cast = scenario.context, scenario.background, scenario.context.objects
    if not background.endless or background.surface_m is not None or cast is None:
        return
    frames = sampled_frames(scenario.frames)
    places = cast.camera_positions(frames, context)
    moved_m = float(np.linalg.norm(places, axis=1).max())
    if moved_m == 0:
        return
    nearest = _nearest(scenario, frames, places)
    slides = moved_m / (nearest[0] * context.geometry.ifov_rad) if nearest else np.inf
    if slides > _SLIDE_PX and (nearest or moved_m > _MOVED_M):
        example = f": {nearest[1]} slides over it by {slides:.0f} px" if nearest else ""
        yield Notice(
            ("background",),
            f"the camera moves by {moved_m:.3g} m, and the ground stays{example}; try height_m, or a landscape",
        )


def target_off_ground_level(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets on a ground (`ground_m`) other than the background's.

    The path is that of a target's center, so it may lie above the ground by half the target's length.
    """
    background = scenario.background
    level = background.surface_m
    if level is None:
        return
    for index, target in enumerate(scenario.targets):
        ground_m = target.path.level_m
        if ground_m is None:
            continue
        _, _, range_m = _depths(scenario, target, level)
        hills_m = _HILL_SIGMAS * getattr(background, "hills_mrad", 0.0) * 1e-3 * float(range_m.max(initial=0))
        near = max(_LEVEL_TOLERANCE * level, _DEPTH_M) + hills_m
        half_m = getattr(target.shape, "length_m", 0.0) / 2
        if not -near <= level - ground_m <= max(near, half_m + hills_m):
            yield Notice(
                ("targets", index, "path", "ground_m"),
                f"the {background.surface} is {level:g} m below the camera, but {target.id} moves {ground_m:g} m below "
                f"it and is {'farther' if ground_m > level else 'nearer'} than the {background.surface} it stands on; "
                f"try {level:g}",
            )


def target_below_ground(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets below the ground or sea, which does not hide them; not of those with a `ground_m`."""
    level = scenario.background.surface_m
    if level is None:
        return
    surface = scenario.background.surface
    for index, target in enumerate(scenario.targets):
        if target.path.level_m is not None:
            continue
        frames, depth_m, range_m = _depths(scenario, target, level)
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        allowed_m = _DEPTH_M if in_metres else max((RANGE_TOLERANCE - 1) * level, _DEPTH_M)
        if depth_m.max(initial=0) > allowed_m:
            first = int(np.argmax(depth_m > allowed_m))
            there = range_m[first] * level / (level + depth_m[first])
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id} goes below the {surface}, {level:g} m under the camera, by "
                f"{depth_m.max():.3g} m at most, and is drawn in front of it: it is at {range_m[first]:.0f} m where "
                f"the {surface} is at {there:.0f} m",
            )


def target_above_ground(scenario: Scenario) -> Iterator[Notice]:
    """Warn of standing or floating targets high above the ground or sea; not of those with a `ground_m`."""
    background = scenario.background
    level = background.surface_m
    if level is None:
        return
    for index, target in enumerate(scenario.targets):
        if not target.shape.grounded or target.path.level_m is not None:
            continue
        frames, depth_m, range_m = _depths(scenario, target, level)
        hills_m = getattr(background, "hills_mrad", 0.0) * 1e-3 * range_m
        high = -depth_m - getattr(target.shape, "length_m", 0.0) / 2 - _HILL_SIGMAS * hills_m
        if high.max(initial=0) > _HEIGHT_M:
            first = int(np.argmax(high > _HEIGHT_M))
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id}, a {target.shape.kind}, is {-depth_m[first]:.3g} m above "
                f"the {background.surface}, {level:g} m under the camera; to place it on the ground, "
                f"use a path in pixels below the horizon with ground_m: {level:g}",
            )


def target_beyond_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets whose center a round earth would hide, where the background gives the camera's height."""
    context, cast, level = scenario.context, scenario.context.objects, scenario.background.surface_m
    if level is None or cast is None:
        return
    sampled = sampled_frames(scenario.frames, MAX_FRAMES)
    down = context.geometry.down
    for index, target in enumerate(scenario.targets):
        frames = frames_present(target, sampled)
        if not len(frames):
            continue
        camera, places = cast.camera_positions(frames, context), target.path.positions(frames, context, target.id)
        eye_m, middle_m = np.maximum(level - camera @ down, 0.0), np.maximum(level - places @ down, 0.0)
        range_km = np.linalg.norm(places - camera, axis=1) * 1e-3
        seen_km = horizon_km(eye_m) + horizon_km(middle_m)
        if (range_km > seen_km).any():
            first = int(np.argmax(range_km > seen_km))
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frames[first]:.0f} {target.id} is {range_km[first]:.3g} km away; from a camera "
                f"{eye_m[first]:.3g} m up a round earth hides a target {middle_m[first]:.3g} m up beyond "
                f"{seen_km[first]:.3g} km, but the {scenario.background.surface} here is flat",
            )


def horizon_km(height_m: Floats) -> Floats:
    """Return the range of the horizon of a round earth in standard air from heights, m, (n,)."""
    return np.asarray(np.sqrt(2 * EARTH_KM / (1 - _REFRACTION) * np.maximum(height_m, 0.0) * 1e-3))


def _nearest(scenario: Scenario, frames: Floats, places: Floats) -> tuple[float, str] | None:
    """Return the least range of a target, m, and its id; None without targets."""
    ranges = []
    for target in scenario.shown.targets:
        there = np.array([target.exists(int(frame)) for frame in frames])
        if scenario.is_on(target.id) and there.any():
            offsets = target.path.positions(frames[there], scenario.context, target.id) - places[there]
            ranges.append((max(float(np.linalg.norm(offsets, axis=1).min()), 1.0), target.id))
    return min(ranges, default=None)


def _sines(scenario: Scenario, frames: Floats) -> Floats:
    """Return the sines of the angles of the picture's corners below the level in frames, (n, 4)."""
    context = scenario.context
    mount = CameraTrajectory.of(scenario.motions, frames, context)
    right, bottom = (length - 1 for length in scenario.camera.size)
    corners = np.array([[0, 0], [right, 0], [0, bottom], [right, bottom]])
    rotations = [context.geometry.world_rotation(turns) for turns in mount.turns]
    return np.array([(mount.lens(k).directions(corners) @ each)[:, 1] for k, each in enumerate(rotations)])


def _depths(scenario: Scenario, target: Target, level: float) -> tuple[Floats, Floats, Floats]:
    """Return the frames in which a target exists, its depth below the surface and its range in them, m, each (n,).

    level   depth of the surface below the camera's first position, m
    """
    context = scenario.context
    frames = frames_present(target, sampled_frames(scenario.frames, MAX_FRAMES))
    if not len(frames):
        return frames, frames, frames
    places = target.path.positions(frames, context, target.id)
    return frames, np.asarray(places @ context.geometry.down - level), np.linalg.norm(places, axis=1)
