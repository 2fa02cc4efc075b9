"""A flat picture that stands in space, as any camera sees it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.geometry.silhouette import Grid
from irsim.types import Floats

SAMPLES = 2
"""Places on each axis of a grid's cell at which a picture is looked up: in the middles of its quarters. It is first
averaged over cells of just their size, so that it covers its area, spread by half of that size."""


@dataclass(frozen=True, eq=False)
class Billboard:
    """light (rows, cols, 2) float32: the share of each cell that it covers, and that share times its radiance."""

    light: Floats

    def fields(self, corners: Floats, grid: Grid) -> Floats:
        """(3, 2, rows, columns) of a grid: area, y moment and x moment of (cover, light) in its cells.

        corners  (4, 2) px: where the picture's outer corners are seen, clockwise from the top left one
        """
        rows, columns, _ = self.light.shape
        own = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], np.float32)
        places = (corners - grid.corner) * grid.fine * SAMPLES
        to_places = cv2.getPerspectiveTransform(own, places.astype(np.float32))
        size = SAMPLES * grid.cells[1], SAMPLES * grid.cells[0]
        edge = np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1)
        fewer = [max(1, min(length, round(float(seen)))) for length, seen in ((columns, edge[1]), (rows, edge[2]))]
        averaged = cv2.resize(self.light, fewer, interpolation=cv2.INTER_AREA)
        shrink = np.diag([columns / fewer[0], rows / fewer[1], 1.0])
        middles = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
        matrix = np.linalg.inv(middles) @ to_places @ shrink @ middles
        seen = cv2.warpPerspective(averaged, matrix, size, flags=cv2.INTER_LINEAR)
        quarters = seen.reshape(grid.cells[0], SAMPLES, grid.cells[1], SAMPLES, 2)
        upper, lower = quarters[:, 0], quarters[:, 1]
        whole, change = upper + lower, lower - upper
        # A quarter's own middle lies a quarter of the cell from the cell's.
        area = (whole[:, :, 0] + whole[:, :, 1]) / 4
        down, right = (change[:, :, 0] + change[:, :, 1]) / 16, (whole[:, :, 1] - whole[:, :, 0]) / 16
        return np.moveaxis(np.stack([area, down, right]).astype(np.float64), -1, 1)
