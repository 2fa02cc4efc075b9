"""What an occluder is, and how the camera sees it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irsim.geometry import Geometry
from irsim.kinds import Fraction, Kelvin, NamedKind, Positive
from irsim.shapes.polygon import outline
from irsim.shapes.silhouette import sprite, within_sight
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Box, Floats


@dataclass(frozen=True, eq=False)
class Sight:
    """How the camera sees what stands about it, in one frame.

    stage     of the scene: its geometry is that of the first, unmoved camera
    lens      the geometry of this frame: the first one's, zoomed
    rotation  (3, 3) first-camera vectors to the vectors of this frame's camera
    place     (3,) m, first camera frame: where the camera is now
    time      s since frame 0
    """

    stage: Stage
    lens: Geometry
    rotation: Floats
    place: Floats
    time: float = 0.0

    @classmethod
    def first(cls, stage: Stage) -> Sight:
        """What the unmoved camera sees at frame 0."""
        return cls(stage, stage.geometry, np.eye(3), np.zeros(3))

    def pixels(self, first: Floats, range_m: float) -> Floats:
        """(..., 2) px in this frame of what the unmoved camera sees at px `first` (..., 2), `range_m` away."""
        points = self.stage.geometry.directions(first)
        if self.place.any():
            points = points * range_m - self.place
        return self.lens.project(points @ np.asarray(self.rotation).T)


class Occluder(NamedKind):
    """Something between the camera and the targets behind it; it stands still in space."""

    range_m: Positive
    """Metres from where the camera first stands; it hides what is farther."""

    @abstractmethod
    def draw(self, sight: Sight) -> Sprite | None:
        """The occluder as the camera sees it; None where it cannot be seen."""


Facet = tuple[Floats, float]
"""A convex outline (n, 2), px of the unmoved camera, and its temperature, K."""


class Opaque(Occluder):
    """An occluder of flat, convex facets that hide what is behind them altogether."""

    temperature_k: Kelvin = 290.0
    """Kelvin."""
    emissivity: Fraction = 0.95

    @abstractmethod
    def facets(self, stage: Stage) -> Sequence[Facet]:
        """Its facets, the nearest first, as the unmoved camera sees them."""

    def draw(self, sight: Sight) -> Sprite | None:
        stage = sight.stage
        facets = self.facets(stage)
        outlines = [sight.pixels(points, self.range_m) for points, _ in facets]
        corners = np.concatenate(outlines)
        if not np.isfinite(corners).all():
            return None
        box = Box.from_edges(*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())
        window = within_sight(box, stage)
        if window is None:
            return None
        edges = [outline(points) for points in outlines]
        start, stop = (np.concatenate(ends) for ends in zip(*edges, strict=True))
        layer = np.repeat(np.arange(len(facets)), [len(points) for points in outlines])
        glow = stage.glow(np.array([kelvin for _, kelvin in facets]), self.emissivity)
        return sprite((start, stop, layer), glow, box, window, stage.psf_px, self.range_m)
