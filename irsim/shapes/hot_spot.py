"""A warm patch: a fire, a sun-heated rock, a vent."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.kinds import Fraction, Kelvin, Positive
from irsim.shapes.base import Shape, View
from irsim.shapes.polygon import outline
from irsim.shapes.silhouette import sprite, within_sight
from irsim.sprite import Sprite
from irsim.types import Box

_CORNERS = 20


class HotSpot(Shape):
    """A patch that looks the same from everywhere: an ellipse across the line of sight, whatever its attitude."""

    size_m: Annotated[tuple[Positive, Positive], Field(strict=False)] = (2.0, 1.2)
    """[width, height], m."""
    temperature_k: Kelvin = 330.0
    """Kelvin."""
    emissivity: Fraction = 0.95

    @property
    def stands_for(self) -> str:
        return "decoy"

    def draw(self, view: View) -> Sprite | None:
        stage = view.stage
        middle = stage.geometry.project(view.position)
        if not np.isfinite(middle).all():
            return None
        range_m = float(np.linalg.norm(view.position))
        angles = 2 * np.pi * np.arange(_CORNERS) / _CORNERS
        halves = np.array(self.size_m) / 2 / (range_m * stage.geometry.ifov_rad)
        corners = middle + halves * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        box = Box.from_edges(*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())
        window = within_sight(box, stage) if max(box.w, box.h) > max(stage.geometry.size) else box
        if window is None:
            return None
        start, stop = outline(corners)
        glow = np.atleast_1d(stage.glow(self.temperature_k, self.emissivity) * self.brightness(view))
        return sprite((start, stop, np.zeros(_CORNERS, dtype=np.int64)), glow, box, window, stage.psf_px, range_m)
