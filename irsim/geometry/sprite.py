"""A thing drawn alone: the share of each pixel that it covers, and the light it puts there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from irsim.types import Box, Floats, Slices

AREA_ROUNDING = 1e-9
"""Share of a sprite's area that rounding in sums of its pixels does not exceed."""


@dataclass(frozen=True)
class Wanted:
    """A brightness that depends on what is behind: just one of contrast_k, K, and scr is given.

    gain  factor of the difference to what is behind
    """

    contrast_k: float | None = None
    scr: float | None = None
    gain: float = 1.0


class During(NamedTuple):
    """What a thing is at each of the n instants of an exposure, evenly spread: (n, h, w) float64 each, as of a sprite.

    whole  whether all of it is there, in each of them
    """

    cover: Floats
    alpha: Floats
    emission: Floats
    whole: bool

    def shining(self, own: float | Floats, added: float | Floats) -> During:
        """Of `own` times its light, and of light, W/m2/sr, that is `added` to its alpha: numbers or (h, w)."""
        return self._replace(emission=own * self.emission + added * self.alpha)


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
    during    where the exposure takes time: what it is meanwhile. cover, alpha, emission and area are the means of
              that, all else is of its middle
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
    during: During | None = None

    @property
    def whole(self) -> bool:
        """Whether its patch holds all of it: only what can reach the picture is drawn of a body."""
        if self.during is not None:
            return self.during.whole
        (left, top, right, bottom), (rows, columns) = self.box.edges, self.cover.shape
        x, y = self.x0 - 0.5, self.y0 - 0.5
        return x <= left and right <= x + columns and y <= top and bottom <= y + rows

    def within(self, shape: tuple[int, ...], corner: tuple[int, int] = (0, 0)) -> tuple[Slices, Slices] | None:
        """Where its patch and a picture of that shape (rows, columns), or such a part of one from a corner (x, y) on,
        meet: as slices of each; None where they do not."""
        return overlap((self.x0, self.y0), self.cover.shape, corner, shape)

    def meets(self, other: Sprite) -> tuple[Slices, Slices] | None:
        """Where its patch and another one's meet, likewise."""
        return overlap((self.x0, self.y0), self.cover.shape, (other.x0, other.y0), other.cover.shape)

    @property
    def covers(self) -> Floats:
        """Its cover (h, w); where the exposure takes time (n, h, w), at each of its instants."""
        return self.cover if self.during is None else self.during.cover

    @property
    def alphas(self) -> Floats:
        """Its alpha, likewise."""
        return self.alpha if self.during is None else self.during.alpha


def overlap(
    corner: tuple[int, int], shape: tuple[int, ...], other: tuple[int, int], size: tuple[int, ...]
) -> tuple[Slices, Slices] | None:
    """Where two patches meet, as slices (rows, columns) of each; None where they do not.

    A patch is its top-left pixel (x, y) and its shape (rows, columns).
    """
    (x, y), (rows, columns), (other_x, other_y), (other_rows, other_columns) = corner, shape, other, size
    if x >= other_x + other_columns or other_x >= x + columns or y >= other_y + other_rows or other_y >= y + rows:
        return None
    left, top = max(x, other_x), max(y, other_y)
    right, bottom = min(x + columns, other_x + other_columns), min(y + rows, other_y + other_rows)
    if left >= right or top >= bottom:  # one of them is empty
        return None
    within = slice(top - y, bottom - y), slice(left - x, right - x)
    return within, (slice(top - other_y, bottom - other_y), slice(left - other_x, right - other_x))


def averaged(middle: Sprite | None, instants: Sequence[Sprite | None]) -> Sprite | None:
    """What a thing is over an exposure, by its middle and its instants, evenly spread: it is nowhere in those that are
    None. Where its middle is, it is as at the first that is not."""
    parts = [part for part in instants if part is not None]
    if all(part is middle for part in instants) or not parts:
        return middle
    middle = middle or parts[0]
    drawn = [middle, *parts]  # what turns may reach farthest in the middle
    x0, y0 = min(each.x0 for each in drawn), min(each.y0 for each in drawn)
    right = max(each.x0 + each.alpha.shape[1] for each in drawn)
    bottom = max(each.y0 + each.alpha.shape[0] for each in drawn)
    meanwhile = np.zeros((3, len(instants), bottom - y0, right - x0))
    for number, part in enumerate(instants):
        if part is not None:
            rows, columns = part.alpha.shape
            place = slice(part.y0 - y0, part.y0 - y0 + rows), slice(part.x0 - x0, part.x0 - x0 + columns)
            meanwhile[(slice(None), number, *place)] = part.cover, part.alpha, part.emission
    cover, alpha, emission = meanwhile.mean(axis=1)
    whole = len(parts) == len(instants) and all(part.whole for part in parts)
    return middle._replace(
        x0=x0,
        y0=y0,
        cover=cover,
        alpha=alpha,
        emission=emission,
        signal_center=_light_center(middle, parts),
        area=sum(part.area for part in parts) / len(instants),
        during=During(meanwhile[0], meanwhile[1], meanwhile[2], whole),
    )


def _light_center(middle: Sprite, parts: Sequence[Sprite]) -> tuple[float, float]:
    """Centroid of the light of all parts, each of an equal share of the exposure; the middle's where there is none."""
    lights = [float(part.emission.sum()) for part in parts]
    if sum(lights) <= 0:
        return middle.signal_center
    x, y = np.average([part.signal_center for part in parts], axis=0, weights=lights).tolist()
    return x, y
