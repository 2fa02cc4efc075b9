"""Bad pixels: search for dead, hot and blinking pixels, and their replacement.

Mean and temporal sigma of a pixel are compared with the median of the 5 x 5 px around it; the difference of the means
is the pixel's height. Optics blur light over neighbouring pixels, so that a pixel is good where a neighbour shares its
height or its changes.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.calibration.statistics import ROUNDED, Values, check_frames, check_positive, whole_counts
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

FULL = 0.99
"""Least fraction of the highest count at which a well counts as full."""
_FAR = 8.0
"""Height, robust sigmas, beyond which a pixel is dead or hot: none of 10^6 Gaussian pixels exceeds it."""
_RESTLESS = 3.0
"""Least ratio of a blinking pixel's temporal sigma to that around it."""
_SHARES = 0.15
"""Least fraction of a pixel's height that a neighbour under the same light has. A point centred on a pixel gives its
four direct neighbours 0.20 at a PSF sigma of 0.47 px."""
_FOLLOWS = 0.8
"""Least correlation between the changes of neighbouring pixels that a change of the scene causes."""
_UNSTABLE = 6.0
"""Distance of the log variance from its median, robust sigmas, beyond which a pixel is not used for noise."""
_TOGGLES = 0.51
"""Greatest temporal sigma, counts, of a pixel that alternates between two consecutive counts."""
_SLOWEST = 0.99
"""Quantile, over pixels, of the fraction of unchanged frames; it stands for the good pixels that change most rarely."""
LEAST_JUDGED = 100
_MOST_IN_CLUSTER = 16
"""Largest number of bad pixels in a group. Clusters of 2 pixels on average exceed it once in 10^4."""
_MEDIAN_REACH = 16


@dataclass(frozen=True, eq=False)
class BadPixels:
    """Disjoint masks (rows, columns) of bad pixels, found by comparison with the pixels around them.

    dead        pixels that never change, or are far below
    hot         pixels that are far above
    blinking    pixels that change far more
    judged      all pixels except those in or next to saturated surroundings
    frozen_from least number of frames after which a pixel that never changes is dead; None where most pixels never
                change, as where noise is far below one count
    """

    dead: Bools
    hot: Bools
    blinking: Bools
    judged: Bools
    frozen_from: int | None

    @property
    def all(self) -> Bools:
        bad: Bools = self.dead | self.hot | self.blinking
        return bad

    def without(self, taken: Bools | None) -> BadPixels:
        """Return the bad pixels outside a mask of targets, which resemble them. A mask of most pixels is ignored."""
        if taken is None or taken.mean() > 0.5:
            return self
        dead, hot, blinking, judged = (mask & ~taken for mask in (self.dead, self.hot, self.blinking, self.judged))
        return BadPixels(dead, hot, blinking, judged, self.frozen_from)


def find_bad_pixels(frames: Values, top: float = math.inf) -> BadPixels:
    """Return the bad pixels of frames (T, rows, columns) with the highest possible count `top`.

    A still point of light sharper than a PSF sigma of 0.45 px is taken for a hot pixel. Pixels that blink by less than
    three times the noise are missed, and so are dead and hot pixels on texture of similar contrast. InputError for
    invalid arrays.
    """
    check_frames(frames)
    check_positive(top, "top", "the highest possible count")
    values = np.asarray(frames, np.float32)
    level = values.mean(axis=0, dtype=np.float64).astype(np.float32)
    power = np.mean([np.square(frame - level, dtype=np.float64) for frame in values], axis=0)
    sigma = np.sqrt(power).astype(np.float32)
    rounded = float(np.median(sigma)) < ROUNDED and whole_counts(frames)
    usual = around(level)
    judged = ~cv2.dilate((usual >= FULL * top).astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool)
    frozen_from = _frozen_from(frames)
    frozen = np.zeros(level.shape, np.bool_)
    if frozen_from is not None and len(frames) >= frozen_from:
        frozen = (frames == frames[0]).all(axis=0) & (level < FULL * top)
    calm = np.maximum(around(sigma), float(np.median(sigma)))
    blinking = (sigma > np.maximum(_RESTLESS * calm, _TOGGLES if rounded else 0)) & judged
    blinking &= ~_follows_neighbour(values, blinking)
    apart = level - usual
    apart = apart - np.median(apart, axis=1, keepdims=True)
    apart = np.asarray(apart - np.median(apart, axis=0, keepdims=True), np.float32)
    far = np.abs(apart) > np.maximum(_FAR * _scatter(apart), 1.0 if rounded else 0)
    far &= judged & ~blinking & ~frozen
    hot = _alone(apart, far & (apart > 0))
    dead = _alone(-apart, far & (apart < 0)) | (frozen & judged & ~blinking)
    return BadPixels(dead, hot & ~dead, blinking, judged, frozen_from)


def around(picture: Floats) -> Floats:
    """Return the median of the 5 x 5 px around each pixel, with the picture continued by point reflection."""
    whole = np.pad(np.asarray(picture, np.float32), 2, mode="reflect", reflect_type="odd")
    return np.asarray(cv2.medianBlur(whole, 5)[2:-2, 2:-2])


def remove_specks(picture: Floats) -> Floats:
    """Return a picture (rows, columns) in which outlying pixels are replaced by the median around them."""
    usual = around(picture)
    apart = (picture - usual).astype(np.float32)
    return np.where(np.abs(apart) > _FAR * _scatter(apart), usual, picture)


def unstable_pixels(flat: Values) -> Bools:
    """Return the mask of pixels with far too high variance in a flat region (T, rows, columns), if they are few."""
    variances = np.log(np.maximum(np.var(flat, axis=0, dtype=np.float64), np.finfo(np.float32).tiny))
    apart = variances - np.median(variances)
    found: Bools = apart > _UNSTABLE * MEDIAN_TO_SIGMA * max(float(np.median(np.abs(apart))), 1 / math.sqrt(len(flat)))
    if whole_counts(flat):
        found &= variances > 2 * math.log(_TOGGLES)
    return found if found.mean() <= 0.02 else np.zeros_like(found)


def patch(frames: Values, bad: Bools) -> Values:
    """Return frames (T, rows, columns) with each bad pixel replaced by the nearest good pixel, if there is one.

    The level difference between the lines of both pixels, a median over 33 px about the bad one, is added.
    """
    if not bad.any() or bad.all():
        return frames
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(bad, return_distances=False, return_indices=True)
    level = np.where(bad, np.nan, frames.mean(axis=0, dtype=np.float64))
    patched, whole = frames.copy(), whole_counts(frames)
    for row, column in np.argwhere(bad):
        good_row, good_column = (int(places[row, column]) for places in nearest)
        offset = _line_offset(level, row, good_row, column) + _line_offset(level.T, column, good_column, row)
        values = frames[:, good_row, good_column].astype(np.float64) + (round(offset) if whole else offset)
        if np.issubdtype(frames.dtype, np.integer):
            values = values.clip(0, np.iinfo(frames.dtype.name).max)
        patched[:, row, column] = values
    return patched


def _line_offset(level: Floats, line: int, other: int, place: int) -> float:
    if line == other:
        return 0.0
    near = slice(max(place - _MEDIAN_REACH, 0), place + _MEDIAN_REACH + 1)
    apart = level[line, near] - level[other, near]
    apart = apart[np.isfinite(apart)]
    return float(np.median(apart)) if len(apart) >= 5 else 0.0


def _scatter(apart: Floats) -> Floats:
    """Return the robust sigma of differences around each pixel, or that of the whole picture where it is larger."""
    scatter = np.maximum(around(np.abs(apart)), float(np.median(np.abs(apart)))) * MEDIAN_TO_SIGMA
    return np.maximum(scatter, np.finfo(np.float32).tiny)


def _alone(height: Floats, found: Bools) -> Bools:
    """Return the mask of those pixels of `found` that belong to a group of bad pixels, not to the image of a bright
    object.

    A group holds pixels up to 3 px apart. It is a group of bad pixels if it has up to 16 pixels, at most two of the
    four direct neighbours of its peak share the peak's height, and at most four of all eight neighbours belong to the
    group.
    """
    from scipy.ndimage import label, maximum_position

    groups, count = label(cv2.dilate(found.astype(np.uint8), np.ones((3, 3), np.uint8)), np.ones((3, 3)))
    if not count:
        return found
    members = np.where(found, groups, 0)
    good = np.bincount(members.ravel(), minlength=count + 1) <= _MOST_IN_CLUSTER
    wide = np.pad(height, 1)
    for group, (row, column) in enumerate(maximum_position(height, members, np.arange(1, count + 1)), 1):
        neighbours = (wide[row + down, column + across] for down, across in ((0, 1), (2, 1), (1, 0), (1, 2)))
        near = members[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] == group
        good[group] &= sum(value > _SHARES * height[row, column] for value in neighbours) <= 2 and near.sum() <= 5
    alone: Bools = found & good[members]
    return alone


def _follows_neighbour(values: Floats, found: Bools) -> Bools:
    """Return those found pixels whose changes over time (T, rows, columns) follow those of one of eight neighbours."""
    rows, columns = np.nonzero(found)
    unit = _unit(values[:, rows, columns])
    nearest = np.zeros(len(rows))
    for down, across in itertools.product((-1, 0, 1), repeat=2):
        y, x = np.clip(rows + down, 0, found.shape[0] - 1), np.clip(columns + across, 0, found.shape[1] - 1)
        alike = (unit * _unit(values[:, y, x])).sum(axis=0)
        nearest = np.maximum(nearest, np.where((y != rows) | (x != columns), alike, 0))
    follows = np.zeros_like(found)
    follows[rows, columns] = nearest > _FOLLOWS
    return follows


def _unit(series: Floats) -> Floats:
    """Return series (T, pixels) less their means, each normalised to a vector of length 1."""
    apart = series - series.mean(axis=0)
    return np.asarray(apart / np.maximum(np.sqrt(np.square(apart).sum(axis=0)), np.finfo(np.float32).tiny))


def _frozen_from(frames: Values) -> int | None:
    """Return the least number T of frames over which at most 0.1 good pixels are expected to keep their value. A pixel
    that keeps its value from frame to frame with probability q keeps it over T frames with a probability of at most
    q^(T/2)."""
    if len(frames) < 2:
        return None
    stays = np.mean(frames[1:] == frames[:-1], axis=0)
    live = stays[stays < 1]
    if 2 * live.size <= stays.size:
        return None
    share = float(np.quantile(live, _SLOWEST))
    return 2 if share == 0 else math.ceil(2 * math.log(0.1 / stays.size) / math.log(share))
