"""Extent of a small object inside a loose start box: the connected half-maximum region about its strongest pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from irsim.types import Box
from irtrack.features.background import Grid

COMPACT = 0.7
"""Share of the box's sides below which an object counts as smaller than its box."""
SHARE = 0.3
"""Share of the strongest pixel that the region reaches."""
OFF, OFF_PX = 0.25, 3.0
"""Largest distance on each axis of an object from the centre of its box, in sides and px: a hot part of a larger
target, such as an engine, lies farther off."""
LEAST = 2.0
"""Least side, px."""


@dataclass(frozen=True, slots=True)
class Extent:
    """Centre (x, y) and size (w, h), px, of the object to track; `is_compact`: it is smaller than its box."""

    center: tuple[float, float]
    size: tuple[float, float]
    is_compact: bool


def extent(picture: Grid, box: Box) -> Extent:
    """Return the extent of the object in a box, which is hotter or colder than its surroundings in the top-hat of the
    box's size (F. Meyer 1979); the whole box where the object fills it.

    The strongest pixel is searched with a weight that falls towards the box's edge. The region consists of the pixels
    above half of its height that are connected to it; its centre is weighted by the top-hat.
    """
    rows, columns = picture.shape
    margin = (int(box.w) + 3, int(box.h) + 3)
    x0, y0 = max(int(box.cx - box.w / 2) - margin[0], 0), max(int(box.cy - box.h / 2) - margin[1], 0)
    x1, y1 = min(int(box.cx + box.w / 2) + margin[0], columns), min(int(box.cy + box.h / 2) + margin[1], rows)
    part = cv2.GaussianBlur(picture[y0:y1, x0:x1], (0, 0), 0.6)
    kernel = np.ones((max(3, round(box.h) + 2), max(3, round(box.w) + 2)), np.uint8)
    y, x = np.ogrid[y0:y1, x0:x1]
    from_center = ((x - box.cx) / box.w) ** 2 + ((y - box.cy) / box.h) ** 2
    inside = (np.abs(x - box.cx) <= box.w / 2 + 0.5) & (np.abs(y - box.cy) <= box.h / 2 + 0.5)
    weight = np.exp(-2 * from_center) * inside
    hats = (cv2.morphologyEx(part, kind, kernel) for kind in (cv2.MORPH_TOPHAT, cv2.MORPH_BLACKHAT))
    hat = max(hats, key=lambda each: float((each * weight).max()))
    whole = Extent((box.cx, box.cy), (box.w, box.h), False)
    at = np.unravel_index(int(np.argmax(hat * weight)), hat.shape)
    if hat[at] <= 0:
        return whole
    mask = ((hat >= SHARE * hat[at]) & inside).astype(np.uint8)
    labels = cv2.connectedComponents(mask, connectivity=8)[1]
    own = labels == labels[at]
    own_rows, own_columns = np.flatnonzero(own.any(axis=1)), np.flatnonzero(own.any(axis=0))
    size = (float(np.ptp(own_columns)) + 1, float(np.ptp(own_rows)) + 1)
    size = (min(max(size[0], LEAST), box.w), min(max(size[1], LEAST), box.h))
    if size[0] >= COMPACT * box.w and size[1] >= COMPACT * box.h:
        return whole
    mass = hat * own
    center = (float((mass * x).sum() / mass.sum()), float((mass * y).sum() / mass.sum()))
    off = abs(center[0] - box.cx) > max(OFF * box.w, OFF_PX), abs(center[1] - box.cy) > max(OFF * box.h, OFF_PX)
    if any(off):
        return whole
    return Extent(center, size, True)
