"""Warnings about skies, clouds, clutter and layers that the camera passes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Ground, Landscape, Sky
from irsim.backgrounds.chart import STEEPEST_DEG, WIDEST_DEG
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.sky import FIT_K
from irsim.backgrounds.texture import tile_shape, tile_side
from irsim.errors import Notice, decimal_text
from irsim.lint.sampling import elevation_range, world_directions
from irsim.motion.camera_trajectory import camera_positions
from irsim.physics.radiometry import radiance, temperature
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import sampled_frames

_MAX_LAYERS = 3.0
"""Most objects of clutter that overlap at a point, on average: exp(-3), 5 % of the ground, remains visible."""
_MANY = 500_000
"""Number of clutter objects that takes some 30 s to draw."""
_FAR = 0.5
"""Displacement of the camera, as a fraction of a layer's distance, that distorts the layer's texture. It is 1.15 times
too wide (1 / cos 30 degrees) after a sideways motion, 2 times too coarse after a motion towards the layer."""
_DISTORTED = "the texture of {name}, drawn for the first position, becomes stretched or coarse"
_PASSED = "it has passed {name}, which is no longer drawn"


def sky_inverted(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a clear sky that is warmer at the zenith than at the horizon."""
    sky = scenario.background
    if isinstance(sky, Sky) and sky.preset is None and sky.zenith_k > sky.horizon_k:
        yield Notice(
            ("background", "zenith_k"),
            f"the zenith of {sky.zenith_k:g} K is warmer than the horizon of {sky.horizon_k:g} K; a clear sky is "
            "coldest at the zenith: try to swap them",
        )


def clouds_colder_than_sky(scenario: Scenario) -> Iterator[Notice]:
    """Warn of clouds colder than the clear sky low in the picture, where it is warmest.

    In the thermal bands a thick cloud is nearly black and as warm as the air at its height. The clear sky behind it
    emits from air at that height and above, which is no warmer.
    """
    background, context = scenario.background, scenario.context
    bottom, top = elevation_range(context)
    if not isinstance(background, Sky) or top <= 0:
        return
    low = max(bottom, 0.0)
    sky_k = float(temperature(context.band, background.clear(context).radiance(np.array(low))))
    for index, cloud in enumerate(background.clouds):
        light = context.through(radiance(context.band, cloud.temperature_k), np.array(1.0), cloud.range_m, low)
        layer_k = float(temperature(context.band, light))
        if layer_k < sky_k - FIT_K:
            yield Notice(
                ("background", "clouds", index, "temperature_k"),
                f"the layer {cloud.id} looks {layer_k:.0f} K, colder than the clear sky of {sky_k:.0f} K behind it low "
                f"in the picture, at {math.degrees(low):.1f} degrees; clouds are as warm as the air at their height",
            )


def cloud_features_too_large(scenario: Scenario) -> Iterator[Notice]:
    """Warn of clouds whose largest features are wider than their texture."""
    background, geometry = scenario.background, scenario.context.geometry
    if not isinstance(background, Sky):
        return
    side = tile_side(geometry.size)
    for index, cloud in enumerate(background.clouds):
        wanted = cloud.correlation_mrad * 1e-3 / geometry.ifov_rad
        if wanted > side:
            yield Notice(
                ("background", "clouds", index, "correlation_mrad"),
                f"{cloud.id}: its largest features would be {wanted:.0f} px wide, but its texture repeats after "
                f"{side} px: try {side * geometry.ifov_rad * 1e3:.3g} mrad at most",
            )


def projection_distorted(scenario: Scenario) -> Iterator[Notice]:
    """Warn of pictures near the zenith or nadir, or so wide that the projection of the background distorts them."""
    if not scenario.background.has_poles:
        return
    grid = np.stack(np.meshgrid(*(np.linspace(0, length - 1, 9) for length in scenario.camera.size)), axis=-1)
    frames, directions = world_directions(scenario, grid)
    steepest = np.degrees(np.arcsin(np.abs(directions[..., 1]).max(axis=(1, 2)).clip(0, 1)))
    middle = directions[:, len(grid) // 2]
    widest = math.degrees(np.arccos(np.einsum("nk,nk->n", middle[:, 0], middle[:, -1]).clip(-1, 1)).max())
    if steepest.max() > STEEPEST_DEG:
        yield Notice(
            ("camera", "elevation_deg"),
            f"frame {frames[steepest.argmax()]:.0f}: the picture comes within {90 - steepest.max():.0f} degrees of the "
            f"zenith or the nadir: nearer than {90 - STEEPEST_DEG:.0f} the background is drawn distorted",
        )
    if widest > WIDEST_DEG:
        yield Notice(
            ("camera", "ifov_mrad"),
            f"the picture is {widest:.0f} degrees wide: beyond {WIDEST_DEG:.0f} backgrounds are drawn distorted",
        )


def clutter_too_dense(scenario: Scenario) -> Iterator[Notice]:
    """Warn of clutter that hides its ground, or takes long to draw."""
    background, geometry = scenario.background, scenario.context.geometry
    if not isinstance(background, Ground | Landscape) or background.clutter is None or not scenario.is_on("clutter"):
        return
    clutter, px_per_mrad = background.clutter, 1e-3 / geometry.ifov_rad
    if isinstance(background, Ground):
        count = clutter.mean_count(tile_shape(geometry.size), px_per_mrad)
    else:
        count = clutter.mean_count_perspective(PanoramaGrid.of(geometry).shape[1], 0.0, px_per_mrad)
    reasons = []
    if clutter.deep > _MAX_LAYERS:
        reasons.append(f"{decimal_text(clutter.deep, 2)} of them lie over each point on average and hide the ground")
    if count > _MANY:
        reasons.append(f"there are {decimal_text(count, 2)} of them, which take long to draw")
    if reasons:
        share = min(_MAX_LAYERS / max(clutter.deep, _MAX_LAYERS), _MANY / max(count, _MANY))
        yield Notice(
            ("background", "clutter", "per_mrad2"),
            f"{' and '.join(reasons)}; try {decimal_text(share * clutter.per_mrad2, 2)} at most",
        )


def background_layer_passed(scenario: Scenario) -> Iterator[Notice]:
    """Warn of clouds, trees or buildings that a moving camera passes, or approaches to half their initial distance.

    Each such layer surrounds the camera's first position, and its texture is drawn as seen from there. From outside, a
    layer is not drawn at all.
    """
    context, frames = scenario.context, sampled_frames(scenario.frames)
    level = context.geometry.world_rotation(np.zeros(3))
    positions = (camera_positions(scenario.motions, frames, context) @ level).tolist()
    for name, at, shell in scenario.background.parallax_surfaces():
        for share, effect in ((1.0, _PASSED), (_FAR, _DISTORTED)):
            beyond = [not shell.contains((x / share, y / share, z / share)) for x, y, z in positions]
            if any(beyond):
                yield Notice(
                    ("background", *at, "range_m"),
                    f"at frame {frames[beyond.index(True)]:.0f} the camera has moved by "
                    f"{share * shell.range_m:g} m: {effect.format(name=name)}",
                )
                break
