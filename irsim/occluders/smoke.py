"""A cloud of smoke: partly transparent, growing, drifting, and gone in the end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, NotNegative, Number, Pair
from irsim.geometry.context import SceneContext
from irsim.geometry.pose import CameraPose
from irsim.geometry.silhouette import clip_to_view
from irsim.geometry.sprite import Sprite
from irsim.occluders.bar import Size
from irsim.occluders.base import Occluder, given
from irsim.occluders.billows import OUTERMOST, lumps, thickened, torn
from irsim.rng import stream
from irsim.types import Box, Floats

_PUFFS = 24
_REACH = 2.2
"""How far out, in halves of its size, it is drawn: what is beyond is thinner than a thousandth."""
_YOUNG = 0.35
"""Size at its beginning, as a share of the full one."""
_DENSEST = 0.999
"""Opacity at most: what kept back all light would have no end of optical depth."""
_RISES = 0.5
"""Placed by whom it hides, smoke that billows is so much as high as wide at least: by eye."""


class Smoke(Occluder):
    """Smoke that hides by its optical depth: dense in the middle, in rolling puffs at its edge."""

    placing: ClassVar[tuple[str, ...]] = ("center_px", "size_px")
    thins: ClassVar[bool] = True
    overrules: ClassVar[Mapping[str, tuple[str, ...]]] = {"hides": ("opacity", "begins_frame", "lasts_frames")}

    switches: ClassVar[Switches] = {
        "drift": ("drift_px_s", (0.0, 0.0)),
        "billows": ("billows", 0.0),
        "texture": ("spread_k", 0.0),
    }

    center_px: Pair | None = None
    """[x, y] of its middle when it is full grown, px of the unmoved camera."""
    size_px: Size | None = None
    """[width, height] of its dense part when it is full grown, px."""
    opacity: Annotated[float, Field(ge=0, le=_DENSEST)] = 0.9
    """Share of the light behind it that its dense part keeps back, when it is full grown; of smoke that
    `hides` somebody, `fraction` says it."""
    temperature_k: Kelvin = 288.0
    """Kelvin: it emits as much as it keeps back."""
    billows: Fraction = 1.0
    """How far billows tear its edge and make it uneven: 0 is a smooth cloud. Placed by whom it hides it rises above
    it, about half as high as wide at least."""
    spread_k: KelvinSpread = 0.5
    """Standard deviation of its temperature from billow to billow, kelvin."""
    begins_frame: Number | None = None
    """Frame at which it begins to grow; it is there from the first where not given."""
    grow_frames: NotNegative = 15.0
    """Time it takes to grow, frames."""
    lasts_frames: NotNegative | None = None
    """Time from full grown until it begins to fade, frames; it never does where not given."""
    fade_frames: NotNegative = 30.0
    """Time it takes to fade, frames."""
    drift_px_s: Pair = (0.0, 0.0)
    """[right, down] wind, px a second of the unmoved camera."""

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
        (x, y), (wide, tall) = given(self.center_px) + drift, given(self.size_px)
        scale = _YOUNG + (1 - _YOUNG) * grown + 0.3 * (1 - left)
        # A window's two axes, as this frame sees them: enough for something without edges.
        around = np.array([[x, y], [x + 1, y], [x, y + 1]])
        middle, right, down = pose.pixels(around, self.range_m)
        zoom = np.array([np.hypot(*(right - middle)), np.hypot(*(down - middle))])
        if not np.isfinite(middle).all():
            return None
        halves = zoom * np.array([wide, tall]) / 2 * scale
        blurred = np.hypot(halves, pose.zoomed.psf_px)
        reach = (_REACH + self.billows * OUTERMOST) * blurred
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
        emission = alpha * context.glow(kelvin, 1.0)
        center = (float(middle[0]), float(middle[1]))
        away_m = pose.distance_m(Box(float(x), float(y), 0.0, 0.0), self.range_m)
        return Sprite(x0, y0, alpha, alpha, emission, center, center, box, away_m, float(alpha.sum()))

    def _fields(self, u: Floats, v: Floats, halves: Floats, seed: int, time: float) -> tuple[Floats, Floats | float]:
        """Optical depth, in that of its dense part, and temperature, K, at places in `halves` of its size, px."""
        if self.billows == 0 and self.spread_k == 0:
            return _profile(u[None, :], v[:, None], seed, self.name, time), self.temperature_k
        across, down = halves / halves.min()
        pushed, thick, warm = np.moveaxis(lumps(u * across, v * down, time, seed, self.name), -1, 0)
        kelvin = np.maximum(self.temperature_k + self.spread_k * warm, 1.0)
        if self.billows == 0:
            return _profile(u[None, :], v[:, None], seed, self.name, time), kelvin
        profile = _profile(*torn(u, v, pushed, self.billows), seed, self.name, time)
        return profile * thickened(u, v, thick, self.billows), kelvin

    def over(self, window: Box, share: float, context: SceneContext) -> Smoke:
        first, last = given(self.frames)
        drift = np.asarray(self.drift_px_s) * (last - first) / 2 / context.rate_hz
        # The dense part is an ellipse through the window's corners, with room for its way on the wind.
        size = (math.sqrt(2) * (window.w + 2 * abs(drift[0])), math.sqrt(2) * (window.h + 2 * abs(drift[1])))
        # One that billows rises: higher, it still goes through the window's lower corners.
        high = max(size[1], _RISES * size[0] if self.billows else 0.0)
        center = (window.cx - drift[0], window.cy - drift[1] - (high - size[1]) / math.sqrt(8))
        return self.at(
            center_px=center, size_px=(size[0], high), opacity=_DENSEST * share,
            begins_frame=first - self.grow_frames, lasts_frames=float(last - first),
        )  # fmt: skip


def _ease(age: float, span: float) -> float:
    """0 before, 1 after `span`, smoothly between."""
    if span <= 0 or age >= span:
        return float(age >= 0)
    part = max(age / span, 0.0)
    return part * part * (3 - 2 * part)


def _profile(u: Floats, v: Floats, seed: int, name: str, time: float) -> Floats:
    """(rows, columns) optical depth: 1 or more within the unit circle of (u, v), uneven about its edge.

    u, v: (1, columns) and (rows, 1), or (rows, columns) each.
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
    """Places (n, 2) and sizes (n,) of puffs in halves of the cloud, and how fast they roll (n,), rad/s."""
    rng = stream(seed, name, "puffs")
    angles = 2 * np.pi * (np.arange(_PUFFS) + rng.uniform(-0.4, 0.4, _PUFFS)) / _PUFFS
    sizes = rng.uniform(0.15, 0.4, _PUFFS)
    reach = rng.uniform(0.6, 1.35, _PUFFS)
    places = reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return places, sizes, rng.uniform(0.5, 1.5, _PUFFS) * rng.choice([-1, 1], _PUFFS)
