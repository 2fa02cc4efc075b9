"""The chart: which direction of the sky each pixel of one frame sees.

Backgrounds are painted on a map of the world in px of one IFOV: u grows with azimuth to the right,
v with elevation downwards, (0, 0) is the first pointing. Azimuth is scaled by the cosine of the
first elevation, so that the map is true to shape around the first pointing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from irsim.geometry.projection import Geometry, blocked_matmul
from irsim.types import Floats

NODES = 12
"""Nodes per axis. The map from pixel to (u, v) is smooth: a polynomial through 12 x 12 Chebyshev points
follows it within 0.05 px for fields of up to 60 degrees that stay 15 degrees from the zenith and the
nadir, where the map ends, and within 0.001 px for fields under 20 degrees (tests/test_backgrounds.py)."""

WIDEST_DEG = 60.0
"""Width of a field that the nodes are enough for."""

STEEPEST_DEG = 75.0
"""Elevation, up or down, that a field may come to for the same."""

PLACES = -np.cos((2 * np.arange(NODES) + 1) * np.pi / (2 * NODES))
"""(NODES,): Chebyshev's nodes, rising; -1 and 1 are the middles of the outermost pixels that the chart reaches to."""


def _chebyshev(places: Floats) -> Floats:
    """(..., NODES): the Chebyshev polynomials T_0, T_1, ... at places (...) in -1..1: T_n(x) = cos(n arccos x)."""
    return np.asarray(np.cos(np.arccos(places)[..., None] * np.arange(NODES)))


_COEFFICIENTS = (np.append(1.0, np.full(NODES - 1, 2.0)) / NODES * _chebyshev(PLACES)).T
"""(NODES, NODES): what each node's value adds to each polynomial's weight: T is orthogonal over its nodes."""


def _lagrange(places: Floats) -> Floats:
    """(..., NODES): the Lagrange basis of the nodes at places (...) in -1..1."""
    return np.asarray(_chebyshev(places) @ _COEFFICIENTS)


@lru_cache(maxsize=16)
def _basis(length: int, margin: int) -> Floats:
    """(length + 2 margin, NODES) float32: the basis at every pixel. Read only."""
    basis = _lagrange(np.linspace(-1.0, 1.0, length + 2 * margin)).astype(np.float32)
    basis.flags.writeable = False
    return basis


@lru_cache(maxsize=16)
def _rays(lens: Geometry, margin: int) -> Floats:
    """(NODES, NODES, 3) unit vectors in the camera frame: what the nodes see, rows first. Read only."""
    columns, rows = ((length - 1) / 2 + ((length - 1) / 2 + margin) * PLACES for length in lens.size)
    rays = lens.directions(np.stack(np.meshgrid(columns, rows), axis=-1))
    rays.flags.writeable = False
    return rays


@dataclass(frozen=True, eq=False)
class Chart:
    """The map at the nodes of the frame.

    uv      (2, NODES, NODES) float64, px: u and v, rows first
    margin  how far beyond the frame's edges the chart reaches, px
    """

    geometry: Geometry
    uv: Floats
    margin: int = 0

    @property
    def u(self) -> Floats:
        """(NODES, NODES) px, rows first."""
        return np.asarray(self.uv[0])

    @property
    def v(self) -> Floats:
        """(NODES, NODES) px, rows first."""
        return np.asarray(self.uv[1])

    @classmethod
    def at(cls, geometry: Geometry, world_rotation: Floats, margin: int = 0, lens: Geometry | None = None) -> Chart:
        """The chart of a camera whose world_rotation (3, 3) takes world to camera vectors.

        lens: the geometry that it sees with, where that is zoomed; the map's px stay those of `geometry`.
        """
        seen = _rays(lens or geometry, margin) @ world_rotation
        east, down, ahead = seen[..., 0], seen[..., 1], seen[..., 2]
        azimuth = unwrapped(np.arctan2(east, ahead))
        elevation = np.arctan2(-down, np.hypot(east, ahead))
        scale = 1 / geometry.ifov_rad
        u, v = azimuth * np.cos(geometry.elevation_rad) * scale, (geometry.elevation_rad - elevation) * scale
        return cls(geometry, np.stack([u, v]), margin)

    def moved(self, move: Floats) -> Floats:
        """(2, NODES, NODES): u and v at the nodes of the frame without margin, moved by (dx, dy) px within it."""
        middle = (np.array(self.geometry.size) - 1) / 2
        nodes = (move + np.outer(PLACES, middle)) / (middle + self.margin)
        across, along = _lagrange(nodes.T)
        return np.asarray(along @ self.uv @ across.T)

    def spread(self, nodes: Floats, every: int = 1) -> Floats:
        """(rows, cols) float32, each more by twice the margin, of a smooth quantity from its values at the nodes; of
        `every` so many rows and columns one."""
        across, along = (_basis(length, self.margin)[::every] for length in self.geometry.size)
        return blocked_matmul(along, blocked_matmul(nodes.astype(np.float32), across.T))

    def elevation_rad(self, v: Floats) -> Floats:
        """Elevation of a map coordinate v."""
        return self.geometry.elevation_rad - np.asarray(v) * self.geometry.ifov_rad

    @cached_property
    def rays(self) -> Floats:
        """(3, NODES, NODES): unit vectors right, down and level ahead of the first azimuth, that the nodes see."""
        geometry = self.geometry
        azimuth, elevation = self.u * geometry.ifov_rad / np.cos(geometry.elevation_rad), self.elevation_rad(self.v)
        level = np.cos(elevation)
        return np.stack([level * np.sin(azimuth), -np.sin(elevation), level * np.cos(azimuth)])

    @property
    def pixel_rad(self) -> float:
        """Side of the angle that the pixel in the frame's middle sees, rad."""
        at, slope = at_middle()
        width, height = (length / 2 - 0.5 + self.margin for length in self.geometry.size)
        across, along = at @ self.rays @ slope / width, slope @ self.rays @ at / height
        return math.sqrt(np.linalg.norm(np.cross(across, along)))


def unwrapped(azimuth: Floats) -> Floats:
    """Azimuths at the nodes, (NODES, NODES) rad, less the whole turns between neighbours."""
    if azimuth.max() - azimuth.min() <= np.pi:
        return azimuth
    return np.asarray(np.unwrap(np.unwrap(azimuth, axis=1), axis=0))


@lru_cache(maxsize=1)
def at_middle() -> tuple[Floats, Floats]:
    """Weights (NODES,) of the nodes' values that give a polynomial's value and slope at 0."""
    powers = np.vander(PLACES, NODES, increasing=True)
    inverse = np.linalg.inv(powers)
    return inverse[0], inverse[1]
