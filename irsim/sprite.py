"""A thing drawn alone: the share of each pixel that it covers, and the light it puts there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from irsim.types import Box, Floats


@dataclass(frozen=True)
class Wanted:
    """A brightness that depends on what is behind: just one of contrast_k, K, and scr is given.

    gain  factor of the difference to what is behind
    """

    contrast_k: float | None = None
    scr: float | None = None
    gain: float = 1.0


class Sprite(NamedTuple):
    """A patch whose top-left pixel is (x0, y0); it may reach past the frame, and holds all of the thing
    that the frame can see. Arrays are (h, w) float64.

    cover     share of the pixel's area that the thing covers, 0..1, before optics: truth uses it
    alpha     share of the pixel's light that it replaces, after optics
    emission  in-band radiance that it adds, after optics, W/m2/sr: L <- L (1 - alpha) + emission
    center    (x, y) px, area centroid;  signal_center, centroid of `emission`
    box       tight box of the geometry
    area      px2 that the whole thing covers, what lies outside the patch too
    wanted    where its brightness depends on what is behind: what it is to be
    contrast  factor of its difference to what is behind it
    """

    x0: int
    y0: int
    cover: Floats
    alpha: Floats
    emission: Floats
    center: tuple[float, float]
    signal_center: tuple[float, float]
    box: Box
    range_m: float
    area: float
    wanted: Wanted | None = None
    contrast: float = 1.0


def averaged(middle: Sprite, parts: Sequence[tuple[float, Sprite]]) -> Sprite:
    """The sprite whose light is the mean of `parts`, each with its share; all else is that of `middle`."""
    if not parts:
        return middle
    drawn = [middle, *(part for _, part in parts)]  # what turns may reach farthest in the middle
    x0, y0 = min(each.x0 for each in drawn), min(each.y0 for each in drawn)
    right = max(each.x0 + each.alpha.shape[1] for each in drawn)
    bottom = max(each.y0 + each.alpha.shape[0] for each in drawn)
    whole = sum(share for share, _ in parts)
    cover, alpha, emission = np.zeros((3, bottom - y0, right - x0))

    def place(part: Sprite) -> tuple[slice, slice]:
        rows, columns = part.alpha.shape
        return slice(part.y0 - y0, part.y0 - y0 + rows), slice(part.x0 - x0, part.x0 - x0 + columns)

    for share, part in parts:
        alpha[place(part)] += share / whole * part.alpha
        emission[place(part)] += share / whole * part.emission
    cover[place(middle)] = middle.cover
    return middle._replace(x0=x0, y0=y0, cover=cover, alpha=alpha, emission=emission)
