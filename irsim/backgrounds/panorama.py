"""A picture of all that stands around the horizon."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.backgrounds.blur import softened
from irsim.backgrounds.chart import Chart
from irsim.backgrounds.texture import Tile
from irsim.geometry.projection import Geometry
from irsim.physics.psf import PSF, GaussianPSF
from irsim.types import Floats

WIDE = 2048
"""Least width of a panorama, px. Past its ends it is mirrored: seamless, and seldom looked at."""

AROUND = 256
"""How far above and below the first frame a panorama reaches, px; beyond, its last rows go on."""

ROOM = 32
"""What a thing's own rows are extended by, px: a Gaussian blur ends within."""


@dataclass(frozen=True)
class Sheet:
    """Where a panorama's pixels lie on the map: columns (w,), rows (h,), and the row of elevation 0, px."""

    columns: Floats
    rows: Floats
    horizon: float

    @classmethod
    def of(cls, geometry: Geometry) -> Sheet:
        """For cameras whose first pointing is that of `geometry`."""
        width, height = geometry.size
        half, reach = max(WIDE, 2 * width) // 2, height // 2 + AROUND
        return cls(
            np.arange(-half, half, dtype=np.float64),
            np.arange(-reach, reach, dtype=np.float64),
            geometry.elevation_rad / geometry.ifov_rad,
        )

    def between(self, top: float, bottom: float) -> Sheet:
        """The rows of it that lie between two rows of the map, with some room; never none."""
        first = int(np.clip(np.searchsorted(self.rows, top - ROOM), 0, len(self.rows) - 1))
        last = int(np.clip(np.searchsorted(self.rows, bottom + ROOM), first + 1, len(self.rows)))
        return Sheet(self.columns, self.rows[first:last], self.horizon)

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.rows), len(self.columns)


@dataclass(frozen=True, eq=False)
class Panorama(Tile):
    """A picture (`padded`, rows and columns of a sheet) whose top-left pixel lies at (left, top) of the map."""

    left: float
    top: float

    @classmethod
    def on(cls, sheet: Sheet, picture: Floats, psf: PSF) -> Panorama:
        """A picture on a sheet, as the lens shows it: with rows past its first and last for a lens with wings, whose
        light would else go on there for ever."""
        wings = 0 if isinstance(psf, GaussianPSF) else psf.support_px
        sharp = np.pad(np.asarray(picture, dtype=np.float32), [(wings, wings), (0, 0)], mode="edge")
        return cls(sheet.shape, softened(sharp, psf), (0.0, 0.0), float(sheet.columns[0]), float(sheet.rows[0]) - wings)

    def places(self, chart: Chart, shift_px: tuple[float, float]) -> tuple[Floats, Floats]:
        """(rows, cols) float32 each: column and row of the picture that each pixel sees."""
        columns = chart.spread(chart.u - shift_px[0] - self.left)
        rows = chart.spread(chart.v - shift_px[1] - self.top)
        return columns, np.clip(rows, 0, self.padded.shape[0] - 1)

    def at(self, columns: Floats, rows: Floats) -> Floats:
        """The picture at places between its pixels, linearly."""
        return np.asarray(cv2.remap(self.padded, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101))
