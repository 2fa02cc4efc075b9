"""Warnings about the motion of camera and targets: below ground, through the camera, too fast, without contact."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice, decimal_text
from irsim.lint.ground import RANGE_TOLERANCE
from irsim.lint.sampling import sampled_paths
from irsim.motion import Crosses, CrossesM, Crossing, MetrePath, Tracks
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, TargetVisibility, sampled_frames
from irsim.types import Floats

_LEAST_HEIGHT_M = 0.1
"""Least height of the camera above the ground or sea, m, for which backgrounds are drawn."""
_ROUNDING_M = 1e-6
"""Rounding error of sums of positions, m."""
_NEAR_M = 1.0
"""Distance from the camera, m, below which a target counts as passing through it."""
_MAX_G = 60.0
"""Largest plausible acceleration, g. The authors chose this round limit: pilots bear some 9 g, missiles tens of g."""
_LASTS_S = 0.25
"""Least duration of a reported acceleration, s: a shorter one comes from a corner of the path or from random motion."""


def camera_follows_disabled_target(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a camera that follows a target that is switched off."""
    for index, motion in enumerate(scenario.camera.motion):
        if isinstance(motion, Tracks) and not scenario.is_on(motion.target):
            yield Notice(
                ("camera", "motion", index, "target"),
                f"{motion.target} is switched off, but the camera still follows it; try to switch {motion.name} "
                "off as well",
            )


def camera_below_ground(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a camera that sinks below the ground or sea of the background or of the targets' paths."""
    context, background = scenario.context, scenario.background
    shown = (target for target in scenario.targets if scenario.is_on(target.id))
    under = [height for target in shown if (height := target.path.level_m) is not None]
    height = min(under, default=math.inf) if background.surface_m is None else background.surface_m
    frames, least = sampled_frames(scenario.frames, MAX_FRAMES), min(_LEAST_HEIGHT_M, height - _ROUNDING_M)
    sinks = {
        index: motion.shifts(frames, context) @ context.geometry.down
        for index, motion in enumerate(scenario.shown.camera.motion)
        if scenario.is_on(motion.name)
    }
    left = height - np.sum([np.zeros(len(frames)), *sinks.values()], axis=0)
    if left.min() < least:
        first = int(np.argmax(left < least))
        yield Notice(
            ("camera", "motion", max(sinks, key=lambda index: sinks[index][first])),
            f"at frame {frames[first]:.0f} the camera reaches the {background.surface}, {height:g} m below "
            f"its first position; it sinks by {height - left.min():.3g} m",
        )


def target_through_camera(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets that pass through the camera."""
    sampled = sampled_frames(scenario.frames, MAX_FRAMES)
    longest = np.diff(sampled).max(initial=1)
    for path in sampled_paths(scenario, sampled):
        relative, frames = path.relative, path.frames
        steps = np.diff(relative, axis=0)
        lengths = np.maximum(np.sum(steps**2, axis=1), 1e-12)
        share = -np.sum(relative[:-1] * steps, axis=1) / lengths  # fraction of each step at which the target is nearest
        nearest = np.linalg.norm(relative[:-1] + share[:, None] * steps, axis=1)
        through = (share >= 0) & (share < 1) & (nearest < _NEAR_M) & (np.diff(frames) <= longest)
        if through.any():
            first = int(np.argmax(through))
            yield Notice(
                path.at,
                f"at frame {frames[first] + share[first]:.0f} {path.target.id} passes through the camera and is behind "
                "it afterwards; try a lower speed, fewer frames, or a path that misses the camera",
            )


def acceleration_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of paths in metres whose acceleration, over three frames, exceeds that of any aircraft or missile.

    Only the first MAX_FRAMES frames are checked. Paths in pixels are exempt, as authors choose them for the picture:
    shipped scenarios whose paths in pixels have a `range_m` reach 340 g.
    """
    rate_hz = scenario.camera.rate_hz
    window, first_frames = max(3, math.ceil(_LASTS_S * rate_hz)), np.arange(float(min(scenario.frames, MAX_FRAMES)))
    for index, target in enumerate(scenario.targets):
        frames = first_frames[first_frames >= target.path.begins]
        if not isinstance(target.path, MetrePath) or len(frames) < window + 2:
            continue
        positions = target.path.positions(frames, scenario.context, target.id)
        second = positions[2:] - 2 * positions[1:-1] + positions[:-2]
        load_g = np.linalg.norm(second, axis=1) * rate_hz**2 / STANDARD_GRAVITY
        lasting = np.lib.stride_tricks.sliding_window_view(load_g, window).min(axis=1)
        if lasting.max() > _MAX_G:
            first = int(np.argmax(lasting > _MAX_G))
            yield Notice(
                ("targets", index, "path"),
                f"from frame {frames[first + 1]:.0f} on {target.id} pulls {lasting.max():.0f} g, and "
                f"more than {_MAX_G:g} is implausible, even for a missile: try a lower speed, or wider turns",
            )


def speed_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets that are faster than any of their kind in the first MAX_FRAMES frames."""
    for path in sampled_paths(scenario, np.arange(float(min(scenario.frames, MAX_FRAMES)))):
        target, frames = path.target, path.frames
        fastest_m_s = target.shape.max_speed_m_s
        if fastest_m_s is None or len(frames) < 2:
            continue
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        # A path in pixels has an estimated range: speed is wrong by the same factor as the range.
        allowed_m_s = fastest_m_s if in_metres else RANGE_TOLERANCE * fastest_m_s
        steps = np.linalg.norm(np.diff(path.positions, axis=0), axis=1)
        speeds_m_s = steps / np.diff(frames) * scenario.camera.rate_hz
        if speeds_m_s.max() > allowed_m_s:
            first = int(np.argmax(speeds_m_s > allowed_m_s))
            instead = "a lower speed" if in_metres else "a lower speed, or nearer to the camera"
            yield Notice(
                path.at,
                f"from frame {frames[first]:.0f} on {target.id} moves at up to "
                f"{decimal_text(float(speeds_m_s.max()), 4)} m/s, and more than {fastest_m_s:g} is implausible, even "
                f"for the fastest {target.shape.kind}: try {instead}",
            )


def crossing_without_contact(scenario: Scenario) -> Iterator[Notice]:
    """Warn of crossings in which the two targets never touch in the picture."""
    visibility = TargetVisibility(scenario)
    for index, target in enumerate(scenario.targets):
        path, trajectories = target.path, visibility.trajectories
        if not isinstance(path, Crossing) or not {target.id, path.target} <= trajectories.keys():
            continue
        pair = trajectories[target.id], trajectories[path.target]
        own, other = (visibility.camera.project(trajectory.positions) for trajectory in pair)
        exist = [all(each.target.exists(frame) for each in pair) for frame in range(scenario.frames)]
        gaps = np.where(exist, _nearest(other - own), np.inf)
        frame = int(np.argmin(gaps))
        both = [visibility.sprite(each.target.id, frame) for each in pair]
        reach = sum(sprite.box.diagonal / 2 for sprite in both if sprite is not None)
        if None not in both and gaps[frame] > reach:
            yield Notice(
                ("targets", index, "path", "miss_px" if isinstance(path, Crosses) else "miss_m"),
                f"{target.id} and {path.target} never meet: their least distance is {gaps[frame]:.3g} px; they touch "
                f"at {reach:.1f} or less",
            )


def _nearest(gaps: Floats) -> Floats:
    """Return the least distance of two targets between each frame and the next, px, (n,).

    `gaps` (n, 2) px is their displacement in each frame. The distance is infinite where a target is behind the camera.
    """
    steps = np.diff(gaps, axis=0, append=gaps[-1:])
    part = -np.sum(gaps * steps, axis=1) / np.maximum(np.sum(steps**2, axis=1), 1e-12)
    nearest = np.linalg.norm(gaps + part.clip(0, 1)[:, None] * steps, axis=1)
    return np.where(np.isnan(nearest), np.inf, nearest)
