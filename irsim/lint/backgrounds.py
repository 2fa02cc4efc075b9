"""Warnings about skies, clouds, clutter and buildings."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.backgrounds import Ground, Landscape, Sky
from irsim.backgrounds.chart import STEEPEST_DEG, WIDEST_DEG
from irsim.backgrounds.ground_cover import typical
from irsim.backgrounds.panorama import PanoramaGrid
from irsim.backgrounds.sky import FIT_K
from irsim.backgrounds.structures import WINDOW_SHARES
from irsim.backgrounds.texture import tile_shape, tile_side
from irsim.config.base import KeyPath
from irsim.errors import Notice, decimal_text
from irsim.motion import CameraTrajectory
from irsim.physics.radiometry import radiance, temperature
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import sampled_frames

_SPACE_K = 2.725
"""Temperature of the cosmic background (Fixsen, Astrophys. J. 707 (2009) 916)."""
_MAX_LAYERS = 3.0
"""Objects of clutter over each point: exp(-3), 5 % of the ground remains visible."""
_MANY = 150_000
"""Objects of clutter, or windows, that take some 10 s to draw."""
_FAR = 0.5
"""Displacement, as a fraction of a layer's range, from which its texture is distorted: 1.15 times too wide
(1 / cos 30 degrees) for a sideways motion, 2 times too coarse towards it; at 0.9, 2.3 and 10 times."""
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

    In the thermal bands a thick cloud is nearly black and as warm as the air at its height. A clear sky behind it emits
    from the air there and above, which is no warmer.
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
    """Warn of pictures near the zenith or nadir, or too wide for the projection of the background."""
    context, camera = scenario.context, scenario.camera
    if not scenario.background.has_poles:
        return
    frames = sampled_frames(scenario.frames)
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
            f"zenith or the nadir: nearer than {90 - STEEPEST_DEG:.0f} the background is drawn distorted",
        )
    if widest > WIDEST_DEG:
        yield Notice(
            ("camera", "ifov_mrad"),
            f"the picture is {widest:.0f} degrees wide: beyond {WIDEST_DEG:.0f} backgrounds are drawn distorted",
        )


def below_space_temperature(scenario: Scenario) -> Iterator[Notice]:
    """Warn of temperature differences that lead below the temperature of space."""
    for at, of, mean_k, difference_k in _differences(scenario):
        if mean_k + difference_k < _SPACE_K:
            yield Notice(
                ("background", *at),
                f"{difference_k:g} K from {of} of {mean_k:g} K is {mean_k + difference_k:g} K, colder than empty space "
                f"({_SPACE_K:.2g} K): it is drawn without emission",
            )


def _differences(scenario: Scenario) -> Iterator[tuple[KeyPath, str, float, float]]:
    """Yield the path of each temperature difference, its reference, its temperature and the difference, K."""
    background = scenario.shown.background
    if not isinstance(background, Ground | Landscape):
        return
    mean_k = background.mean_k if isinstance(background, Ground) else background.ground_k
    fields, clutter = background.fields, background.clutter
    if fields is not None and fields.lane_mrad and scenario.is_on("fields"):
        yield ("fields", "lane_k"), "ground", mean_k, fields.lane_k
    for name, region in (("roads", background.roads), ("water", background.water)):
        if region is not None and scenario.is_on(name):
            yield (name, "contrast_k"), "ground", mean_k, typical(region.contrast_k, background.hour, name)
    if clutter is not None and clutter.cold and scenario.is_on("clutter"):
        yield ("clutter", "contrast_k"), "ground", mean_k, -clutter.contrast_k[1]
    for index, houses in enumerate(background.buildings if isinstance(background, Landscape) else ()):
        wall_k = typical(houses.temperature_k, background.hour, "walls")
        yield ("buildings", index, "roof_k"), "walls", wall_k, houses.roof_k
        yield ("buildings", index, "windows_k"), "walls", wall_k, max(WINDOW_SHARES) * houses.windows_k


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
    share = min(_MAX_LAYERS / max(clutter.deep, _MAX_LAYERS), _MANY / max(count, _MANY))
    if share < 1:
        deep = f"{decimal_text(clutter.deep, 2)} of them lie over each point on average and hide the ground"
        long = f"there are {decimal_text(count, 2)} of them, which take long to draw"
        reasons = " and ".join(
            reason for reason, holds in ((deep, clutter.deep > _MAX_LAYERS), (long, count > _MANY)) if holds
        )
        yield Notice(
            ("background", "clutter", "per_mrad2"),
            f"{reasons}; try {decimal_text(share * clutter.per_mrad2, 2)} at most",
        )


def too_many_windows(scenario: Scenario) -> Iterator[Notice]:
    """Warn of buildings with so many windows that they take long to draw."""
    background = scenario.background
    for index, row in enumerate(background.buildings if isinstance(background, Landscape) else ()):
        count = row.windows(scenario.context)
        if count > _MANY:
            yield Notice(
                ("background", "buildings", index),
                f"its {decimal_text(count, 2)} windows take long to draw; try a larger spacing_m, or lower or narrower "
                "ones",
            )


def background_layer_passed(scenario: Scenario) -> Iterator[Notice]:
    """Warn of clouds, trees or buildings that a moving camera passes, or comes half as far as.

    They surround its first position, with a texture drawn for it, and are not drawn from outside.
    """
    context, cast, shells = scenario.context, scenario.context.objects, list(scenario.background.parallax_surfaces())
    if not shells or cast is None:
        return
    frames = sampled_frames(scenario.frames)
    level = context.geometry.world_rotation(np.zeros(3))
    places = (cast.camera_positions(frames, context) @ level).tolist()
    for name, at, shell in shells:
        for share, effect in ((1.0, _PASSED), (_FAR, _DISTORTED)):
            beyond = [not shell.contains((x / share, y / share, z / share)) for x, y, z in places]
            if any(beyond):
                yield Notice(
                    ("background", *at, "range_m"),
                    f"at frame {frames[beyond.index(True)]:.0f} the camera has moved by "
                    f"{share * shell.range_m:g} m: {effect.format(name=name)}",
                )
                break
