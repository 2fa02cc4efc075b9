"""Warnings about the atmosphere, about ranges beyond its fit, and about a sky that does not match it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.config.base import KeyPath
from irsim.errors import Notice
from irsim.motion import PixelPath
from irsim.physics.climate import CLIMATES, FIT_HEIGHT_KM, FIT_KM, fitted_band
from irsim.physics.radiometry import limits, radiance
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import sampled_frames
from irsim.types import Band, BandName

_SAME_RANGE = 1e-9
"""Fraction of a constant range that rounding leaves."""
_LEAST_WATER = 0.5
"""Least fraction of the fitted water above the camera for which the fit of the sky holds in all of its band: above some
1,500 m."""
_HIGH_K = 220.0
"""Temperature of the air above the water, K."""
_ABOVE_WATER: dict[BandName, tuple[str, tuple[float, float]]] = {
    "mwir": ("carbon dioxide", (4.2, 4.45)),
    "lwir": ("ozone", (9.4, 9.9)),
}
"""Gas that dominates the emission of a clear sky above the water, and the middle of its band, um."""


def atmosphere_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of an atmosphere outside the range of the model atmospheres."""
    for at, message in scenario.air.notices(scenario.camera.band):
        yield Notice(("atmosphere", *at), message)


def target_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of each target outside the range of the fit, with the first reason."""
    context = scenario.context
    if context.air.preset == "none" or context.objects is None:
        return
    frames = sampled_frames(scenario.frames)
    places = context.objects.camera_positions(frames, context)
    climbs = -places @ context.geometry.down
    for index, target in enumerate(scenario.targets):
        relative = target.path.positions(frames, context, target.id) - places
        ranges = np.linalg.norm(relative, axis=-1)
        rises = -relative @ context.geometry.down
        for k in (end for of in (ranges, rises, climbs) for end in (of.argmin(), of.argmax())):
            elevation = float(np.arcsin(np.clip(rises[k] / ranges[k], -1, 1)))
            reason = context.air.beyond_fit(context.band, float(ranges[k]), elevation, float(climbs[k]))
            if reason is not None:
                constant = (
                    np.ptp(ranges) <= _SAME_RANGE * ranges.max() and not FIT_KM[0] <= ranges[k] * 1e-3 <= FIT_KM[1]
                )
                written = constant and isinstance(target.path, PixelPath) and target.path.ground_m is None
                place = ("targets", index, "path", *(("range_m",) if written else ()))
                yield Notice(place, reason if constant else f"frame {frames[k]:.0f}: {reason}")
                break


def layer_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of occluders, and of layers of the background at a range of their own, beyond the range of the fit."""
    context = scenario.context
    things: list[tuple[KeyPath, float]] = [
        *((("occluders", index), occluder.range_m) for index, occluder in enumerate(scenario.occluders)),
        *((("background", *place), shell.range_m) for _, place, shell in scenario.background.parallax_surfaces()),
    ]
    for place, range_m in things:
        reason = context.air.beyond_fit(context.band, range_m, context.geometry.elevation_rad)
        if reason is not None:
            yield Notice((*place, "range_m"), reason)


def sky_above_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a sky preset seen from above most of the water, in a band with another share of the remaining gas."""
    context, preset = scenario.context, scenario.sky_preset
    climate = next((climate for name, climate in CLIMATES.items() if name == preset), None)
    fitted = fitted_band(context.band)
    if climate is None or fitted is None or scenario.background.clear(context) is None:
        return
    height_km = context.air.altitude_m * 1e-3
    left = math.exp((FIT_HEIGHT_KM - height_km) / climate.gas_km[fitted])
    gas, (low, high) = _ABOVE_WATER[fitted]
    times = _share(context.band, (low, high)) / _share(fitted, (low, high))
    if left < _LEAST_WATER and not 0.5 <= times <= 2:
        yield Notice(
            ("atmosphere", "altitude_m"),
            f"above {height_km * 1e3:.0f} m the clear sky emits mostly by {gas} at {low:g} to {high:g} um; the "
            f"camera's band has {times:.1f} times the share of {fitted}, the band of the fit of {preset}: the sky is "
            f"too {'cold' if times > 1 else 'warm'}",
        )


def _share(band: Band, part: tuple[float, float]) -> float:
    """Return the fraction of the radiance in a band, of a black body at _HIGH_K, that lies in a part of it, um."""
    (low, high), (lowest, highest) = limits(band), part
    common = max(low, lowest), min(high, highest)
    return float(radiance(common, _HIGH_K) / radiance(band, _HIGH_K)) if common[0] < common[1] else 0.0


def ground_beyond_fit(scenario: Scenario) -> Iterator[Notice]:
    """Warn of level ground or sea in the middle of the picture, beyond the range of the fit."""
    context, depth_m = scenario.context, scenario.background.surface_m
    depression = -context.geometry.elevation_rad
    if depth_m is None or depression <= 0:
        return
    range_m = depth_m / math.sin(depression)
    reason = context.air.beyond_fit(context.band, range_m, -depression) if range_m >= FIT_KM[0] * 1e3 else None
    if reason is not None:
        yield Notice(("background", "kind"), f"in the middle of the picture: {reason}")


def sky_unlike_atmosphere(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a sky other than that of the atmosphere in front of it."""
    air, sky = scenario.air, scenario.sky_preset
    if scenario.background.clear(scenario.context) is not None and not air.is_clear and air.preset != sky:
        given = "of its own temperatures" if sky is None else f"of {sky}"
        wet = " and ".join(word for word, there in (("rain", air.rain_mm_h), ("fog", air.fog_visibility_km)) if there)
        before = f"{wet} of {float(air.air_k(0.0)):.0f} K" if air.preset == "none" else f"an atmosphere of {air.preset}"
        yield Notice(
            ("background", "preset"), f"the sky is {given} behind {before}: distant objects will not fade into it"
        )
