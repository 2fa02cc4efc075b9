"""The chart: which direction of the sky each pixel of one frame sees.

Backgrounds are painted on a map of the world in px of one IFOV: u grows with azimuth to the right,
v with elevation downwards, (0, 0) is the first pointing. Azimuth is scaled by the cosine of the
first elevation, so that the map is true to shape around the first pointing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from irsim.geometry import Geometry
from irsim.types import Floats

NODES = 8
"""Nodes per axis. The map from pixel to (u, v) is smooth: a polynomial through 8 x 8 Chebyshev
points follows it within 0.01 px for fields up to 50 degrees (tests/test_backgrounds.py)."""


@lru_cache(maxsize=16)
def _basis(length: int) -> tuple[Floats, Floats]:
    """Chebyshev nodes (NODES,) in px over 0 .. length-1, and their Lagrange basis (length, NODES)."""
    angles = (2 * np.arange(NODES) + 1) * np.pi / (2 * NODES)
    nodes = (length - 1) / 2 * (1 - np.cos(angles))
    pixels = np.arange(length)[:, None]
    basis = np.ones((length, NODES))
    for j in range(NODES):
        for i in range(NODES):
            if i != j:
                basis[:, [j]] *= (pixels - nodes[i]) / (nodes[j] - nodes[i])
    return nodes, basis.astype(np.float32)


def _product(left: Floats, right: Floats) -> Floats:
    """left @ right, float32, on one thread."""
    return np.asarray(cv2.gemm(left, right, 1.0, None, 0.0))  # type: ignore[call-overload]  # None: nothing to add


@dataclass(frozen=True, eq=False)
class Chart:
    """u and v (px) at the nodes of the frame, each (NODES, NODES) float64, rows first."""

    geometry: Geometry
    u: Floats
    v: Floats

    @classmethod
    def at(cls, geometry: Geometry, world_rotation: Floats) -> Chart:
        """The chart of a camera whose world_rotation (3, 3) takes world to camera vectors."""
        columns, rows = (_basis(length)[0] for length in geometry.size)
        pixels = np.stack(np.meshgrid(columns, rows), axis=-1)
        east, down, ahead = np.moveaxis(geometry.directions(pixels) @ world_rotation, -1, 0)
        azimuth = np.unwrap(np.unwrap(np.arctan2(east, ahead), axis=1), axis=0)
        elevation = np.arctan2(-down, np.hypot(east, ahead))
        scale = 1 / geometry.ifov_rad
        return cls(
            geometry,
            azimuth * np.cos(geometry.elevation_rad) * scale,
            (geometry.elevation_rad - elevation) * scale,
        )

    def spread(self, nodes: Floats) -> Floats:
        """(rows, cols) float32 of a smooth quantity from its values at the nodes (NODES, NODES)."""
        across, along = (_basis(length)[1] for length in self.geometry.size)
        # Not by numpy's product: the BLAS behind it starts threads, which wait on each other for
        # milliseconds wherever several processes share the cores.
        return _product(along, _product(nodes.astype(np.float32), np.ascontiguousarray(across.T)))

    def elevation_rad(self, v: Floats) -> Floats:
        """Elevation of a map coordinate v."""
        return self.geometry.elevation_rad - np.asarray(v) * self.geometry.ifov_rad
