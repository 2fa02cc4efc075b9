"""What a pixel shares with those beside it: light that came through the optics is blurred over them, no fault is."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Bools, Floats

_FOLLOWS = 0.8
"""Correlation with a neighbour from which a pixel's changes are the scene's. Of 1181 pixels that seemed to blink before
waves and clouds, at a psf of 0.4 to 0.8 px, 97 % have more; of 680 that did blink 0.5 %, by chance."""
_SHARES = 0.15
"""Share of a pixel's height that one beside it has, at least, where light falls on both. A point in the middle of a
pixel has 0.20 of it on all four sides at a psf of 0.47 px, that of the sharpest preset (0.13 at 0.4 px); what is larger
has more. Chance has so much on few sides: what is far off stands out by eight sigmas."""
MOST_IN_GROUP = 16
"""Bad pixels in a group: clusters of 2 in the mean (`irsim.camera.bad_pixels`) have more in 1 of 10^4."""
_STEEP = 0.5
"""Share of the least height in a group that nothing around it has: light is blurred, and falls off more slowly."""
CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], np.uint8)
"""A pixel and the four that touch it."""


def following(values: Floats, asked: Bools) -> Bools:
    """Which of the pixels asked for change in time (T, rows, columns) as one of their eight neighbours does.

    Pixels of a cluster do not: each blinks by itself.
    """
    rows, columns = np.nonzero(asked)
    unit = _unit(values[:, rows, columns])
    nearest = np.zeros(len(rows))
    for down, across in itertools.product((-1, 0, 1), repeat=2):
        y, x = np.clip(rows + down, 0, asked.shape[0] - 1), np.clip(columns + across, 0, asked.shape[1] - 1)
        alike = (unit * _unit(values[:, y, x])).sum(axis=0)
        nearest = np.maximum(nearest, np.where((y != rows) | (x != columns), alike, 0))
    found = np.zeros_like(asked)
    found[rows, columns] = nearest > _FOLLOWS
    return found


def unshared(height: Floats, found: Bools) -> Bools:
    """Those of the pixels found (rows, columns) whose `height` no more than half of the pixels beside them share.

    Those up to 3 px apart are one group: members of a cluster do not count as beside it.
    """
    groups, count = in_groups(found)
    highest = cv2.dilate(np.where(found, height, 0).astype(np.float32), CROSS)
    beside = (highest > 0) & ~found
    lit = beside & (height > _SHARES * highest)
    sides, bright = (np.bincount(groups[mask], minlength=count + 1) for mask in (beside, lit))
    alone: Bools = found & (2 * bright <= sides)[groups]
    return alone


def in_steep_groups(found: Bools, height: Floats) -> Bools:
    """Those of the pixels found (rows, columns) that lie in small groups around which, up to 2 px far, nothing has half
    the `height` of the least of them, and of which the highest does not share it with more than half of those beside
    it: bad pixels beside each other, no light of the scene.

    Those up to 3 px apart are one group.
    """
    groups, count = in_groups(found)
    least = np.full(count + 1, np.inf)
    np.minimum.at(least, groups[found], height[found])
    wide = cv2.dilate(groups.astype(np.float32), np.ones((3, 3), np.uint8)).astype(np.intp)
    near = (wide > 0) & ~found
    slopes = np.bincount(wide[near & (height > _STEEP * least[wide])], minlength=count + 1)
    members = np.bincount(groups[found], minlength=count + 1)
    wider = np.pad(height, 1)
    sides = sum((side > _SHARES * height).astype(int) for side in _sides(wider))
    most = np.zeros(count + 1)
    np.maximum.at(most, groups[found], height[found])
    light = np.bincount(groups[found & (sides > 2) & (height == most[groups])], minlength=count + 1)
    steep: Bools = found & ((members <= MOST_IN_GROUP) & (slopes == 0) & (light == 0))[groups]
    return steep


def _sides(wider: Floats) -> tuple[Floats, ...]:
    """What lies above, below, left and right of each pixel of a picture, which is one pixel `wider` on every side."""
    return wider[:-2, 1:-1], wider[2:, 1:-1], wider[1:-1, :-2], wider[1:-1, 2:]


def in_groups(found: Bools) -> tuple[npt.NDArray[np.intp], int]:
    """Groups of the pixels found, up to 3 px apart, with those around them, as numbers from 1 on (rows, columns); how
    many there are."""
    from scipy.ndimage import label

    groups, count = label(cv2.dilate(found.astype(np.uint8), np.ones((3, 3), np.uint8)), np.ones((3, 3)))
    return groups, int(count)


def _unit(series: Floats) -> Floats:
    """Series (T, pixels) about their means, of length 1, or 0 where they do not change."""
    apart = series - series.mean(axis=0)
    return np.asarray(apart / np.maximum(np.sqrt(np.square(apart).sum(axis=0)), np.finfo(np.float32).tiny))
