"""Backgrounds that are not where the camera looks, or do not pass by when it is carried."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds.ground_texture import LEAST_SINE
from irsim.errors import Notice
from irsim.lint.looked import watched
from irsim.motion import CameraTrajectory
from irsim.scenario.model import Scenario
from irsim.types import Floats

SLIDES_PX = 1.0
"""What slides over what should stand beneath it by no more than this is not seen to slide."""
CARRIED_M = 1.0
"""Where there is nothing to slide, a camera that is carried so far should see the ground pass."""
FAR_ACROSS = 0.5
"""From so much of a range on, what is painted around the first place is seen 1.15 times as wide or as high as it should
be (1 / cos 30 degrees, carried across), or twice as coarse (carried towards it); at 0.9 of it, 2.3 and 10 times."""
ASLANT = "{name} is painted as its first place sees it, and is ever more drawn out, or coarse, from there on"
GONE = "it has gone through {name}, which is not drawn any more"


def ground_in_the_sky(scenario: Scenario) -> Iterator[Notice]:
    """Ground in pictures all of which is above the horizon."""
    if not scenario.background.endless:
        return
    frames = watched(scenario.frames)
    down = _sines(scenario, frames).max(axis=1)
    if down.min() < 0:
        frame, lowest = frames[down.argmin()], np.degrees(np.arcsin(-down.min()))
        yield Notice(
            ("background",),
            f"at frame {frame:.0f} the camera looks {lowest:.1f} degrees above the horizon and higher, and ground "
            "fills the sky; try elevation_deg below 0, or a landscape or a sky",
        )


def ground_to_the_horizon(scenario: Scenario) -> Iterator[Notice]:
    """Ground of a given depth below the camera in pictures that reach up to where it is not drawn as a plane, none of
    them all in the sky, which says more."""
    background = scenario.background
    if not background.endless or background.surface_m is None:
        return
    frames = watched(scenario.frames)
    sines = _sines(scenario, frames)
    highest = sines.min(axis=1)
    if sines.max(axis=1).min() >= 0 and highest.min() < LEAST_SINE:
        frame, above = frames[highest.argmin()], np.degrees(np.arcsin(-highest.min()))
        where = f"{above:.1f} degrees above the horizon" if above > 0 else f"{-above:.1f} degrees below the horizon"
        yield Notice(
            ("background", "height_m"),
            f"at frame {frame:.0f} the picture reaches up to {where}; from {math.degrees(math.asin(LEAST_SINE)):.1f} "
            "below it on the ground is drawn as if it rose; try a landscape",
        )


def stays_behind(scenario: Scenario) -> Iterator[Notice]:
    """Ground that is infinitely far off under a camera that is carried."""
    context, background, objects = scenario.context, scenario.background, scenario.context.objects
    if not background.endless or background.surface_m is not None or objects is None:
        return
    frames = watched(scenario.frames)
    places = objects.camera_positions(frames, context)
    carried_m = float(np.linalg.norm(places, axis=1).max())
    if carried_m == 0:
        return
    nearest = _nearest(scenario, frames, places)
    slides = carried_m / (nearest[0] * context.geometry.ifov_rad) if nearest else np.inf
    if slides > SLIDES_PX and (nearest or carried_m > CARRIED_M):
        what = f": what stands on it slides, as {nearest[1]} by some {slides:.0f} px" if nearest else ""
        yield Notice(
            ("background",),
            f"the camera is carried by {carried_m:.3g} m, and the ground does not pass by{what}; try height_m, or a "
            "landscape",
        )


def left_behind(scenario: Scenario) -> Iterator[Notice]:
    """Clouds and rows of trees or buildings that a camera goes through, or half as far: they are around its first
    place, painted as it is seen from there, and not drawn from without."""
    context, objects, shells = scenario.context, scenario.context.objects, list(scenario.background.parallax_surfaces())
    if not shells or objects is None:
        return
    frames = watched(scenario.frames)
    level = context.geometry.world_rotation(np.zeros(3))
    places = (objects.camera_positions(frames, context) @ level).tolist()
    for name, at, shell in shells:
        for share, what in ((1.0, GONE), (FAR_ACROSS, ASLANT)):
            beyond = [not shell.contains((x / share, y / share, z / share)) for x, y, z in places]
            if any(beyond):
                yield Notice(
                    ("background", *at, "range_m"),
                    f"at frame {frames[beyond.index(True)]:.0f} the camera has been carried by "
                    f"{share * shell.range_m:g} m: {what.format(name=name)}",
                )
                break


def _nearest(scenario: Scenario, frames: Floats, places: Floats) -> tuple[float, str] | None:
    """Least range, m, and id of the target that comes nearest; None where there is none."""
    ranges = []
    for target in scenario.shown.targets:
        there = np.array([target.exists(int(frame)) for frame in frames])
        if scenario.is_on(target.id) and there.any():
            ways = target.path.positions(frames[there], scenario.context, target.id) - places[there]
            ranges.append((max(float(np.linalg.norm(ways, axis=1).min()), 1.0), target.id))
    return min(ranges, default=None)


def _sines(scenario: Scenario, frames: Floats) -> Floats:
    """(n, 4): sines of the angles below the level at which the picture's corners are seen in frames (n,)."""
    context = scenario.context
    mount = CameraTrajectory.of(scenario.motions, frames, context)
    right, bottom = (length - 1 for length in scenario.camera.size)
    corners = np.array([[0, 0], [right, 0], [0, bottom], [right, bottom]])
    rotations = [context.geometry.world_rotation(turns) for turns in mount.turns]
    return np.array([(mount.lens(k).directions(corners) @ each)[:, 1] for k, each in enumerate(rotations)])
