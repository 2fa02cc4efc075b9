"""Warnings about the atmosphere, distances beyond its fit, and a sky that does not match it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.config.base import KeyPath
from irsim.errors import Notice
from irsim.lint.sampling import sampled_paths
from irsim.motion import PixelPath
from irsim.physics.climate import FIT_KM
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import sampled_frames

_SAME_RANGE = 1e-9
"""Relative rounding error of a constant distance to a target."""


def atmosphere_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of an atmosphere outside the conditions to which its model was fitted."""
    for at, message in scenario.air.notices(scenario.camera.band):
        yield Notice(("atmosphere", *at), message)


def target_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of each target at a distance or height to which the atmosphere's model was not fitted, once per target."""
    context = scenario.context
    if context.air.preset == "none":
        return
    down = context.geometry.down
    for path in sampled_paths(scenario, sampled_frames(scenario.frames)):
        ranges, rises, gains = np.linalg.norm(path.relative, axis=-1), -path.relative @ down, -path.camera @ down
        for k in (extreme for values in (ranges, rises, gains) for extreme in (values.argmin(), values.argmax())):
            elevation = float(np.arcsin(np.clip(rises[k] / ranges[k], -1, 1)))
            reason = context.air.beyond_fit(context.band, float(ranges[k]), elevation, float(gains[k]))
            if reason is not None:
                constant = np.ptp(ranges) <= _SAME_RANGE * ranges.max()
                if not constant or FIT_KM[0] <= ranges[k] * 1e-3 <= FIT_KM[1]:
                    yield Notice(path.at, f"frame {path.frames[k]:.0f}: {reason}")
                else:
                    in_pixels = isinstance(path.target.path, PixelPath) and path.target.path.ground_m is None
                    yield Notice((*path.at, "range_m") if in_pixels else path.at, reason)
                break


def layer_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of occluders and background layers (those with a `range_m`) at distances beyond the atmosphere's fit."""
    context = scenario.context
    things: list[tuple[KeyPath, float]] = [
        *((("occluders", index), occluder.range_m) for index, occluder in enumerate(scenario.occluders)),
        *((("background", *place), shell.range_m) for _, place, shell in scenario.background.parallax_surfaces()),
    ]
    for place, range_m in things:
        reason = context.air.beyond_fit(context.band, range_m, context.geometry.elevation_rad)
        if reason is not None:
            yield Notice((*place, "range_m"), reason)


def ground_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of level ground or sea whose distance at the picture's center lies beyond the atmosphere's fit."""
    context, depth_m = scenario.context, scenario.background.surface_m
    depression = -context.geometry.elevation_rad
    if depth_m is None or depression <= 0:
        return
    range_m = depth_m / math.sin(depression)
    reason = context.air.beyond_fit(context.band, range_m, -depression) if range_m >= FIT_KM[0] * 1e3 else None
    if reason is not None:
        yield Notice(("background", "kind"), f"in the middle of the picture: {reason}")


def sky_unlike_atmosphere(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a sky with another preset than the atmosphere in front of it."""
    air, sky = scenario.air, scenario.sky_preset
    if scenario.background.clear(scenario.context) is not None and not air.is_clear and air.preset != sky:
        given = "of its own temperatures" if sky is None else f"of {sky}"
        wet = " and ".join(word for word, there in (("rain", air.rain_mm_h), ("fog", air.fog_visibility_km)) if there)
        before = f"{wet} of {float(air.air_k(0.0)):.0f} K" if air.preset == "none" else f"an atmosphere of {air.preset}"
        yield Notice(
            ("background", "preset"), f"the sky is {given} behind {before}: distant objects will not fade into it"
        )
