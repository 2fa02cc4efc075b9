"""Warnings about the motion of camera and targets: below ground, through the camera, too fast, missed crossings."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice, decimal_text
from irsim.lint.ground import RANGE_TOLERANCE
from irsim.motion import Crosses, CrossesM, Crossing, MetrePath, Tracks
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.relative import STILL_PX
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, TargetVisibility, frames_present, sampled_frames
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Floats

_LEAST_HEIGHT_M = 0.1
"""Least height above the ground or sea for which backgrounds are drawn."""
_ROUNDING_M = 1e-6
"""Rounding error of sums of metres."""
_NEAR_M = 1.0
"""Distance from the camera at which a target passes through it."""
_MAX_G = 60.0
"""Round limit by the authors, not the figure of any missile: pilots bear some 9 g, missiles tens."""
_LASTS_S = 0.25
"""Least duration of an acceleration: a shorter one is a corner or random."""
_ANGLE_TOLERANCE_DEG = 10.0
"""Error of a crossing angle that is reported."""
_AROUND = 5
"""Frames before and after a crossing between which directions are measured: the mean of a shaking camera."""


def camera_follows_disabled_target(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a camera that follows a disabled target."""
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
    context, cast = scenario.context, scenario.context.objects
    sampled = sampled_frames(scenario.frames, MAX_FRAMES)
    apart = np.diff(sampled).max(initial=1)
    for index, target in enumerate(scenario.targets):
        frames = frames_present(target, sampled)
        if len(frames) < 2 or cast is None:
            continue
        places = target.path.positions(frames, context, target.id) - cast.camera_positions(frames, context)
        steps = np.diff(places, axis=0)
        lengths = np.maximum(np.sum(steps**2, axis=1), 1e-12)
        share = -np.sum(places[:-1] * steps, axis=1) / lengths  # of each step, where it comes nearest
        nearest = np.linalg.norm(places[:-1] + share[:, None] * steps, axis=1)
        through = (share >= 0) & (share < 1) & (nearest < _NEAR_M) & (np.diff(frames) <= apart)
        if through.any():
            at = int(np.argmax(through))
            frame = frames[at] + share[at]
            yield Notice(
                ("targets", index, "path"),
                f"at frame {frame:.0f} {target.id} passes through the camera and is behind it afterwards; try a lower "
                "speed, fewer frames, or a path that misses the camera",
            )


def acceleration_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of paths in metres whose acceleration, m/s2 over three frames, exceeds that of any aircraft or missile.

    Only the first MAX_FRAMES frames count. Paths in pixels are exempt: they are drawn for the picture, and shipped
    scenarios with a range reach 340 g.
    """
    rate_hz = scenario.camera.rate_hz
    window, first_frames = max(3, math.ceil(_LASTS_S * rate_hz)), np.arange(float(min(scenario.frames, MAX_FRAMES)))
    for index, target in enumerate(scenario.targets):
        frames = first_frames[first_frames >= target.path.begins]
        if not isinstance(target.path, MetrePath) or len(frames) < window + 2:
            continue
        places = target.path.positions(frames, scenario.context, target.id)
        bent = np.linalg.norm(places[2:] - 2 * places[1:-1] + places[:-2], axis=1) * rate_hz**2 / STANDARD_GRAVITY
        lasting = np.lib.stride_tricks.sliding_window_view(bent, window).min(axis=1)
        if lasting.max() > _MAX_G:
            first = int(np.argmax(lasting > _MAX_G))
            yield Notice(
                ("targets", index, "path"),
                f"from frame {frames[first + 1]:.0f} on {target.id} pulls {lasting.max():.0f} g, and "
                f"more than {_MAX_G:g} is implausible, even for a missile: try a lower speed, or wider turns",
            )


def speed_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets faster through space than any of their kind, in the first MAX_FRAMES frames."""
    rate_hz = scenario.camera.rate_hz
    first_frames = np.arange(float(min(scenario.frames, MAX_FRAMES)))
    for index, target in enumerate(scenario.targets):
        fastest_m_s, frames = target.shape.max_speed_m_s, frames_present(target, first_frames)
        if fastest_m_s is None or len(frames) < 2:
            continue
        in_metres = isinstance(target.path, MetrePath | CrossesM)
        # The range of a path in pixels is an estimate: speed is too high by the same factor.
        allowed_m_s = fastest_m_s if in_metres else RANGE_TOLERANCE * fastest_m_s
        places = target.path.positions(frames, scenario.context, target.id)
        speeds_m_s = np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(frames) * rate_hz
        if speeds_m_s.max() > allowed_m_s:
            first = int(np.argmax(speeds_m_s > allowed_m_s))
            most = decimal_text(float(speeds_m_s.max()), 4)
            instead = "a lower speed" if in_metres else "a lower speed, or nearer to the camera"
            yield Notice(
                ("targets", index, "path"),
                f"from frame {frames[first]:.0f} on {target.id} moves at up to {most} m/s, and more than "
                f"{fastest_m_s:g} is implausible, even for the fastest {target.shape.kind}: try {instead}",
            )


def crossing_without_contact(scenario: Scenario) -> Iterator[Notice]:
    """Warn of crossings at a distance where the two targets never touch in the picture."""
    visibility = TargetVisibility(scenario)
    for index, path, pair in _pairs(visibility):
        pixels = [visibility.camera.seen(trajectory.positions) for trajectory in pair]
        apart = _nearest(pixels[1] - pixels[0])
        exist = [all(trajectory.target.exists(frame) for trajectory in pair) for frame in range(scenario.frames)]
        frame = int(np.argmin(np.where(exist, apart, np.inf)))
        both = [visibility.sprite(trajectory.target.id, frame) for trajectory in pair]
        reach = sum(one.box.diagonal / 2 for one in both if one is not None)
        if None not in both and apart[frame] > reach:
            yield Notice(
                ("targets", index, "path", "miss_px" if isinstance(path, Crosses) else "miss_m"),
                f"{pair[0].target.id} and {path.target} never meet: their least distance is {apart[frame]:.3g} px; "
                f"they touch at {reach:.1f} or less",
            )


def crossing_angle_changed(scenario: Scenario) -> Iterator[Notice]:
    """Warn of crossings in pixels whose angle in the picture is changed by the motion of the camera."""
    visibility = TargetVisibility(scenario)
    for index, path, pair in _pairs(visibility):
        between = [max(round(path.at_frame) - _AROUND, 0), min(round(path.at_frame) + _AROUND, scenario.frames - 1)]
        if not isinstance(path, Crosses) or between[0] >= between[1]:
            continue
        positions = [trajectory.positions for trajectory in pair]
        intended = _angle_deg(*(visibility.context.geometry.project(places[between]) for places in positions))
        shown = _angle_deg(*(visibility.camera.seen(places)[between] for places in positions))
        if abs(math.remainder(shown - intended, 360)) > _ANGLE_TOLERANCE_DEG:
            both = f"{pair[0].target.id} and {path.target}"
            yield Notice(
                ("targets", index, "path", "angle_deg"),
                f"in the picture {both} cross at {math.remainder(shown, 360):.0f} degrees, and "
                f"for a camera at rest at {math.remainder(intended, 360):.0f}: its motion adds to both",
            )


def _pairs(visibility: TargetVisibility) -> Iterator[tuple[int, Crossing, tuple[TargetTrajectory, TargetTrajectory]]]:
    """Yield the index of each enabled crossing target, its path, and the trajectories of it and of the other."""
    for index, target in enumerate(visibility.scenario.targets):
        path = target.path
        if isinstance(path, Crossing) and {target.id, path.target} <= visibility.trajectories.keys():
            yield index, path, (visibility.trajectories[target.id], visibility.trajectories[path.target])


def _angle_deg(ours: Floats, other: Floats) -> float:
    """Return the angle from the other's direction to ours, degrees clockwise, each from and to a point, (2, 2) px.

    nan where one stands still or is behind the camera.
    """
    directions = [float(to[0] - before[0]) + 1j * float(to[1] - before[1]) for before, to in (ours, other)]
    if not min(map(abs, directions)) > STILL_PX:
        return math.nan
    return float(np.degrees(np.angle(directions[0] / directions[1])))


def _nearest(gaps: Floats) -> Floats:
    """Return the least distance of two targets between each frame and the next, px, (n,), from gaps (n, 2) px.

    inf where one is behind the camera.
    """
    steps = np.diff(gaps, axis=0, append=gaps[-1:])
    part = -np.sum(gaps * steps, axis=1) / np.maximum(np.sum(steps**2, axis=1), 1e-12)
    nearest = np.linalg.norm(gaps + part.clip(0, 1)[:, None] * steps, axis=1)
    return np.where(np.isnan(nearest), np.inf, nearest)
