"""What the air makes of a thing's light on its way to the camera."""

from __future__ import annotations

import numpy as np

from irsim.geometry.pose import CameraPose
from irsim.geometry.sprite import Sprite


def arriving(sprite: Sprite, pose: CameraPose, name: str | None = None) -> Sprite:
    """A sprite as it is seen through the air: its light weakened, the path's light added, and twinkling where
    it is the target of that `name`. The sprite itself where the air does nothing.

    What twinkles is its contrast: what is as bright as all around it does not stand out in turbulent air either.
    """
    context, air = pose.context, pose.context.air
    if name is not None and air.turbulence.cn2 > 0:
        area = sprite.alpha.sum() * (sprite.range_m * pose.lens.ifov_rad) ** 2
        width = 2 * float(np.sqrt(area / np.pi))
        factor = air.turbulence.scintillation(name, pose.time, sprite.range_m, width, context.band, context.seed)
        sprite = sprite._replace(contrast=sprite.contrast * factor)
    if air.is_clear:
        return sprite
    tau, light = air.path(context.band, sprite.range_m, elevation_rad(sprite, pose), pose.climbed_m)
    own, added = tau * sprite.emission, light * sprite.alpha
    arrived = own + added
    total = arrived.sum()
    share = float(added.sum() / total) if total > 0 else 0.0
    (x, y), (own_x, own_y) = sprite.center, sprite.signal_center
    center = (own_x + share * (x - own_x), own_y + share * (y - own_y))
    during = sprite.during and sprite.during.shining(tau, light)
    return sprite._replace(emission=arrived, signal_center=center, during=during)


def elevation_rad(sprite: Sprite, pose: CameraPose) -> float:
    """Elevation above the level at which the camera sees a sprite, rad."""
    direction = pose.lens.directions(np.asarray(sprite.center)) @ pose.rotation
    return float(-np.arcsin(np.clip(direction @ pose.context.geometry.down, -1, 1)))
