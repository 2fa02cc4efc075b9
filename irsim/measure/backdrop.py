"""Pictures of a source without its targets: what a background's texture is read off."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.measure.picked import evenly
from irsim.measure.region import taken_by_targets
from irsim.types import Source

_AROUND_PX = 3
"""How far from a target's place OpenCV looks for what may be there."""


def backdrops(source: Source, count: int) -> npt.NDArray[np.uint8]:
    """The 8-bit pictures (T, rows, columns) of so many frames over the whole length; where truth has a target, what is
    around it goes on (Telea 2004, "An image inpainting technique based on the fast marching method")."""
    picked = evenly(len(source), count)
    return np.stack([_backdrop(source, int(k)) for k in picked])


def _backdrop(source: Source, index: int) -> npt.NDArray[np.uint8]:
    picture = np.asarray(source.frame(index, "display").image, np.uint8)
    taken = taken_by_targets(source, index, index + 1)
    if taken is None or not taken.any():
        return picture
    return np.asarray(cv2.inpaint(picture, taken.astype(np.uint8), _AROUND_PX, cv2.INPAINT_TELEA), np.uint8)
