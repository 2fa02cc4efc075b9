"""A flat rectangle."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.config.quantities import Degrees, Pair, Positive
from irsim.geometry.context import SceneContext
from irsim.occluders.base import Facet, Opaque, given
from irsim.types import Box, Floats

Size = Annotated[tuple[Positive, Positive], Field(strict=False)]


def rectangle(center: tuple[float, float], size: tuple[float, float], angle_deg: float = 0.0) -> Floats:
    """(4, 2) corners of a rectangle turned clockwise."""
    angle = np.radians(angle_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(size) / 2
    return np.asarray(np.asarray(center) + halves @ turn.T)


class Bar(Opaque):
    """A flat rectangle, given as the unmoved camera sees it: a screen, a wall, a strip of cloud."""

    placing: ClassVar[tuple[str, ...]] = ("center_px", "size_px")

    center_px: Pair | None = None
    """[x, y] of its middle, px."""
    size_px: Size | None = None
    """[width, height], px."""
    angle_deg: Degrees = 0.0
    """Turned clockwise by this, degrees; placed by intent it stands upright."""

    def facets(self, context: SceneContext) -> list[Facet]:
        corners = rectangle(given(self.center_px), given(self.size_px), self.angle_deg)
        return [(corners, self.temperature_k)]

    def over(self, window: Box, share: float, context: SceneContext) -> Bar:
        return self.at(center_px=(window.cx, window.cy), size_px=(window.w, window.h), angle_deg=0.0)
