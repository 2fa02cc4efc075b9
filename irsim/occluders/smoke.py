"""An occluding cloud of smoke: partly transparent, growing, drifting, fading.

The optical depth is a smooth profile with round puffs at the edge. Billows, which are random fields, displace the edge
and vary optical depth and temperature. Numbers without a source were chosen by eye.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, NotNegative, Number, Pair
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.random_fields import power_law
from irsim.geometry.silhouette import clip_to_view
from irsim.geometry.sprite import Sprite
from irsim.occluders.base import Occluder, Size, required
from irsim.rng import stream
from irsim.types import Box, Floats

_PUFFS = 24
"""Number of puffs around the edge."""
_REACH = 2.2
"""Distance from the middle to which smoke is drawn, in half sizes of the cloud; the optical depth beyond is below a
thousandth."""
_YOUNG = 0.35
"""Initial size as a share of the full size."""
_DENSEST = 0.999
"""Largest opacity: opacity 1 would need an infinite optical depth."""
_RISES = 0.5
"""Least ratio of height to width of billowing smoke placed by `hides`."""
_SIDE = 256
"""Side of the periodic fields of billows, texels."""
_TEXELS = 40.0
"""Texels per half of the cloud's shorter side, which is also the size of the largest billows."""
_DEPTH_SLOPE = 11 / 3
"""Spectral slope of optical depth and temperature, as of a scalar mixed by turbulence (Obukhov 1949)."""
_EDGE_SLOPE = 5.5
"""Spectral slope of the edge's displacement: steeper, so that billows are round."""
_ROLLING = 0.35
"""Horizontal speed of the two fields of billows, which move in opposite directions, in halves of the cloud's shorter
side a second; the vertical speed is 0.6 of the horizontal one."""
_DISPLACEMENT = 0.32
"""Standard deviation of the edge's displacement, half sizes of the cloud."""
_MOST = 1.5
"""Largest displacement of the edge, in units of `_DISPLACEMENT`."""
_INNER = 0.9
"""Radius, in half sizes, within which billows displace nothing, so that `opacity` holds there."""
_OUTER = 1.4
"""Radius, in half sizes, beyond which billows displace in full."""
_MODULATION = 0.5
"""Standard deviation, beyond `_OUTER`, of the logarithm of the optical depth."""


class Smoke(Occluder):
    """A cloud of smoke: dense in the middle, with rolling puffs at the edge."""

    placement_keys: ClassVar[tuple[str, ...]] = ("center_px", "size_px")
    translucent: ClassVar[bool] = True
    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"hides": ("opacity", "begins_frame", "lasts_frames")}

    switches: ClassVar[Switches] = {
        "drift": ("drift_px_s", (0.0, 0.0)),
        "billows": ("billows", 0.0),
        "texture": ("spread_k", 0.0),
    }

    center_px: Pair | None = None
    """[x, y] of the middle in the frame in which growth ends (frame 0 without growth), px of the unmoved camera."""
    size_px: Size | None = None
    """[width, height] of the dense middle, an ellipse, when the cloud has grown to full size, px of the unmoved camera.
    Thinner smoke surrounds it."""
    opacity: Annotated[float, Field(ge=0, le=_DENSEST)] = 0.9
    """Share of the background's light that the dense middle absorbs when the cloud has grown to full size. With `hides`
    it follows from `fraction`."""
    temperature_k: Kelvin = 288.0
    """Temperature, kelvin; emissivity equals absorptance."""
    billows: Fraction = 1.0
    """Strength of the billows that displace the edge and vary the optical depth, 0 to 1; 0 is a smooth cloud. Billowing
    smoke placed by `hides` rises above the target and is at least half as high as wide."""
    spread_k: KelvinSpread = 0.5
    """Standard deviation of temperature between billows, kelvin."""
    begins_frame: Number | None = None
    """Frame at which growth begins; default: full size from the start."""
    grow_frames: NotNegative = 15.0
    """Duration of growth, frames."""
    lasts_frames: NotNegative | None = None
    """Time at full size before fading begins, frames; default: no fading."""
    fade_frames: NotNegative = 30.0
    """Duration of fading, frames."""
    drift_px_s: Pair = (0.0, 0.0)
    """Drift with the wind, [right, down], px of the unmoved camera a second."""

    def draw(self, pose: CameraPose) -> Sprite | None:
        context = pose.context
        frame = pose.time * context.rate_hz
        age = math.inf if self.begins_frame is None else frame - self.begins_frame
        grown = _ease(age, self.grow_frames)
        left = (
            1.0
            if self.lasts_frames is None
            else 1 - _ease(age - self.grow_frames - self.lasts_frames, self.fade_frames)
        )
        if grown * left <= 0:
            return None
        since = frame if self.begins_frame is None else age - self.grow_frames
        drift = np.asarray(self.drift_px_s) * since / context.rate_hz
        (x, y), (wide, tall) = required(self.center_px) + drift, required(self.size_px)
        scale = _YOUNG + (1 - _YOUNG) * grown + 0.3 * (1 - left)
        # The projection is linearised about the middle: accurate enough for an object without sharp edges.
        around = np.array([[x, y], [x + 1, y], [x, y + 1]])
        middle, right, down = pose.pixels(around, self.range_m)
        zoom = np.array([np.hypot(*(right - middle)), np.hypot(*(down - middle))])
        if not np.isfinite(middle).all():
            return None
        halves = zoom * np.array([wide, tall]) / 2 * scale
        blurred = np.hypot(halves, pose.zoomed.psf_px)
        reach = (_REACH + self.billows * _DISPLACEMENT * _MOST) * blurred
        box = Box(float(middle[0]), float(middle[1]), float(2 * blurred[0]), float(2 * blurred[1]))
        window = clip_to_view(Box(box.cx, box.cy, float(2 * reach[0]), float(2 * reach[1])), context)
        if window is None:
            return None
        x0, y0 = round(window.left), round(window.top)
        columns, rows = np.arange(x0, round(window.right) + 1), np.arange(y0, round(window.bottom) + 1)
        u, v = (columns - middle[0]) / blurred[0], (rows - middle[1]) / blurred[1]
        depth = -math.log(1 - self.opacity) * grown * left / scale**0.5
        profile, kelvin = self._fields(u, v, blurred, context.seed, pose.time)
        alpha = -np.expm1(-depth * profile)
        emission = alpha * context.grey_body_radiance(kelvin, 1.0)
        center = (float(middle[0]), float(middle[1]))
        distance_m = pose.distance_m(Box(float(x), float(y), 0.0, 0.0), self.range_m)
        return Sprite(x0, y0, alpha, alpha, emission, center, center, box, distance_m, float(alpha.sum()))

    def _fields(self, u: Floats, v: Floats, halves: Floats, seed: int, time: float) -> tuple[Floats, Floats | float]:
        """Return relative optical depth, at least 1 in the dense middle, and temperature, K.

        u, v    columns and rows from the middle, in half sizes of the cloud
        halves  (2,) px, half width and half height of the cloud
        """
        if self.billows == 0 and self.spread_k == 0:
            return _profile(u[None, :], v[:, None], seed, self.name, time), self.temperature_k
        across, down = halves / halves.min()
        displacement, depth, warmth = np.moveaxis(_billow_fields(u * across, v * down, time, seed, self.name), -1, 0)
        kelvin = np.maximum(self.temperature_k + self.spread_k * warmth, 1.0)
        if self.billows == 0:
            return _profile(u[None, :], v[:, None], seed, self.name, time), kelvin
        profile = _profile(*_displaced(u, v, displacement, self.billows), seed, self.name, time)
        return profile * _modulated(u, v, depth, self.billows), kelvin

    def covering(self, window: Box, density: float, context: SceneContext) -> Smoke:
        first, last = required(self.frames)
        drift = np.asarray(self.drift_px_s) * (last - first) / 2 / context.rate_hz
        # The dense middle is an ellipse through the window's corners, with room for its drift.
        size = (math.sqrt(2) * (window.w + 2 * abs(drift[0])), math.sqrt(2) * (window.h + 2 * abs(drift[1])))
        # Billowing smoke is higher, and still passes through the window's lower corners.
        high = max(size[1], _RISES * size[0] if self.billows else 0.0)
        center = (window.cx - drift[0], window.cy - drift[1] - (high - size[1]) / math.sqrt(8))
        return self.placed(
            center_px=center, size_px=(size[0], high), opacity=_DENSEST * density,
            begins_frame=first - self.grow_frames, lasts_frames=float(last - first),
        )  # fmt: skip


def _ease(age: float, span: float) -> float:
    """Return the smoothstep of an age, which rises from 0 at age 0 to 1 at age `span`."""
    if span <= 0 or age >= span:
        return float(age >= 0)
    part = max(age / span, 0.0)
    return part * part * (3 - 2 * part)


def _profile(u: Floats, v: Floats, seed: int, name: str, time: float) -> Floats:
    """Return the optical depth of smooth smoke (rows, columns): at least 1 within the unit circle of (u, v), uneven
    around it.

    u, v  (1, columns) and (rows, 1), or (rows, columns) each
    """
    places, sizes, spins = _puffs(seed, name)
    total = 1.5 * np.exp(-(((v**2 + u**2) / 1.6) ** 2))
    angles = spins * time
    turned = np.stack([np.cos(angles), np.sin(angles)], axis=1) * 0.12
    for (x, y), size, (dx, dy) in zip(places, sizes, turned, strict=True):
        total += 0.8 * np.exp(-(((v - y - dy) / size) ** 2)) * np.exp(-(((u - x - dx) / size) ** 2))
    return np.asarray(total)


@lru_cache(maxsize=64)
def _puffs(seed: int, name: str) -> tuple[Floats, Floats, Floats]:
    """Return positions (n, 2) and sizes (n,) of puffs, half sizes of the cloud, and the rates at which they circle,
    rad/s."""
    rng = stream(seed, name, "puffs")
    angles = 2 * np.pi * (np.arange(_PUFFS) + rng.uniform(-0.4, 0.4, _PUFFS)) / _PUFFS
    sizes = rng.uniform(0.15, 0.4, _PUFFS)
    reach = rng.uniform(0.6, 1.35, _PUFFS)
    places = reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return places, sizes, rng.uniform(0.5, 1.5, _PUFFS) * rng.choice([-1, 1], _PUFFS)


def _billow_fields(x: Floats, y: Floats, time: float, seed: int, name: str) -> Floats:
    """Return random fields of mean 0 and variance 1 for edge displacement, optical depth and temperature (rows, cols,
    3).

    x (cols,), y (rows,)  positions from the middle, in halves of the shorter side
    time                  s
    """
    field = _periodic_fields(seed, name)
    total = np.zeros((len(y), len(x), 3), np.float32)
    for way, begin in ((1.0, 0.0), (-1.0, _SIDE / 2)):
        rolled = way * _ROLLING * time
        columns, rows = (
            np.mod(part * _TEXELS + begin, _SIDE).astype(np.float32)
            for part in np.broadcast_arrays(x + rolled, y[:, None] + 0.6 * rolled)
        )
        total += cv2.remap(field, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(total / np.sqrt(2))


def _displaced(u: Floats, v: Floats, displacement: Floats, billows: float) -> tuple[Floats, Floats]:
    """Return the positions (u, v), (rows, cols) each, from which billows move smoke to `u` (cols,), `v` (rows,). The
    unit is half the size of the cloud."""
    radius = np.hypot(u, v[:, None])
    share = np.clip((radius - _INNER) / (_OUTER - _INNER), 0, 1)
    out = billows * _DISPLACEMENT * _MOST * np.tanh(displacement / _MOST) * share
    times = 1 - out / np.maximum(radius, _INNER)
    return u * times, v[:, None] * times


def _modulated(u: Floats, v: Floats, depth: Floats, billows: float) -> Floats:
    """Return the factor on the optical depth due to billows, (rows, cols), at least 1 in the dense middle."""
    outside = np.clip((np.hypot(u, v[:, None]) - 1) / (_OUTER - 1), 0, 1)
    return np.exp(billows * _MODULATION * (np.maximum(depth, 0) + outside * np.minimum(depth, 0)))


@lru_cache(maxsize=8)
def _periodic_fields(seed: int, name: str) -> Floats:
    """Return the periodic fields of `_billow_fields`, (side, side, 3), of mean 0 and variance 1."""
    slopes = {"pushed": _EDGE_SLOPE, "thick": _DEPTH_SLOPE, "warm": _DEPTH_SLOPE}
    parts = (power_law((_SIDE, _SIDE), slope, _TEXELS, 1.0, seed, name, field) for field, slope in slopes.items())
    return np.stack(list(parts), axis=-1)
