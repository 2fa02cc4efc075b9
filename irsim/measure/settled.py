"""What stands in frames: their mean, to which what passes adds little and targets of the truth nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from irsim.measure.boxes import Boxes, covered
from irsim.measure.defects import without_specks
from irsim.measure.given import Values
from irsim.measure.over_time import median_of
from irsim.measure.picked import evenly
from irsim.types import Bools, Floats

_MEDIANS = 48
_FAR = 4.0
"""Sigmas from its median beyond which a pixel's value is not its background's."""


class Settled(NamedTuple):
    """picture (rows, columns): the mean; never (rows, columns): where a target was in all of up to 48 frames that were
    looked at, and the picture is what they are."""

    picture: Floats
    never: Bools


def settled(frames: Values, noise: float, boxes: Boxes) -> Settled:
    """Mean of frames (T, rows, columns) in which a value far from its pixel's median counts as that far only.

    So what passes by leaves little behind; nor do bad pixels that were not found. Where a target was, in the `boxes` of
    a frame, that frame counts neither for the median nor for the mean.
    """
    picked = evenly(len(frames), _MEDIANS)
    middle = median_of([frames[k] for k in picked])
    taken = np.stack([covered(boxes[k], middle.shape) for k in picked])
    never: Bools = np.logical_and.reduce(taken)
    if (crossed := taken.any(axis=0) & ~never).any():
        middle[crossed] = np.nanmedian(np.where(taken[:, crossed], np.nan, frames[picked][:, crossed]), axis=0)
    total, free = np.zeros(middle.shape), np.full(middle.shape, len(frames))
    for frame, there in zip(frames, boxes, strict=True):
        change = np.clip(frame - middle, -_FAR * noise, _FAR * noise)
        if there:
            held = covered(there, middle.shape) & ~never
            change[held] = 0
            free[held] -= 1
        total += change
    return Settled(without_specks(middle + total / free), never)
