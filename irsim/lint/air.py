"""The air and the sky behind it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.config.base import KeyPath
from irsim.errors import Notice
from irsim.lint.looked import watched
from irsim.motion import PixelPath
from irsim.physics.climate import CLIMATES, FIT_HEIGHT_KM, FIT_KM, fitted_band
from irsim.physics.radiometry import limits, radiance
from irsim.scenario.model import Scenario
from irsim.types import Band, BandName

SAME = 1e-9
"""Of the range: what rounding leaves of one that stays the same in all frames."""

LEAST_WATER = 0.5
"""Share of the fitted water above a camera from which on a clear sky is taken as fitted in all of its band: that above
some 1,500 m."""

HIGH_K = 220.0
"""Temperature of the air above that, K."""

ABOVE_WATER: dict[BandName, tuple[str, tuple[float, float]]] = {
    "mwir": ("carbon dioxide", (4.2, 4.45)),
    "lwir": ("ozone", (9.4, 9.9)),
}
"""What a clear sky shines by above the water, and the middle of its wavelengths, um."""


def beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Air that the model atmospheres were not fitted to."""
    for at, what in scenario.air.notices(scenario.camera.band):
        yield Notice(("atmosphere", *at), what)


def long_paths(scenario: Scenario) -> Iterator[Notice]:
    """For each target that goes beyond the atmosphere's fit, the first reason why."""
    context = scenario.context
    if context.air.preset == "none" or context.objects is None:
        return
    frames = watched(scenario.frames)
    places = context.objects.camera_positions(frames, context)
    climbs = -places @ context.geometry.down
    for index, target in enumerate(scenario.targets):
        pose = target.path.positions(frames, context, target.id) - places
        ranges = np.linalg.norm(pose, axis=-1)
        rises = -pose @ context.geometry.down
        for k in (end for of in (ranges, rises, climbs) for end in (of.argmin(), of.argmax())):
            elevation = float(np.arcsin(np.clip(rises[k] / ranges[k], -1, 1)))
            why = context.air.beyond_fit(context.band, float(ranges[k]), elevation, float(climbs[k]))
            if why is not None:
                same = np.ptp(ranges) <= SAME * ranges.max() and not FIT_KM[0] <= ranges[k] * 1e-3 <= FIT_KM[1]
                written = same and isinstance(target.path, PixelPath) and target.path.ground_m is None
                place = ("targets", index, "path", *(("range_m",) if written else ()))
                yield Notice(place, why if same else f"frame {frames[k]:.0f}: {why}")
                break


def long_views(scenario: Scenario) -> Iterator[Notice]:
    """Occluders, and layers of the background at a range of their own, seen beyond the atmosphere's fit."""
    context = scenario.context
    things: list[tuple[KeyPath, float]] = [
        *((("occluders", index), occluder.range_m) for index, occluder in enumerate(scenario.occluders)),
        *((("background", *place), shell.range_m) for _, place, shell in scenario.background.parallax_surfaces()),
    ]
    for place, range_m in things:
        why = context.air.beyond_fit(context.band, range_m, context.geometry.elevation_rad)
        if why is not None:
            yield Notice((*place, "range_m"), why)


def high_skies(scenario: Scenario) -> Iterator[Notice]:
    """A clear sky of a preset above most of the water, seen in a band with more or less of the gas that is left."""
    context, preset = scenario.context, scenario.sky_preset
    climate = next((climate for name, climate in CLIMATES.items() if name == preset), None)
    fitted = fitted_band(context.band)
    if climate is None or fitted is None or scenario.background.clear(context) is None:
        return
    height_km = context.air.altitude_m * 1e-3
    left = math.exp((FIT_HEIGHT_KM - height_km) / climate.gas_km[fitted])
    gas, (low, high) = ABOVE_WATER[fitted]
    times = _share(context.band, (low, high)) / _share(fitted, (low, high))
    if left < LEAST_WATER and not 0.5 <= times <= 2:
        yield Notice(
            ("atmosphere", "altitude_m"),
            f"above {height_km * 1e3:.0f} m the clear sky shines mostly by {gas} at {low:g} to {high:g} um, of which "
            f"the camera's band has {times:.1f} times the share that {fitted} has, to which {preset} is fitted: its "
            f"sky is too {'cold' if times > 1 else 'warm'}",
        )


def _share(band: Band, part: tuple[float, float]) -> float:
    """Of a black body's light in a band, as cold as the high air, that within some wavelengths, um."""
    (low, high), (lowest, highest) = limits(band), part
    common = max(low, lowest), min(high, highest)
    return float(radiance(common, HIGH_K) / radiance(band, HIGH_K)) if common[0] < common[1] else 0.0


def far_ground(scenario: Scenario) -> Iterator[Notice]:
    """Level ground or sea that is seen in the middle of the picture, farther or through thinner air than the fit's."""
    context, depth_m = scenario.context, scenario.background.surface_m
    depression = -context.geometry.elevation_rad
    if depth_m is None or depression <= 0:
        return
    range_m = depth_m / math.sin(depression)
    why = context.air.beyond_fit(context.band, range_m, -depression) if range_m >= FIT_KM[0] * 1e3 else None
    if why is not None:
        yield Notice(("background", "kind"), f"in the middle of the picture: {why}")


def unlike_skies(scenario: Scenario) -> Iterator[Notice]:
    """A sky that is not that of the air before it, which shines wherever there is some."""
    air, sky = scenario.air, scenario.sky_preset
    if scenario.background.clear(scenario.context) is not None and not air.is_clear and air.preset != sky:
        given = "of its own temperatures" if sky is None else f"of {sky}"
        wet = " and ".join(word for word, there in (("rain", air.rain_mm_h), ("fog", air.fog_visibility_km)) if there)
        before = f"{wet} of {float(air.air_k(0.0)):.0f} K" if air.preset == "none" else f"an atmosphere of {air.preset}"
        yield Notice(("background", "preset"), f"the sky is {given} behind {before}: far things will not fade into it")
