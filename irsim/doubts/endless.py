"""Backgrounds that are not where the camera looks, or do not pass by when it is carried."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.doubts.looked import watched
from irsim.errors import Notice
from irsim.motion import Mount
from irsim.scenario import Scenario
from irsim.types import Floats

SLIDES_PX = 1.0
"""What slides over what should stand beneath it by no more than this is not seen to slide."""
CARRIED_M = 1.0
"""Where there is nothing to slide, a camera that is carried so far should see the ground pass."""


def ground_in_the_sky(scenario: Scenario) -> Iterator[Notice]:
    """Ground in pictures all of which is above the horizon."""
    if not scenario.background.endless:
        return
    stage, camera = scenario.stage, scenario.camera
    frames = watched(scenario.frames)
    mount = Mount.of(scenario.motions, frames, stage)
    right, bottom = (length - 1 for length in camera.size)
    corners = np.array([[0, 0], [right, 0], [0, bottom], [right, bottom]])
    rotations = [stage.geometry.world_rotation(turns) for turns in mount.turns]
    down = np.array([(mount.lens(k).directions(corners) @ each)[:, 1].max() for k, each in enumerate(rotations)])
    if down.min() < 0:
        frame, lowest = frames[down.argmin()], np.degrees(np.arcsin(-down.min()))
        yield Notice(
            ("background",),
            f"at frame {frame:.0f} the camera looks {lowest:.1f} degrees above the horizon and higher, and ground "
            "fills the sky; try elevation_deg below 0, or a landscape or a sky",
        )


def stays_behind(scenario: Scenario) -> Iterator[Notice]:
    """Ground and clouds under a camera that is carried: they do not move with its place."""
    stage, background = scenario.stage, scenario.background
    carries = [index for index, motion in enumerate(scenario.camera.motion) if scenario.is_on(motion.name)]
    frames = watched(scenario.frames)
    cast = stage.cast
    if not carries or cast is None:
        return
    places = cast.standpoints(frames, stage)
    carried_m = float(np.linalg.norm(places, axis=1).max())
    if carried_m == 0:
        return
    unit = stage.geometry.ifov_rad
    if background.endless:
        nearest = _nearest(scenario, frames, places)
        slides = carried_m / (nearest[0] * unit) if nearest else np.inf
        if slides > SLIDES_PX and (nearest or carried_m > CARRIED_M):
            what = f": what stands on it slides, as {nearest[1]} by some {slides:.0f} px" if nearest else ""
            yield Notice(
                ("background",),
                f"the camera is carried by {carried_m:.3g} m, and the ground does not pass by{what}; a landscape does",
            )
    for index, cloud in enumerate(getattr(background, "clouds", ())):
        slides = carried_m / (cloud.range_m * unit)
        if slides > SLIDES_PX:
            yield Notice(
                ("background", "clouds", index),
                f"the camera is carried by {carried_m:.3g} m, and {cloud.id}, a layer {cloud.range_m:g} m away, does "
                f"not pass by, as it should by up to {slides:.0f} px; try wind_mrad_s",
            )


def _nearest(scenario: Scenario, frames: Floats, places: Floats) -> tuple[float, str] | None:
    """Least range, m, and id of the target that comes nearest; None where there is none."""
    ranges = []
    for target in scenario.targets:
        there = np.array([target.exists(int(frame)) for frame in frames])
        if scenario.is_on(target.id) and there.any():
            ways = target.path.positions(frames[there], scenario.stage, target.id) - places[there]
            ranges.append((max(float(np.linalg.norm(ways, axis=1).min()), 1.0), target.id))
    return min(ranges, default=None)
