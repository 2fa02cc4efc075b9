"""Things that hide targets: opaque, at a range, fixed in angle."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.kinds import Family, Fraction, Kelvin, NamedKind, Pair, Positive
from irsim.radiometry import radiance
from irsim.shapes.polygon import outline
from irsim.shapes.silhouette import sprite, within_sight
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Box, Floats


class Occluder(NamedKind):
    """Something between the camera and the targets behind it."""

    range_m: Positive
    """Metres from the camera; it hides what is farther."""

    @abstractmethod
    def draw(self, rotation: Floats, stage: Stage) -> Sprite | None:
        """The occluder as seen by a camera turned by `rotation` (3, 3) (first camera to camera)."""


class Bar(Occluder):
    """A flat rectangle, given as the unmoved camera sees it: a pole, a wall, a strip of cloud."""

    center_px: Pair
    """[x, y] of its middle, px."""
    size_px: Annotated[tuple[Positive, Positive], Field(strict=False)]
    """[width, height], px."""
    angle_deg: float = 0.0
    """Turned clockwise by this, degrees."""
    temperature_k: Kelvin = 290.0
    """Kelvin."""
    emissivity: Fraction = 0.95

    def draw(self, rotation: Floats, stage: Stage) -> Sprite | None:
        geometry = stage.geometry
        angle = np.radians(self.angle_deg)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(self.size_px) / 2
        first = geometry.directions(np.asarray(self.center_px) + halves @ turn.T)
        corners = geometry.project(first @ np.asarray(rotation).T)
        if not np.isfinite(corners).all():
            return None
        box = Box.from_edges(*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())
        window = within_sight(box, stage)
        if window is None:
            return None
        start, stop = outline(corners)
        glow = np.array([self.emissivity * radiance(stage.band, self.temperature_k)])
        edges = (start, stop, np.zeros(4, dtype=np.int64))
        return sprite(edges, glow, box, window, stage.psf_px, self.range_m)


OCCLUDERS = Family("occluder", Occluder, {"bar": Bar})
