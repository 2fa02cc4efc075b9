"""Pixels that do not do what the others do."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.measure.region import Mask, Values
from irsim.types import Floats

_FAR = 8.0
"""Robust sigmas beyond which a pixel is bad: a Gaussian one of 10^6 pixels is never there."""
RESTLESS = 3.0
"""Temporal sigma of a blinking pixel over that of those around it, at least."""
_MEDIAN_TO_SIGMA = 1.4826
"""Sigma over the median of absolute deviations of a Gaussian."""
_SLOWEST = 0.99
"""Share of the pixels that change at least as often as those that chance may freeze: whole counts make some slow."""
_BY_CHANCE = 0.1
"""So many pixels of a picture may be frozen by chance where those that never change are called dead."""


@dataclass(frozen=True, eq=False)
class Defects:
    """Masks (rows, columns); no pixel is in two of them.

    dead        does not change, or stands far below those around it
    hot         stands far above those around it
    blinking    changes far more in time than those around it
    frozen_from frames from which on one that never changes is called dead: in fewer, good ones may not happen to
                change; None where most pixels never do, as in pictures whose noise is far below one count
    """

    dead: Mask
    hot: Mask
    blinking: Mask
    frozen_from: int | None

    @property
    def all(self) -> Mask:
        bad: Mask = self.dead | self.hot | self.blinking
        return bad


def defects(frames: Values) -> Defects:
    """Bad pixels of frames (T, rows, columns), each compared with the 5 x 5 px around it.

    Ridges and edges of a scene are not bad pixels, nor are tracks of what moves: a bad one stands out
    from all on the border of those 5 x 5 px (so clusters wider than 3 px are missed). A still bright
    or dark point of the scene does look like one.
    """
    values = np.asarray(frames, np.float32)
    level, restless = values.mean(axis=0), values.std(axis=0)
    usual = float(np.median(restless))
    frozen_from = _frozen_from(frames)
    frozen = (restless == 0) & (frozen_from is not None and len(frames) >= frozen_from)
    out = _far_off(level - around(level))
    blinking = (restless > RESTLESS * np.maximum(around(restless), usual)) & _alone(restless)
    hot = out & _alone(level) & ~blinking
    dead = ((out & _alone(-level)) | frozen) & ~hot & ~blinking
    return Defects(dead, hot, blinking, frozen_from)


def _frozen_from(frames: Values) -> int | None:
    """Frames from which on hardly a good pixel of a picture stays the same by chance; see `Defects`.

    A pixel that takes count k with probability p_k stays from one frame to the next in the share q, the sum of
    p_k^2, and over T frames in that of p_k^T, which is at most q^(T/2); noise with memory stays so in about
    q^(T - 1), which is less.
    """
    stays = np.mean(frames[1:] == frames[:-1], axis=0)
    live = stays[stays < 1]
    if 2 * live.size <= stays.size:
        return None
    share = float(np.quantile(live, _SLOWEST))
    return 2 if share == 0 else math.ceil(2 * math.log(_BY_CHANCE / stays.size) / math.log(share))


def patched(frames: Values, bad: Mask) -> Values:
    """Frames (T, rows, columns) with each bad pixel's values those of the nearest good one: to be read only, for they
    are the frames given, not a copy, where no pixel is bad (or all are)."""
    if not bad.any() or bad.all():
        return frames
    from scipy.ndimage import distance_transform_edt

    rows, columns = distance_transform_edt(bad, return_distances=False, return_indices=True)
    return frames[:, rows, columns]


def without_specks(picture: Floats) -> Floats:
    """A picture in which what lies far off the 5 x 5 px around it has their median; found or not, alone or not."""
    usual = around(picture)
    return np.where(_far_off((picture - usual).astype(np.float32)), usual, picture)


def _far_off(apart: Floats) -> Mask:
    """Whether a difference to what is around is far beyond those of the place: texture and edges make them large."""
    scale = np.maximum(around(np.abs(apart)), float(np.median(np.abs(apart)))) * _MEDIAN_TO_SIGMA
    far: Mask = np.abs(apart) > _FAR * np.maximum(scale, np.finfo(np.float32).tiny)
    return far


def _alone(picture: Floats) -> Mask:
    """Whether a pixel lies above all on the border of the 5 x 5 px around it.

    By at least half of what it lies above their median.
    """
    border = np.pad(np.zeros((3, 3), np.uint8), 1, constant_values=1)
    highest = cv2.dilate(np.ascontiguousarray(picture, np.float32), border)
    alone: Mask = picture - highest > (picture - around(picture)) / 2
    return alone


def around(picture: Floats) -> Floats:
    """Median of the 5 x 5 px around each pixel."""
    return np.asarray(cv2.medianBlur(np.ascontiguousarray(picture, np.float32), 5))
