"""Pictures of the background, without targets and other small outlying objects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from irsim.calibration.bad_pixels import remove_specks
from irsim.calibration.selection import BOX_MARGIN_PX, Boxes, box_mask, target_mask
from irsim.calibration.statistics import Values, evenly
from irsim.types import Bools, Floats, Source

TEXTURE_PICTURES = 9
"""Number of pictures, evenly spaced over the recording, on which texture is measured."""
_MEDIAN_FRAMES = 48
_CLIP = 4.0
"""Distance from a pixel's median, sigmas, at which its values are clipped before the mean."""
_SMALL = 1 / 8
"""Largest width of a small object, as a fraction of the picture's shorter side."""
_USUAL = 0.98
_FAR = 6.0
"""Ratio of an object's height to the 0.98 quantile of heights beyond which it is an outlier. Backgrounds of the shipped
scenarios reach 5.0, hot targets 8 to 140."""


@dataclass(frozen=True, eq=False)
class Background:
    """Background picture (rows, columns), mask of pixels filled in from around, and number of small objects."""

    picture: Floats
    filled: Bools
    objects: int

    @property
    def seen(self) -> Floats:
        """Values of the pixels that were measured, not filled in, (N,)."""
        return self.picture[~self.filled]


def background(picture: Floats, taken: Bools | None = None) -> Background:
    """Return the background of a picture (rows, columns), of which `taken` masks the targets.

    The targets, then small outlying objects, are filled in from around (A. Telea, J. Graphics Tools 9, 2004). A mask of
    more than half of the picture is ignored.
    """
    held = np.zeros(picture.shape, np.bool_) if taken is None or taken.mean() > 0.5 else taken
    small, objects = small_objects(fill(picture, held))
    return Background(fill(picture, held | small), held | small, objects)


def background_pictures(source: Source, count: int) -> npt.NDArray[np.uint8]:
    """Return the backgrounds (T, rows, columns) of `count` 8-bit pictures, evenly spaced over a source."""
    found = []
    for k in evenly(len(source), count).tolist():
        picture = np.asarray(source.frame(k, "display").image, np.uint8)
        filled = background(picture.astype(np.float64), target_mask(source, k, k + 1)).filled
        found.append(np.asarray(fill(picture, filled), np.uint8))
    return np.stack(found)


def fill(picture: Values, held: Bools) -> npt.NDArray[Any]:
    """Return a picture (rows, columns) with masked pixels filled in from around; itself for an empty mask."""
    if not held.any():
        return picture
    known = picture if picture.dtype == np.uint8 else picture.astype(np.float32)
    filled = cv2.inpaint(known, held.astype(np.uint8), 3, cv2.INPAINT_TELEA)
    return np.where(held, filled, picture).astype(picture.dtype)


def small_objects(picture: Floats) -> tuple[Bools, int]:
    """Return the mask (rows, columns) and the number of small hot or cold outliers in a picture.

    They stand out in the picture's top hat or black hat (J. Serra, "Image analysis and mathematical morphology", 1982).
    """
    smooth = cv2.GaussianBlur(np.asarray(picture, np.float32), (0, 0), 1.0)
    side = max(round(min(picture.shape) * _SMALL), 3)
    found = np.zeros(picture.shape, np.uint8)
    for hat in (cv2.MORPH_TOPHAT, cv2.MORPH_BLACKHAT):
        height = cv2.morphologyEx(smooth, hat, np.ones((side, side), np.uint8))
        usual = max(float(np.quantile(height, _USUAL)), 1e-6 * float(np.abs(smooth).max()))
        _, groups = cv2.connectedComponents((height > usual).astype(np.uint8))
        far = np.setdiff1d(groups[height > _FAR * usual], 0)
        found |= np.isin(groups, far).astype(np.uint8)
    grown = cv2.dilate(found, np.ones((2 * BOX_MARGIN_PX + 1,) * 2, np.uint8))
    return grown.astype(np.bool_), cv2.connectedComponents(grown)[0] - 1


def mean_picture(frames: Values, sigma: float, boxes: Boxes) -> tuple[Floats, Bools]:
    """Return the mean (rows, columns) of frames of a still scene, and the mask of pixels that targets always cover.

    Pixels in `boxes` of targets are left out. Values are clipped at 4 sigma from their median, so that other passing
    objects change the mean little.
    """
    picked = evenly(len(frames), _MEDIAN_FRAMES)
    middle = np.median(frames[picked], axis=0).astype(np.float64)
    covered = np.stack([box_mask(boxes[k], middle.shape) for k in picked])
    always = np.asarray(covered.all(axis=0), np.bool_)
    crossed: Bools = covered.any(axis=0) & ~always
    if crossed.any():
        middle[crossed] = np.nanmedian(np.where(covered[:, crossed], np.nan, frames[picked][:, crossed]), axis=0)
    total, free = np.zeros(middle.shape), np.full(middle.shape, len(frames))
    for frame, there in zip(frames, boxes, strict=True):
        change = np.clip(frame - middle, -_CLIP * sigma, _CLIP * sigma)
        if there:
            held = box_mask(there, middle.shape) & ~always
            change[held] = 0
            free[held] -= 1
        total += change
    return remove_specks(middle + total / free), always
