"""Opaque occluders of flat facets: bar, pole and building."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Degrees, Kelvin, NotNegative, Pair, Positive
from irsim.geometry.context import SceneContext
from irsim.occluders.base import Facet, Opaque, Size, required
from irsim.types import Box, Floats

Panes = Annotated[int, Field(ge=0, le=20)]

_BELOW_PX = 2.0
"""Distance of the foot below the lower edge of the picture, px, for an occluder placed by `hides`; `standing_at` raises
the foot to ground at the same range."""


def rectangle(center: tuple[float, float], size: tuple[float, float], angle_deg: float = 0.0) -> Floats:
    """Return the corners (4, 2) of a rectangle rotated clockwise by `angle_deg`."""
    angle = np.radians(angle_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(size) / 2
    return np.asarray(np.asarray(center) + halves @ turn.T)


def foot_below_picture(window: Box, context: SceneContext) -> tuple[float, float]:
    """Return the foot (x, y) px, below the picture, of an object that covers `window`."""
    return (window.cx, max(context.geometry.size[1] - 0.5, window.bottom) + _BELOW_PX)


class Bar(Opaque):
    """A flat rectangle in the picture of the first camera, such as a screen, a wall or a strip of cloud."""

    placement_keys: ClassVar[tuple[str, ...]] = ("center_px", "size_px")

    center_px: Pair | None = None
    """[x, y] of the middle, px of the unmoved camera."""
    size_px: Size | None = None
    """[width, height], px of the unmoved camera."""
    angle_deg: Degrees = 0.0
    """Clockwise rotation, degrees; 0 with `hides`."""

    def facets(self, context: SceneContext) -> list[Facet]:
        corners = rectangle(required(self.center_px), required(self.size_px), self.angle_deg)
        return [(corners, self.temperature_k)]

    def covering(self, window: Box, density: float, context: SceneContext) -> Bar:
        return self.placed(center_px=(window.cx, window.cy), size_px=(window.w, window.h), angle_deg=0.0)


class Pole(Opaque):
    """An upright pole with an optional cross-arm."""

    placement_keys: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "width_px")
    slender: ClassVar[bool] = True

    switches: ClassVar[Switches] = {"arm": ("arm_px", 0.0)}

    foot_px: Pair | None = None
    """[x, y] of the middle of the foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """Height from foot to top, px of the unmoved camera."""
    width_px: Positive | None = None
    """Width, px of the unmoved camera."""
    arm_px: NotNegative = 0.0
    """Length of the cross-arm near the top, px of the unmoved camera; 0 with `hides`."""

    def facets(self, context: SceneContext) -> list[Facet]:
        (x, y), high, wide = required(self.foot_px), required(self.height_px), required(self.width_px)
        facets = [(rectangle((x, y - high / 2), (wide, high)), self.temperature_k)]
        if self.arm_px > wide:
            facets.append((rectangle((x, y - 0.92 * high), (self.arm_px, max(0.5 * wide, 0.5))), self.temperature_k))
        return facets

    def covering(self, window: Box, density: float, context: SceneContext) -> Pole:
        x, y = foot_below_picture(window, context)
        return self.placed(foot_px=(x, y), height_px=y - window.top, width_px=window.w, arm_px=0.0)

    def standing_at(self, y: float) -> Pole:
        x, foot_y = required(self.foot_px)
        shorter = foot_y - y
        return self.placed(foot_px=(x, y), height_px=required(self.height_px) - shorter) if shorter > 0 else self


class Building(Opaque):
    """A house front: a wall with rows of windows under a flat roof."""

    placement_keys: ClassVar[tuple[str, ...]] = ("foot_px", "size_px")

    switches: ClassVar[Switches] = {"windows": ("windows", (0, 0))}

    foot_px: Pair | None = None
    """[x, y] of the middle of the foot, px of the unmoved camera."""
    size_px: Size | None = None
    """[width, height], px of the unmoved camera."""
    windows: Annotated[tuple[Panes, Panes], Field(strict=False)] = (4, 3)
    """Number of windows [across, down]; [0, 0] is a bare wall."""
    window_k: Kelvin = 285.0
    """Apparent temperature of the windows, kelvin: panes reflect the cold sky by day and are warm by night."""
    roof_k: Kelvin = 280.0
    """Temperature of the roof's edge, kelvin."""

    def facets(self, context: SceneContext) -> list[Facet]:
        (x, y), (wide, high) = required(self.foot_px), required(self.size_px)
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

    def covering(self, window: Box, density: float, context: SceneContext) -> Building:
        x, y = foot_below_picture(window, context)
        return self.placed(foot_px=(x, y), size_px=(window.w, y - window.top))

    def standing_at(self, y: float) -> Building:
        (x, foot_y), (wide, high) = required(self.foot_px), required(self.size_px)
        shorter = foot_y - y
        return self.placed(foot_px=(x, y), size_px=(wide, high - shorter)) if shorter > 0 else self
