"""Procedural trees and bushes: wood, and the depth and shading of the leaves of a crown, pixel by pixel.

Numbers without a source were chosen by eye.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from irsim.geometry.random_fields import power_law
from irsim.types import Floats

LIGHT = np.array([-0.5, -0.86])
"""Direction of the warm side, up and to the left: a unit vector of the picture."""

LOBES = 11
"""Number of boughs that carry the leaves of a broadleaf crown."""

SOFT = 7.0
"""Sharpness of the soft maximum that joins the depths of boughs."""

COARSE = 32
"""Samples along a crown's shorter side at which the smooth boughs are computed; values between are interpolated."""

RAGGED = 0.3
"""Approximate standard deviation of the outline's displacement by clumps of leaves, in units of `Crown.depth`."""

MOST = 1.7
"""Largest displacement of the outline, in units of RAGGED."""

LARGEST = 1024
"""Side of the random field of leaf clumps, px; no crown may be larger."""

SHADED = 0.9
"""Weight with which the shading of a crown's sides enters the warmth of its leaves."""

FORKS = 7
"""Number of forks of a broadleaf tree's wood."""

REACH = 0.8
"""Size of the ellipse in which boughs end, as a share of the crown's width and height."""


@dataclass(frozen=True, eq=False)
class Crown:
    """Smooth shape of a crown.

    depth   (rows, cols) 0 at the outline before clumps make it ragged, 1 well inside, below 0 outside
    shade   (rows, cols) from about -1 on the side away from the light to 1
    middle  column above the foot
    """

    depth: Floats
    shade: Floats
    middle: float


def broadleaf(high: float, wide: float, draw: np.random.Generator) -> Crown:
    """Return a crown of bulging boughs, `high` and `wide` in px; the last row is its foot."""
    step = max(1, int(min(high, wide) / COARSE))
    x, y, middle = _grid(high, wide, step)
    angle, out = draw.uniform(0, 2 * np.pi, LOBES), np.sqrt(draw.random(LOBES))
    least = min(high, wide) / 2
    radius = np.tile(least * draw.uniform(0.3, 0.55, LOBES), (2, 1))
    radius[:, 0], out[0] = (0.375 * wide, 0.375 * high), 0.2  # the middle bough joins the others
    across = (wide / 2 - 0.45 * least) * out * np.cos(angle)
    down = np.minimum(-high / 2 + (high / 2 - 0.45 * least) * out * np.sin(angle), -1.1 * radius[1])
    dx, dy = (
        (grid - place[:, None, None]) / own[:, None, None]
        for grid, place, own in zip((x, y), (across, down), radius, strict=True)
    )
    share = np.exp(SOFT * np.maximum(1 - dx**2 - dy**2, -3.0))
    total = share.sum(axis=0)
    facing = (share * (dx * LIGHT[0] + dy * LIGHT[1])).sum(axis=0) / total
    shade = np.clip(0.8 * facing - 0.6 * (y / high + 0.5), -1, 1)
    depth, shade = (cv2.resize(part, None, fx=step, fy=step) for part in (np.log(total) / SOFT, shade))
    return Crown(np.asarray(depth), np.asarray(shade), middle)


def bush(high: float, wide: float, draw: np.random.Generator) -> Crown:
    """Return a bush: a broadleaf crown without its lowest part, leafy down to the ground."""
    whole = broadleaf(1.5 * high, wide, draw)
    rows = len(whole.depth) - round(0.5 * high)
    return Crown(whole.depth[:rows], whole.shade[:rows], whole.middle)


def conifer(high: float, wide: float, draw: np.random.Generator) -> Crown:
    """Return a conifer: a cone of tiers of drooping branches."""
    x, y, middle = _grid(high, wide)
    below = np.clip(1 + y / high, 0, 1.2)  # 0 at the top, 1 at the foot
    out = np.abs(x) / (wide / 2)
    tier = np.mod(below * draw.uniform(5, 9) - 0.7 * out + draw.random(), 1)
    reach = below ** draw.uniform(0.65, 0.9) * (0.65 + 0.35 * tier)
    side = np.clip(x / (wide / 2) / np.maximum(reach, 0.05), -1, 1)
    inside = 1.8 * (1 - out / np.maximum(reach, 0.03)) - 60 * np.maximum(-1 - y / high, 0)
    return Crown(inside, np.clip(-0.6 * side + 0.5 * (0.5 - tier), -1, 1), middle)


def wood(high: float, wide: float, thick: float, draw: np.random.Generator) -> list[Floats]:
    """Return trunk and boughs of a broadleaf crown as tapering quadrilaterals (4, 2), px from the crown's foot.

    high, wide  of the crown, px
    thick       of the trunk at its foot, px
    """
    middle, halves = np.array([0.0, -high / 2]), np.array([wide, high]) / 2

    def within(tip: Floats) -> Floats:
        """Return the tip, moved to the edge of the crown if it lies outside."""
        off = (tip - middle) / halves
        return np.asarray(middle + halves * off * min(1.0, REACH / float(np.linalg.norm(off))))

    top = within(np.array([draw.uniform(-0.08, 0.08) * wide, -high]))
    limbs = [_limb(np.zeros(2), top, thick, 0.25 * thick)]
    sides = np.resize([-1.0, 1.0], FORKS) * np.sign(draw.random() - 0.5)
    for place, side in zip(np.linspace(0.05, 0.65, FORKS), sides, strict=True):
        begin, own = place * top, thick * (0.55 - 0.4 * place)
        tip = begin + draw.uniform([0.22, -0.4], [0.4, -0.2]) * [side * wide * (1 - 0.5 * place), high]
        limbs.append(_limb(begin, within(tip), own, 0.3 * own))
        fork = (begin + within(tip)) / 2
        twig = fork + draw.uniform([0.0, -0.3], [0.2, -0.1]) * [side * wide, high]
        limbs.append(_limb(fork, within(twig), 0.6 * own, 0.2 * own))
    return limbs


def _limb(begin: Floats, end: Floats, thick: float, thin: float) -> Floats:
    along = (end - begin) / np.linalg.norm(end - begin)
    across = np.array([-along[1], along[0]]) / 2
    return np.stack([begin - thick * across, end - thin * across, end + thin * across, begin + thick * across])


def _grid(high: float, wide: float, step: int = 1) -> tuple[Floats, Floats, float]:
    """Return x (1, cols) from the middle and y (rows, 1) below the foot, px, with a margin, and the middle column.

    Coordinates are those of the middles of cells of `step` px; the last row lies on the foot.
    """
    cols, rows = (int(np.ceil(side / step)) + 1 for side in (1.3 * wide, 1.15 * high))
    x, y = ((np.arange(count) + 0.5) * step - 0.5 for count in (cols, rows))
    middle = (cols * step - 1) / 2
    return (x - middle)[None, :], (y - (rows * step - 1))[:, None], middle


class Foliage:
    """Clumps of leaves at several scales, shared by a row of trees; each crown uses a different part of the field."""

    def __init__(self, size_px: float, leaves: float, seed: int, name: str) -> None:
        self._leaves = leaves
        self._clumps = power_law((LARGEST, LARGEST), 2.9, max(size_px / 4, 2.0), 1.0, seed, name, "clumps")
        self._bulge = RAGGED * MOST * np.tanh(self._clumps / MOST)
        step = min(max(round(size_px / 40), 1), LARGEST // 4)  # a shift by a whole period would have no effect
        after, before = (np.roll(self._clumps, (by, by), (0, 1)) for by in (-step, step))
        self._relief = (after - before) / (after - before).std()  # slopes that rise right and down face the light
        elsewhere = np.roll(self._clumps + self._relief, (LARGEST // 2, LARGEST // 2), (0, 1)) / np.sqrt(2)
        self._rank = 1 / (1 + np.exp(-1.702 * elsewhere))  # approximates the normal distribution function within 0.01

    def leaves_of(self, crown: Crown, draw: np.random.Generator) -> tuple[npt.NDArray[np.bool_], Floats]:
        """Return (rows, cols) each: the opaque leaves of a crown, bool, and their warmth, about -1 to 1."""
        begins = draw.integers(LARGEST), draw.integers(LARGEST)
        part = np.ix_(
            *(np.mod(begin + np.arange(size), LARGEST) for begin, size in zip(begins, crown.depth.shape, strict=True))
        )
        depth = crown.depth + self._bulge[part]
        gaps = self._rank[part] < (1 - self._leaves) * (2 - 2 * np.clip(depth, 0, 1))
        return (depth > 0) & ~gaps, SHADED * crown.shade + 0.35 * self._relief[part]
