"""Panoramas painted around the first camera position, and their parallax when the camera moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import cv2
import numpy as np

from irsim.backgrounds.base import Place, ViewDirection
from irsim.backgrounds.chart import Chart, unwrapped
from irsim.backgrounds.texture import DriftingTextures, PeriodicTexture, blurred
from irsim.geometry.projection import Geometry
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats

WIDE = 2048
"""Least width of a panorama, px. Past its ends it is mirrored, which leaves no seam."""

VERTICAL_MARGIN = 256
"""Extent of a panorama above and below the first frame, px; beyond it, its outermost rows are repeated."""

ROOM = 32
"""Number of rows added above and below an object, in which its Gaussian blur ends."""


@dataclass(frozen=True)
class PanoramaGrid:
    """Map coordinates of a panorama's pixels: columns (w,), rows (h,), and the row of elevation 0, px."""

    columns: Floats
    rows: Floats
    horizon: float

    @classmethod
    def of(cls, geometry: Geometry) -> PanoramaGrid:
        """Return the grid for cameras with the first pointing of `geometry`."""
        width, height = geometry.size
        half, reach = max(WIDE, 2 * width) // 2, height // 2 + VERTICAL_MARGIN
        return cls(
            np.arange(-half, half, dtype=np.float64),
            np.arange(-reach, reach, dtype=np.float64),
            geometry.elevation_rad / geometry.ifov_rad,
        )

    def between(self, top: float, bottom: float) -> PanoramaGrid:
        """Return the grid of the rows between two map rows, with ROOM more above and below; it has at least one row."""
        first = int(np.clip(np.searchsorted(self.rows, top - ROOM), 0, len(self.rows) - 1))
        last = int(np.clip(np.searchsorted(self.rows, bottom + ROOM), first + 1, len(self.rows)))
        return PanoramaGrid(self.columns, self.rows[first:last], self.horizon)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.rows), len(self.columns)


@dataclass(frozen=True, eq=False)
class Panorama(PeriodicTexture):
    """Picture (`padded`, rows and columns of a grid) whose top-left pixel lies at (left, top) of the map."""

    left: float
    top: float

    @classmethod
    def on(cls, grid: PanoramaGrid, picture: Floats, psf: PSF) -> Panorama:
        """Return a picture on a grid, blurred by the lens.

        For a PSF with wings, rows are added above and below. Otherwise the outermost rows, which are repeated, would
        contain light of the wings.
        """
        wings = 0 if isinstance(psf, GaussianPSF) else psf.support_px
        sharp = np.pad(np.asarray(picture, dtype=np.float32), [(wings, wings), (0, 0)], mode="edge")
        return cls(grid.shape, blurred(sharp, psf), (0.0, 0.0), float(grid.columns[0]), float(grid.rows[0]) - wings)

    def places(self, chart: Chart, shift_px: tuple[float, float]) -> tuple[Floats, Floats]:
        """Return the picture's column and row at each pixel, (rows, cols) float32 each."""
        columns = chart.at_pixels(chart.u - shift_px[0] - self.left)
        rows = chart.at_pixels(chart.v - shift_px[1] - self.top)
        return columns, np.clip(rows, 0, self.padded.shape[0] - 1)

    def at(self, columns: Floats, rows: Floats) -> Floats:
        """Return the picture at positions between its pixels, by linear interpolation."""
        return np.asarray(cv2.remap(self.padded, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101))


class ParallaxSurface(Protocol):
    """Closed surface around the first camera position, seen from within only."""

    @property
    def range_m(self) -> float: ...

    def from_origin(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        """Return the change of azimuth, and the elevation, of surface points as seen from the first camera position,
        rad.

        azimuth, elevation: of these points as seen from the camera position `place` within the surface, rad.
        """
        ...

    def contains(self, place: Place) -> bool:
        """Return True if a camera position is within the surface."""
        ...


@dataclass(frozen=True)
class Cylinder:
    """Vertical `ParallaxSurface` of radius R = `range_m`, for trees and buildings.

    A camera at (x, y, z) m right, below and ahead of the first position looks along azimuth a and elevation e. Its ray
    passes the cylinder's axis at the distance p = x cos a - z sin a and meets the cylinder at the horizontal distance
    rho = sqrt(R^2 - p^2) - x sin a - z cos a. From the first position this point is seen at the azimuth a + asin(p/R)
    and at the elevation with the tangent (rho tan e - y) / R.
    """

    range_m: float

    def from_origin(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        (x, y, z), range_m = place, self.range_m
        off = np.clip((x * np.cos(azimuth) - z * np.sin(azimuth)) / range_m, -1, 1)
        along = range_m * np.sqrt(1 - off**2) - x * np.sin(azimuth) - z * np.cos(azimuth)
        return np.arcsin(off), np.arctan((along * np.tan(elevation) - y) / range_m)

    def contains(self, place: Place) -> bool:
        right, _, ahead = place
        return math.hypot(right, ahead) < self.range_m


@dataclass(frozen=True)
class Sphere:
    """Spherical `ParallaxSurface` of radius R = `range_m`, for clouds.

    A ray from the camera position c along the unit vector r leaves the sphere after t = sqrt((c r)^2 + R^2 - c^2) - c
    r; from the first position this point is seen in the direction of c + t r. Vectors are resolved to the right of the
    ray's azimuth, along it, and down.
    """

    range_m: float

    def from_origin(self, azimuth: Floats, elevation: Floats, place: Place) -> tuple[Floats, Floats]:
        (x, y, z), range_m = place, self.range_m
        right, along = x * np.cos(azimuth) - z * np.sin(azimuth), x * np.sin(azimuth) + z * np.cos(azimuth)
        dot = along * np.cos(elevation) - y * np.sin(elevation)
        t = np.sqrt(np.maximum(dot**2 + range_m**2 - (x**2 + y**2 + z**2), 0)) - dot
        ahead, up = along + t * np.cos(elevation), t * np.sin(elevation) - y
        return np.arctan2(right, ahead), np.arctan2(up, np.hypot(right, ahead))

    def contains(self, place: Place) -> bool:
        return math.hypot(*place) < self.range_m


def from_origin(view_direction: ViewDirection, surface: ParallaxSurface) -> ViewDirection:
    """Return the view, from the first camera position, of the points of a surface that a given view shows."""
    key = None if view_direction.key is None else from_origin(view_direction.key, surface)
    if not any(view_direction.place):
        return view_direction if key is view_direction.key else replace(view_direction, key=key)
    chart = view_direction.chart
    unit = chart.geometry.ifov_rad
    squeeze = np.cos(chart.geometry.elevation_rad)
    azimuth, elevation = chart.u * unit / squeeze, chart.elevation_rad(chart.v)
    turn, first_elevation = surface.from_origin(azimuth, elevation, view_direction.place)
    u = unwrapped(azimuth + turn) * squeeze / unit
    v = (chart.geometry.elevation_rad - first_elevation) / unit
    return replace(view_direction, chart=replace(chart, uv=np.stack([u, v])), key=key)


def is_outside(view_direction: ViewDirection, surface: ParallaxSurface) -> bool:
    """Return True if the camera has passed through a surface, which is then not drawn."""
    places = [view_direction.place] if view_direction.key is None else [view_direction.place, view_direction.key.place]
    return not all(map(surface.contains, places))


def transparent(view_direction: ViewDirection) -> tuple[Floats, Floats]:
    """Return transmittance 1 and emission 0, (rows, cols) float32."""
    columns, rows = view_direction.chart.geometry.size
    return np.ones((rows, columns), np.float32), np.zeros((rows, columns), np.float32)


@dataclass(frozen=True, eq=False)
class PanoramicLayer:
    """Layer painted on a surface around the first camera position, with parallax for a moving camera."""

    name: str
    surface: ParallaxSurface
    textures: DriftingTextures

    @property
    def range_m(self) -> float:
        return self.surface.range_m

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        if is_outside(view_direction, self.surface):
            return transparent(view_direction)
        transmittance, emission = self.textures.sample(from_origin(view_direction, self.surface))
        return transmittance, emission
