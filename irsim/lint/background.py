"""Backgrounds that the camera cannot show, or that cannot be."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Sky
from irsim.backgrounds.chart import STEEPEST_DEG, WIDEST_DEG
from irsim.backgrounds.sky import FIT_K
from irsim.backgrounds.texture import tile_side
from irsim.camera.camera import Camera
from irsim.camera.sensor import Sensor
from irsim.config.quantities import SCALE_K
from irsim.errors import Notice
from irsim.lint.bare import bare
from irsim.lint.looked import watched
from irsim.motion import CameraTrajectory
from irsim.physics.radiometry import radiance, temperature
from irsim.scenario.model import Scenario

A_PART = 0.2
"""It is warned of what fills so much of the picture with full counts, or with count 0: some sun in the waves is always
too bright."""

ROUND_K = 10.0
"""Ends of a scale that are proposed are such round numbers."""


def off_scale(scenario: Scenario) -> Iterator[Notice]:
    """A clear sky, a ground or a sea of which no pixel lies within what the counts can tell, or which fills A_PART of
    the picture with pixels that do not."""
    camera, response = scenario.camera, scenario.camera.response()
    for what, light, share in bare(scenario):
        signal = response.signal(light.astype(np.float32))
        least, most = temperature(scenario.context.band, np.array([light.min(), light.max()])).tolist()
        for beyond, above, lies in (
            (signal >= response.top, True, "above{}: its pixels are full"),
            (signal <= response.bottom, False, "below{}: its pixels are at count 0"),
        ):
            part = float(beyond.mean())
            if part == 1 or part * share >= A_PART:
                of, where = "all", ""
                if part < 1:
                    of, where = (f"{math.floor(100 * each)}%" for each in (part, part * share))
                    where = f", in {where} of the picture"
                yield Notice(
                    ("camera", *_scale(camera.detector)),
                    f"{of} of {what}, {least:.0f} to {most:.0f} K, lies {lies.format(where)}"
                    + _held(camera, least, most, above),
                )


def _scale(detector: Sensor) -> tuple[str, ...]:
    """The camera's key that decides which light its counts can tell."""
    if "range_k" in detector.camera_keys:
        return ("range_k",)
    return ("detector",) if detector.integration_key is None else ("detector", detector.integration_key)


def _held(camera: Camera, least: float, most: float, above: bool) -> str:
    """What would hold temperatures from the least to the most, K, in words; none where nothing is known to."""
    if "range_k" not in camera.detector.camera_keys:
        return f"; try a shorter {camera.detector.integration_key}" if above and camera.detector.integration_key else ""
    (low, high), (lowest, highest) = camera.range_k, SCALE_K
    low = min(low, max(math.floor((least - 1) / ROUND_K) * ROUND_K, lowest))
    high = max(high, math.ceil((most + 1) / ROUND_K) * ROUND_K)
    return f"; range_k: [{low:g}, {high:g}] holds it" if low < least and high <= highest else ""


def upside_down(scenario: Scenario) -> Iterator[Notice]:
    """A clear sky that is warmer at the zenith than at the horizon, where most of the air is."""
    sky = scenario.background
    if isinstance(sky, Sky) and sky.preset is None and sky.zenith_k > sky.horizon_k:
        yield Notice(
            ("background", "zenith_k"),
            f"the zenith of {sky.zenith_k:g} K is warmer than the horizon of {sky.horizon_k:g} K; a clear sky is "
            "coldest at the zenith: try them the other way round",
        )


def cold_clouds(scenario: Scenario) -> Iterator[Notice]:
    """Clouds that are colder than the clear sky low in the picture, where it is warmest.

    In the thermal bands a thick cloud is nearly black and as warm as the air at its height. What a clear sky shows
    behind it comes from the air there and above, which is no warmer.
    """
    background, context = scenario.background, scenario.context
    if not isinstance(background, Sky):
        return
    axis, half = context.geometry.elevation_rad, math.atan(context.geometry.ifov_rad * context.geometry.size[1] / 2)
    low = max(axis - half, 0.0)
    if axis + half <= 0:
        return
    sky_k = float(temperature(context.band, background.clear(context).radiance(np.array(low))))
    for index, cloud in enumerate(background.clouds):
        light = context.through(radiance(context.band, cloud.temperature_k), np.array(1.0), cloud.range_m, low)
        seen_k = float(temperature(context.band, light))
        if seen_k < sky_k - FIT_K:
            yield Notice(
                ("background", "clouds", index, "temperature_k"),
                f"the layer {cloud.id} looks {seen_k:.0f} K, colder than the clear sky of {sky_k:.0f} K behind it low "
                f"in the picture, at {math.degrees(low):.1f} degrees; clouds are as warm as the air at their height",
            )


def large_features(scenario: Scenario) -> Iterator[Notice]:
    """Clouds whose largest features are wider than the texture that they are made of."""
    background, geometry = scenario.background, scenario.context.geometry
    if not isinstance(background, Sky):
        return
    side = tile_side(geometry.size)
    for index, cloud in enumerate(background.clouds):
        wanted = cloud.correlation_mrad * 1e-3 / geometry.ifov_rad
        if wanted > side:
            yield Notice(
                ("background", "clouds", index, "correlation_mrad"),
                f"{cloud.id}: its largest features would be {wanted:.0f} px wide, but it repeats after {side} px: "
                f"they are as those of {side * geometry.ifov_rad * 1e3:.3g} mrad",
            )


def folded(scenario: Scenario) -> Iterator[Notice]:
    """Pictures of which backgrounds have no true map: near the zenith or the nadir, or too wide."""
    context, camera = scenario.context, scenario.camera
    if not scenario.background.has_poles:
        return
    frames = watched(scenario.frames)
    mount = CameraTrajectory.of(scenario.motions, frames, context)
    grid = np.stack(np.meshgrid(*(np.linspace(0, length - 1, 9) for length in camera.size)), axis=-1)
    rotations = [context.geometry.world_rotation(turns) for turns in mount.turns]
    seen = np.stack([mount.lens(k).directions(grid) @ rotation for k, rotation in enumerate(rotations)])
    steepest = np.degrees(np.arcsin(np.abs(seen[..., 1]).max(axis=(1, 2)).clip(0, 1)))
    middle = seen[:, len(grid) // 2]
    widest = math.degrees(np.arccos(np.einsum("nk,nk->n", middle[:, 0], middle[:, -1]).clip(-1, 1)).max())
    if steepest.max() > STEEPEST_DEG:
        yield Notice(
            ("camera", "elevation_deg"),
            f"frame {frames[steepest.argmax()]:.0f}: the picture comes within {90 - steepest.max():.0f} degrees of the "
            f"zenith or the nadir, where the background's map ends: nearer than {90 - STEEPEST_DEG:.0f} it is drawn "
            "distorted",
        )
    if widest > WIDEST_DEG:
        yield Notice(
            ("camera", "ifov_mrad"),
            f"the picture is {widest:.0f} degrees wide: beyond {WIDEST_DEG:.0f} backgrounds are drawn distorted",
        )
