"""Things that stand on the ground and reach up into the picture."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from irsim.config.base import Switches
from irsim.config.quantities import Kelvin, NotNegative, Pair, Positive
from irsim.geometry.context import SceneContext
from irsim.occluders.bar import Size, rectangle
from irsim.occluders.base import Facet, Opaque, given
from irsim.types import Box

Panes = Annotated[int, Field(ge=0, le=20)]

_BELOW_PX = 2.0
"""What is placed by intent reaches this far below the picture's lower edge, unless it is `rooted` higher, on ground
that is as far away as it."""


def foot(window: Box, context: SceneContext) -> tuple[float, float]:
    """Where something stands that covers `window`: below the picture."""
    return (window.cx, max(context.geometry.size[1] - 0.5, window.bottom) + _BELOW_PX)


class Pole(Opaque):
    """An upright pole, with a cross-arm if wanted."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "width_px")
    slender: ClassVar[bool] = True

    switches: ClassVar[Switches] = {"arm": ("arm_px", 0.0)}

    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """From foot to top, px."""
    width_px: Positive | None = None
    """Px."""
    arm_px: NotNegative = 0.0
    """Length of a cross-arm near its top, px; placed by intent it has none."""

    def facets(self, context: SceneContext) -> list[Facet]:
        (x, y), high, wide = given(self.foot_px), given(self.height_px), given(self.width_px)
        facets = [(rectangle((x, y - high / 2), (wide, high)), self.temperature_k)]
        if self.arm_px > wide:
            facets.append((rectangle((x, y - 0.92 * high), (self.arm_px, max(0.5 * wide, 0.5))), self.temperature_k))
        return facets

    def over(self, window: Box, share: float, context: SceneContext) -> Pole:
        x, y = foot(window, context)
        return self.at(foot_px=(x, y), height_px=y - window.top, width_px=window.w, arm_px=0.0)

    def rooted(self, y: float) -> Pole:
        x, foot_y = given(self.foot_px)
        shorter = foot_y - y
        return self.at(foot_px=(x, y), height_px=given(self.height_px) - shorter) if shorter > 0 else self


class Building(Opaque):
    """A house front: a wall with rows of windows under a flat roof."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "size_px")

    switches: ClassVar[Switches] = {"windows": ("windows", (0, 0))}

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

    def facets(self, context: SceneContext) -> list[Facet]:
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

    def over(self, window: Box, share: float, context: SceneContext) -> Building:
        x, y = foot(window, context)
        return self.at(foot_px=(x, y), size_px=(window.w, y - window.top))

    def rooted(self, y: float) -> Building:
        (x, foot_y), (wide, high) = given(self.foot_px), given(self.size_px)
        shorter = foot_y - y
        return self.at(foot_px=(x, y), size_px=(wide, high - shorter)) if shorter > 0 else self
