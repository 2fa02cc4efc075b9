"""A flat rectangle."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.kinds import Pair, Positive
from irsim.occluders.base import Facet, Opaque
from irsim.stage import Stage
from irsim.types import Floats


def rectangle(center: Floats, size: Floats, angle_deg: float = 0.0) -> Floats:
    """(4, 2) corners of a rectangle turned clockwise."""
    angle = np.radians(angle_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(size) / 2
    return np.asarray(np.asarray(center) + halves @ turn.T)


class Bar(Opaque):
    """A flat rectangle, given as the unmoved camera sees it: a screen, a wall, a strip of cloud."""

    center_px: Pair
    """[x, y] of its middle, px."""
    size_px: Annotated[tuple[Positive, Positive], Field(strict=False)]
    """[width, height], px."""
    angle_deg: float = 0.0
    """Turned clockwise by this, degrees."""

    def facets(self, stage: Stage) -> list[Facet]:
        corners = rectangle(np.asarray(self.center_px), np.asarray(self.size_px), self.angle_deg)
        return [(corners, self.temperature_k)]
