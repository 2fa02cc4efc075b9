"""Part of a frame, resampled so that a target of a given size has a standard size.

Windows of particles are sampled from it: each costs the same, whatever the target's size, and pixels of a large target
are averaged, not left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats, Image

Picture = npt.NDArray[np.float32]

MOST_SIDE = 1024
"""Largest side of a resampled part, px: beyond it, the part is cut."""


@dataclass(frozen=True, slots=True, eq=False)
class ScaledRegion:
    """Resampled part of a frame.

    pixels  (rows, columns), at least 2 of each, counts; beyond the frame its edge pixels are repeated
    left    column and row (2,) of its first pixel in the frame
    step    (2,) frame pixels per pixel, x and y
    """

    pixels: Picture
    left: Floats
    step: Floats

    @classmethod
    def of(cls, image: Image, low: Floats, high: Floats, step: Floats) -> ScaledRegion:
        """Return the part from `low` to `high` (2,) px, with about `step` (2,) frame pixels per pixel.

        Averages over the area of a pixel where both axes shrink, else interpolates linearly.
        """
        reach = MOST_SIDE * np.maximum(step, 1.0)
        middle = (low + high) / 2
        first = [floor(x) for x in np.maximum(low, middle - reach / 2).tolist()]
        last = [ceil(x) + 1 for x in np.minimum(high, middle + reach / 2).tolist()]
        part = _cut(image, first[0], first[1], last[0], last[1])
        size = [max(2, round((last[i] - first[i]) / float(step[i]))) for i in range(2)]
        averaged = size[0] <= part.shape[1] and size[1] <= part.shape[0]
        method = cv2.INTER_AREA if averaged else cv2.INTER_LINEAR
        pixels = cv2.resize(part.astype(np.float32), (size[0], size[1]), interpolation=method)
        spans = np.array([part.shape[1], part.shape[0]], dtype=np.float64)
        return cls(np.ascontiguousarray(pixels), np.array(first, dtype=np.float64), spans / size)

    def places(self, centers: Floats) -> Floats:
        """Return positions (N, 2) in the part, pixels, of centres (N, 2) px in the frame."""
        placed: Floats = (centers - self.left + 0.5) / self.step - 0.5
        return placed

    def centers(self, places: Floats) -> Floats:
        """Return centres (N, 2) px in the frame of positions (N, 2) in the part."""
        back: Floats = (places + 0.5) * self.step - 0.5 + self.left
        return back


def _cut(image: Image, left: int, top: int, right: int, bottom: int) -> Image:
    """Return the pixels [top:bottom, left:right]; beyond the frame its edge pixels are repeated."""
    rows, columns = image.shape
    if left >= 0 and top >= 0 and right <= columns and bottom <= rows:
        return image[top:bottom, left:right]
    y = np.clip(np.arange(top, bottom), 0, rows - 1)
    x = np.clip(np.arange(left, right), 0, columns - 1)
    part: Image = image[y[:, None], x]
    return part
