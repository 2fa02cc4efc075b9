"""Things that stand on the ground and reach up into the picture."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.kinds import Kelvin, KelvinSpread, NotNegative, Pair, Positive
from irsim.occluders.bar import Size, rectangle
from irsim.occluders.base import Facet, Opaque, given
from irsim.rng import stream
from irsim.stage import Stage
from irsim.types import Box, Floats

Panes = Annotated[int, Field(ge=0, le=20)]

_BELOW_PX = 2.0
"""What is placed by intent reaches this far below the picture's lower edge."""


def _foot(window: Box, stage: Stage) -> tuple[float, float]:
    """Where something stands that covers `window`: below the picture."""
    return (window.cx, max(stage.geometry.size[1] - 0.5, window.bottom) + _BELOW_PX)


class Pole(Opaque):
    """An upright pole, with a cross-arm if wanted."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "width_px")

    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """From foot to top, px."""
    width_px: Positive | None = None
    """Px."""
    arm_px: NotNegative = 0.0
    """Length of a cross-arm near its top, px; placed by intent it has none."""

    def facets(self, stage: Stage) -> list[Facet]:
        (x, y), high, wide = given(self.foot_px), given(self.height_px), given(self.width_px)
        facets = [(rectangle((x, y - high / 2), (wide, high)), self.temperature_k)]
        if self.arm_px > wide:
            facets.append((rectangle((x, y - 0.92 * high), (self.arm_px, max(0.5 * wide, 0.5))), self.temperature_k))
        return facets

    def over(self, window: Box, share: float, stage: Stage) -> Pole:
        x, y = _foot(window, stage)
        return self.at(foot_px=(x, y), height_px=y - window.top, width_px=window.w, arm_px=0.0)


class Building(Opaque):
    """A house front: a wall with rows of windows under a flat roof."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "size_px")

    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    size_px: Size | None = None
    """[width, height], px."""
    windows: Annotated[tuple[Panes, Panes], Field(strict=False)] = (4, 3)
    """[across, down] how many; [0, 0] is a bare wall."""
    window_k: Kelvin = 285.0
    """Temperature of the windows, kelvin: panes reflect the cold sky by day, shine by night."""
    roof_k: Kelvin = 280.0
    """Temperature of the roof's edge, kelvin."""

    def facets(self, stage: Stage) -> list[Facet]:
        (x, y), (wide, high) = given(self.foot_px), given(self.size_px)
        across, down = self.windows
        top = y - high
        facets: list[Facet] = []
        if across > 0 and down > 0:
            step_x, step_y = wide / (across + 0.4), 0.9 * high / (down + 0.3)
            pane = (0.55 * step_x, 0.55 * step_y)
            for row in range(down):
                for column in range(across):
                    middle = (x + (column - (across - 1) / 2) * step_x, top + 0.08 * high + (row + 0.6) * step_y)
                    facets.append((rectangle(middle, pane), self.window_k))
        facets.append((rectangle((x, top + 0.025 * high), (wide, 0.05 * high)), self.roof_k))
        facets.append((rectangle((x, y - high / 2), (wide, high)), self.temperature_k))
        return facets

    def over(self, window: Box, share: float, stage: Stage) -> Building:
        x, y = _foot(window, stage)
        return self.at(foot_px=(x, y), size_px=(window.w, y - window.top))


_LUMPS = 24
_CORNERS = 8
_CORE = 0.8
"""The crown's solid core, as a share of the crown."""


class Tree(Opaque):
    """A trunk and a crown of overlapping lumps of leaves, none like another."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "crown_px")

    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """From foot to top, px."""
    crown_px: Size | None = None
    """[width, height] of the crown, px."""
    trunk_k: Kelvin = 292.0
    """Temperature of the trunk, kelvin."""
    spread_k: KelvinSpread = 0.4
    """Standard deviation of the lumps' temperatures, kelvin: sunlit and shaded leaves."""

    def facets(self, stage: Stage) -> list[Facet]:
        (x, y), high, (wide, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        middle = np.array([x, y - high + tall / 2])
        halves = np.array([wide, tall]) / 2
        places, sizes, warmths = _lumps(stage.seed, self.name)
        lumps = [middle + halves * (place + size * _ring(_CORNERS)) for place, size in zip(places, sizes, strict=True)]
        facets: list[Facet] = [
            (lump, float(max(self.temperature_k + self.spread_k * warmth, 1.0)))
            for lump, warmth in zip(lumps, warmths, strict=True)
        ]
        facets.append((middle + halves * _CORE * _ring(3 * _CORNERS), self.temperature_k))
        thick = max(0.09 * wide, 0.8)
        trunk = np.array([[-0.35, middle[1] - y], [0.35, middle[1] - y], [0.6, 0], [-0.6, 0]]) * [thick, 1]
        facets.append((np.array([x, y]) + trunk, self.trunk_k))
        return facets

    def over(self, window: Box, share: float, stage: Stage) -> Tree:
        x, y = _foot(window, stage)
        # The core's ellipse goes through the window's upper corners (its polygon's edges lie a little inside),
        # and the crown is about as high as wide.
        inside = np.cos(np.pi / (3 * _CORNERS)) * _CORE
        wide = np.sqrt(2) * window.w / inside
        tall = max(np.sqrt(2) * window.h / inside, 0.9 * wide)
        top = window.top + inside * tall / 2 * np.sqrt(1 / 2) - tall / 2
        foot = max(y, top + 1.15 * tall)
        return self.at(foot_px=(x, foot), height_px=foot - top, crown_px=(wide, tall))


def _ring(corners: int) -> Floats:
    angles = 2 * np.pi * np.arange(corners) / corners
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@lru_cache(maxsize=64)
def _lumps(seed: int, name: str) -> tuple[Floats, Floats, Floats]:
    """Places (n, 2) and sizes (n,) of the lumps in halves of the crown, which they fill, and warmths (n,)."""
    rng = stream(seed, name, "crown")
    sizes = rng.uniform(0.15, 0.33, _LUMPS)
    angles = 2 * np.pi * (np.arange(_LUMPS) + rng.uniform(-0.3, 0.3, _LUMPS)) / _LUMPS
    inner = np.arange(_LUMPS) % 3 == 0
    reach = np.where(inner, rng.uniform(0.15, 0.5, _LUMPS), 1 - sizes)
    places = reach[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return places, sizes, rng.standard_normal(_LUMPS)
