"""Pictures without targets, nor other small things that stand far out: what a background's texture is read off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from irsim.measure.boxes import BESIDE_PX, taken_by_targets
from irsim.measure.given import Values
from irsim.measure.picked import evenly
from irsim.types import Bools, Floats, Source

TEXTURE_PICTURES = 9
"""Pictures over the whole length whose texture is measured where one does not stand for all."""
_AROUND_PX = 3
"""How far from a target's place OpenCV looks for what may be there."""
_SMALL = 1 / 8
"""Share of the shorter side that is wider than a small thing."""
_USUAL = 0.98
"""Share of the pixels that stand out as little as texture does."""
_FAR = 6.0
"""Times as much, from which on a thing stands far out: of the shipped scenarios' pictures without their targets the
most that stands out is 1.4 to 5.0 times as much, hot targets before sky, sea and ground 8 to 140 times."""
_SMOOTH_PX = 1.0
"""Sigma of a blur that a thing shows through better than noise, as a point does."""
_MOST = 0.5
"""Share of a picture: where more of it is held, what is left tells of no background, and all is taken for it."""
_EVEN = 1e-6
"""What rounding makes of an even picture, as a share of its values."""


@dataclass(frozen=True, eq=False)
class Backdrop:
    """picture (rows, columns): what goes on behind what was `held` (rows, columns) by targets and `things` that stand
    far out, of which so many were found."""

    picture: Floats
    held: Bools
    things: int

    @property
    def seen(self) -> Floats:
        """Values of those pixels that nothing held, in a row."""
        return self.picture[~self.held]


def backdrop(picture: Floats, taken: Bools | None) -> Backdrop:
    """Of a picture (rows, columns) in which targets have `taken` some pixels (rows, columns), if that is known.

    Where they are, and then where small things stand far out of what is left, what is around them goes on (A. Telea,
    "An image inpainting technique based on the fast marching method", J. Graphics Tools 9, 2004).
    """
    held = np.zeros(picture.shape, np.bool_) if taken is None or taken.mean() > _MOST else taken
    rest = continued(picture, held)
    far, things = far_out(rest)
    return Backdrop(continued(picture, held | far), held | far, things)


def backdrops(source: Source, count: int) -> npt.NDArray[np.uint8]:
    """The 8-bit pictures (T, rows, columns) of so many frames over the whole length, as `backdrop` has them."""
    picked = evenly(len(source), count)
    return np.stack([_shown(source, int(k)) for k in picked])


def _shown(source: Source, index: int) -> npt.NDArray[np.uint8]:
    picture = np.asarray(source.frame(index, "display").image, np.uint8)
    found = backdrop(picture.astype(np.float64), taken_by_targets(source, index, index + 1))
    return np.asarray(continued(picture, found.held), np.uint8)


def continued(picture: Values, held: Bools) -> npt.NDArray[Any]:
    """A picture (rows, columns) in which what is around goes on where something is `held`; the picture given, not a
    copy, where nothing is."""
    if not held.any():
        return picture
    known = picture if picture.dtype == np.uint8 else picture.astype(np.float32)
    filled = cv2.inpaint(known, held.astype(np.uint8), _AROUND_PX, cv2.INPAINT_TELEA)
    return np.where(held, filled, picture).astype(picture.dtype)


def far_out(picture: Floats) -> tuple[Bools, int]:
    """Where small things, hot or cold, stand far out of a picture (rows, columns), and how many they are.

    What is smaller than a square shows in what an opening by it takes off, and cold things in what a closing adds
    (J. Serra, "Image analysis and mathematical morphology", 1982). Texture shows there as well, but alike all over.
    """
    smooth = cv2.GaussianBlur(np.asarray(picture, np.float32), (0, 0), _SMOOTH_PX)
    side = max(round(min(picture.shape) * _SMALL), 3)
    square = np.ones((side, side), np.uint8)
    found = np.zeros(picture.shape, np.uint8)
    least = _EVEN * float(np.abs(smooth).max())
    for hat in (cv2.MORPH_TOPHAT, cv2.MORPH_BLACKHAT):
        height = cv2.morphologyEx(smooth, hat, square)
        usual = max(float(np.quantile(height, _USUAL)), least)
        _, groups = cv2.connectedComponents((height > usual).astype(np.uint8))
        far = np.setdiff1d(groups[height > _FAR * usual], 0)
        found |= np.isin(groups, far).astype(np.uint8)
    grown = cv2.dilate(found, np.ones((2 * BESIDE_PX + 1,) * 2, np.uint8))
    return grown.astype(np.bool_), cv2.connectedComponents(grown)[0] - 1
