"""Chart of one frame: map coordinates of the direction of each pixel.

Backgrounds are painted on a map of directions in px of one IFOV: u grows to the right with azimuth, v downwards as
elevation falls, and (0, 0) is the first pointing. Azimuth is scaled by the cosine of the elevation of the first
pointing, so the map is conformal around it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from irsim.geometry.projection import Geometry, blocked_matmul
from irsim.types import Floats

NODES = 12
"""Number of nodes per axis. A polynomial through 12 x 12 Chebyshev points follows the map from pixel to (u, v) within
0.05 px for fields of view of up to 60 degrees that stay 15 degrees from the zenith and the nadir, where the map is
singular, and within 0.001 px for those under 20 degrees (tests/irsim/backgrounds/test_chart_and_sky.py)."""

WIDEST_DEG = 60.0
"""Widest field of view for an accuracy of 0.05 px, degrees."""

STEEPEST_DEG = 75.0
"""Greatest elevation, up or down, of any part of the field of view for an accuracy of 0.05 px, degrees."""

PLACES = -np.cos((2 * np.arange(NODES) + 1) * np.pi / (2 * NODES))
"""(NODES,) Chebyshev nodes, rising; -1 and 1 are the centres of the outermost pixels of the chart."""


def _chebyshev(places: Floats) -> Floats:
    """Return the Chebyshev polynomials T_n(x) = cos(n arccos x), (..., NODES), at points (...) in -1..1."""
    return np.asarray(np.cos(np.arccos(places)[..., None] * np.arange(NODES)))


_COEFFICIENTS = (np.append(1.0, np.full(NODES - 1, 2.0)) / NODES * _chebyshev(PLACES)).T
"""(NODES, NODES) matrix from values at the nodes to coefficients of the Chebyshev polynomials, which are orthogonal
over the nodes."""


def _lagrange(places: Floats) -> Floats:
    """Return the Lagrange basis of the nodes, (..., NODES), at points (...) in -1..1."""
    return np.asarray(_chebyshev(places) @ _COEFFICIENTS)


@lru_cache(maxsize=16)
def _basis(length: int, margin: int) -> Floats:
    """Return the Lagrange basis at every pixel of an axis, (length + 2 margin, NODES) float32; read only."""
    basis = _lagrange(np.linspace(-1.0, 1.0, length + 2 * margin)).astype(np.float32)
    basis.flags.writeable = False
    return basis


@lru_cache(maxsize=16)
def _rays(lens: Geometry, margin: int) -> Floats:
    """Return the directions of the nodes, unit vectors in the camera frame, (NODES, NODES, 3), rows first; read
    only."""
    columns, rows = ((length - 1) / 2 + ((length - 1) / 2 + margin) * PLACES for length in lens.size)
    rays = lens.directions(np.stack(np.meshgrid(columns, rows), axis=-1))
    rays.flags.writeable = False
    return rays


@dataclass(frozen=True, eq=False)
class Chart:
    """Map coordinates at the nodes of a frame.

    uv      (2, NODES, NODES) float64, px: u and v, rows first
    margin  extent of the chart beyond the frame's edges, px
    """

    geometry: Geometry
    uv: Floats
    margin: int = 0

    @property
    def u(self) -> Floats:
        """Map coordinate u of the nodes, (NODES, NODES) px, rows first."""
        return np.asarray(self.uv[0])

    @property
    def v(self) -> Floats:
        """Map coordinate v of the nodes, (NODES, NODES) px, rows first."""
        return np.asarray(self.uv[1])

    @classmethod
    def at(cls, geometry: Geometry, world_rotation: Floats, margin: int = 0, lens: Geometry | None = None) -> Chart:
        """Return the chart of a camera with the rotation (3, 3) from world to camera vectors.

        lens: geometry of the zoomed camera; a px of the map is an IFOV of `geometry` in any case.
        """
        seen = _rays(lens or geometry, margin) @ world_rotation
        east, down, ahead = seen[..., 0], seen[..., 1], seen[..., 2]
        azimuth = unwrapped(np.arctan2(east, ahead))
        elevation = np.arctan2(-down, np.hypot(east, ahead))
        scale = 1 / geometry.ifov_rad
        u, v = azimuth * np.cos(geometry.elevation_rad) * scale, (geometry.elevation_rad - elevation) * scale
        return cls(geometry, np.stack([u, v]), margin)

    def shifted(self, shift: Floats) -> Floats:
        """Return u and v, (2, NODES, NODES), at the nodes of the frame without margin, shifted by (dx, dy) px."""
        middle = (np.array(self.geometry.size) - 1) / 2
        nodes = (shift + np.outer(PLACES, middle)) / (middle + self.margin)
        across, along = _lagrange(nodes.T)
        return np.asarray(along @ self.uv @ across.T)

    def at_pixels(self, nodes: Floats, every: int = 1) -> Floats:
        """Return a smooth quantity at the pixels, (rows, cols) float32 with the margins, from its values at the nodes;
        `every` is the stride in rows and columns."""
        across, along = (_basis(length, self.margin)[::every] for length in self.geometry.size)
        return blocked_matmul(along, blocked_matmul(nodes.astype(np.float32), across.T))

    def elevation_rad(self, v: Floats) -> Floats:
        """Return the elevation of a map coordinate v, rad."""
        return self.geometry.elevation_rad - np.asarray(v) * self.geometry.ifov_rad

    @cached_property
    def rays(self) -> Floats:
        """Directions of the nodes, (3, NODES, NODES): right, down and ahead, level along the azimuth of the first
        pointing."""
        geometry = self.geometry
        azimuth, elevation = self.u * geometry.ifov_rad / np.cos(geometry.elevation_rad), self.elevation_rad(self.v)
        level = np.cos(elevation)
        return np.stack([level * np.sin(azimuth), -np.sin(elevation), level * np.cos(azimuth)])

    @property
    def pixel_rad(self) -> float:
        """Angular side of the central pixel, rad."""
        at, slope = centre_weights()
        width, height = (length / 2 - 0.5 + self.margin for length in self.geometry.size)
        across, along = at @ self.rays @ slope / width, slope @ self.rays @ at / height
        return math.sqrt(np.linalg.norm(np.cross(across, along)))


def unwrapped(azimuth: Floats) -> Floats:
    """Return azimuths at the nodes, (NODES, NODES) rad, without jumps of a whole turn between neighbours."""
    if azimuth.max() - azimuth.min() <= np.pi:
        return azimuth
    return np.asarray(np.unwrap(np.unwrap(azimuth, axis=1), axis=0))


@lru_cache(maxsize=1)
def centre_weights() -> tuple[Floats, Floats]:
    """Return weights (NODES,) of the nodes' values that give the polynomial's value and slope at 0."""
    powers = np.vander(PLACES, NODES, increasing=True)
    inverse = np.linalg.inv(powers)
    return inverse[0], inverse[1]
