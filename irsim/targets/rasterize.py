"""Which of many triangles is seen: the nearest one at each point of a grid."""

from __future__ import annotations

import numpy as np

from irsim.targets.contours import Ints
from irsim.types import Floats


def nearest(pixels: Floats, depth: Floats, faces: Ints, size: tuple[int, int]) -> Ints:
    """(rows, columns) number of the triangle nearest at each point (column, row) of a grid, -1 where there is none.

    pixels (V, 2) in steps of the grid; depth (V,) m along the optical axis; faces (F, 3).
    """
    rows, columns = size
    corners = pixels[faces]
    low = np.maximum(np.ceil(corners.min(axis=1)), 0).astype(np.int64)
    high = np.minimum(np.floor(corners.max(axis=1)), [columns - 1, rows - 1]).astype(np.int64)
    wide, tall = np.maximum(high - low + 1, 0).T
    counts = wide * tall
    face = np.repeat(np.arange(len(faces)), counts)
    ordinal = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    x, y = low[face, 0] + ordinal % wide[face], low[face, 1] + ordinal // wide[face]
    (x0, y0), (x1, y1), (x2, y2) = (corners[face, corner].T for corner in range(3))
    area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    area = np.where(area == 0, np.inf, area)
    b = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
    c = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
    # 1/depth is linear in the picture.
    inverse = (1 / depth)[faces][face]
    near = inverse[:, 0] + b * (inverse[:, 1] - inverse[:, 0]) + c * (inverse[:, 2] - inverse[:, 0])
    inside = (b >= 0) & (c >= 0) & (b + c <= 1)
    cell, near, face = (y * columns + x)[inside], near[inside], face[inside]
    order = np.lexsort((near, cell))
    cell, face = cell[order], face[order]
    last = np.flatnonzero(np.append(cell[1:] != cell[:-1], True)) if len(cell) else np.zeros(0, dtype=np.int64)
    found = np.full(rows * columns, -1, dtype=np.int64)
    found[cell[last]] = face[last]
    return found.reshape(rows, columns)
