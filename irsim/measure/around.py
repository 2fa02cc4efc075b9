"""What is around a pixel: the 5 x 5 px about it, beyond the edge of the picture too."""

from __future__ import annotations

import cv2
import numpy as np

from irsim.types import Bools, Floats

REACH = 2
"""How far that reaches, px."""


def around(picture: Floats) -> Floats:
    """Median of the 5 x 5 px around each pixel; beyond its edges the picture goes on as `_continued` has it."""
    return np.asarray(cv2.medianBlur(_continued(picture), 2 * REACH + 1)[REACH:-REACH, REACH:-REACH])


def alone(picture: Floats, usually: Floats, others: Floats | None = None) -> Bools:
    """Whether a pixel (rows, columns) lies above all on the border of the 5 x 5 px around it.

    By at least half of what it lies above what is `usually` there, their median. `others` is what the pixels of the
    border have, where that is not the picture.
    """
    border = np.pad(np.zeros((2 * REACH - 1,) * 2, np.uint8), 1, constant_values=1)
    seen = _continued(picture if others is None else others)
    highest = cv2.dilate(seen, border)[REACH:-REACH, REACH:-REACH]
    found: Bools = picture - highest > (picture - usually) / 2
    return found


def _continued(picture: Floats) -> Floats:
    """A picture (rows, columns) with 2 px more on every side, each as far above its edge as the picture is below there.

    So a slope goes on, and its end at the edge is no summit. What lies at the edge is the median of 5 px along it: a
    bad pixel there does not go on. At the corners, the corner's own goes on.
    """
    from scipy.ndimage import median_filter

    rows, columns = picture.shape
    whole = np.empty((rows + 2 * REACH, columns + 2 * REACH), np.float32)
    whole[REACH:-REACH, REACH:-REACH] = picture
    for turn in range(4):
        side, inside = np.rot90(whole, turn), np.rot90(picture, turn)
        edge = median_filter(inside[0].astype(np.float32), 2 * REACH + 1, mode="mirror")
        side[:REACH, REACH:-REACH] = 2 * edge - inside[[min(k, len(inside) - 1) for k in range(REACH, 0, -1)]]
        side[:REACH, :REACH] = edge[0]
    return whole
