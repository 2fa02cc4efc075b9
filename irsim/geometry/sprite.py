"""Sprites: one object drawn alone, its pixel coverage and light, and its mean over an exposure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from irsim.types import Box, Floats, Slices

AREA_ROUNDING = 1e-9
"""Bound of the rounding error of a sum over a sprite's pixels, as a share of its area."""

FULL_PATCH = slice(None), slice(None)
"""Slices of a whole patch."""


@dataclass(frozen=True)
class RequestedContrast:
    """Requested contrast of a target against its background: exactly one of contrast_k, K, and scr is set.

    gain  factor on the resulting difference from the background
    """

    contrast_k: float | None = None
    scr: float | None = None
    gain: float = 1.0


class ExposureSamples(NamedTuple):
    """Sprite arrays at n evenly spaced instants of an exposure, (n, h, w) float64 each.

    whole  True if the patch holds the whole object at every instant
    """

    cover: Floats
    alpha: Floats
    emission: Floats
    whole: bool

    def relit(self, own: float | Floats, added: float | Floats) -> ExposureSamples:
        """Return a copy with emission `own * emission + added * alpha`; `added` in W/m2/sr, numbers or (h, w)."""
        return self._replace(emission=own * self.emission + added * self.alpha)


class Sprite(NamedTuple):
    """Patch with its top-left pixel at (x0, y0) that holds the visible part of one object; arrays (h, w) float64.

    cover      share of each pixel's area covered by the object, 0..1, before optics; used for ground truth
    alpha      share of each pixel's light replaced by the object, after optics
    emission   in-band radiance added after optics, W/m2/sr: L <- L (1 - alpha) + emission
    center     (x, y) px, area centroid;  signal_center  centroid of `emission`
    box        bounding box of the geometry, px
    range_m    distance from the camera, m
    area       px2 covered by the whole object, inside and outside the patch
    requested  contrast to set against the background; None to leave it as drawn
    contrast   factor by which the difference from the background is scaled
    samples    arrays at each instant of a finite exposure; cover, alpha, emission and area are then their means, and
               all other fields belong to the middle of the exposure

    The patch may reach past the frame.
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
    requested: RequestedContrast | None = None
    contrast: float = 1.0
    samples: ExposureSamples | None = None

    @property
    def whole(self) -> bool:
        """True if the patch holds the whole object; parts of bodies whose light cannot reach the frame are not
        drawn."""
        if self.samples is not None:
            return self.samples.whole
        (left, top, right, bottom), (rows, columns) = self.box.edges, self.cover.shape
        x, y = self.x0 - 0.5, self.y0 - 0.5
        return x <= left and right <= x + columns and y <= top and bottom <= y + rows

    def within(self, shape: tuple[int, ...], corner: tuple[int, int] = (0, 0)) -> tuple[Slices, Slices] | None:
        """Return the overlap with a picture of `shape` (rows, columns) whose first pixel is `corner` (x, y)."""
        return overlap((self.x0, self.y0), self.cover.shape, corner, shape)

    def meets(self, other: Sprite) -> tuple[Slices, Slices] | None:
        """Return the overlap with another sprite's patch."""
        return overlap((self.x0, self.y0), self.cover.shape, (other.x0, other.y0), other.cover.shape)

    @property
    def covers(self) -> Floats:
        """Coverage (h, w), or (n, h, w) at each instant of a finite exposure."""
        return self.cover if self.samples is None else self.samples.cover

    @property
    def alphas(self) -> Floats:
        """Alpha (h, w), or (n, h, w) at each instant of a finite exposure."""
        return self.alpha if self.samples is None else self.samples.alpha


def overlap(
    corner: tuple[int, int], shape: tuple[int, ...], other: tuple[int, int], size: tuple[int, ...]
) -> tuple[Slices, Slices] | None:
    """Return the overlap of two patches as slices (rows, columns) of each, or None if they are disjoint.

    A patch is given by its top-left pixel (x, y) and its shape (rows, columns).
    """
    (x, y), (rows, columns), (other_x, other_y), (other_rows, other_columns) = corner, shape, other, size
    if x >= other_x + other_columns or other_x >= x + columns or y >= other_y + other_rows or other_y >= y + rows:
        return None
    left, top = max(x, other_x), max(y, other_y)
    right, bottom = min(x + columns, other_x + other_columns), min(y + rows, other_y + other_rows)
    if left >= right or top >= bottom:  # one patch is empty
        return None
    within = slice(top - y, bottom - y), slice(left - x, right - x)
    return within, (slice(top - other_y, bottom - other_y), slice(left - other_x, right - other_x))


def exposure_mean(
    middle: Sprite | None, instants: Sequence[Sprite | None], shape: tuple[int, int] | None = None
) -> Sprite | None:
    """Return the mean of a sprite over an exposure, with its samples; None if it is absent at every instant.

    middle    sprite at the middle of the exposure, which gives the geometry fields; if it is None, the first sample
              gives them
    instants  sprites at evenly spaced instants; None where the object is absent
    shape     (rows, columns) of the picture: a patch much larger than it leaves out the parts that lie outside
    """
    parts = [part for part in instants if part is not None]
    if all(part is middle for part in instants) or not parts:
        return middle
    middle = middle or parts[0]
    drawn = [middle, *parts]  # a turning object may reach farthest at the middle
    x0, y0, right, bottom = _bounds(drawn)
    left_out = False
    if shape is not None and (right - x0) * (bottom - y0) > _MANY_PICTURES * shape[0] * shape[1]:
        drawn = [each for each in drawn if each.within(shape)] or [middle]
        x0, y0, right, bottom = _bounds(drawn)
        left_out = not all(any(part is each for each in drawn) for part in parts)
    samples = np.zeros((3, len(instants), bottom - y0, right - x0))
    for number, part in enumerate(instants):
        if part is not None and any(part is each for each in drawn):
            rows, columns = part.alpha.shape
            place = slice(part.y0 - y0, part.y0 - y0 + rows), slice(part.x0 - x0, part.x0 - x0 + columns)
            samples[(slice(None), number, *place)] = part.cover, part.alpha, part.emission
    cover, alpha, emission = samples.mean(axis=1)
    whole = not left_out and len(parts) == len(instants) and all(part.whole for part in parts)
    return middle._replace(
        x0=x0,
        y0=y0,
        cover=cover,
        alpha=alpha,
        emission=emission,
        signal_center=_light_centroid(middle, parts),
        area=sum(part.area for part in parts) / len(instants),
        samples=ExposureSamples(samples[0], samples[1], samples[2], whole),
    )


_MANY_PICTURES = 4
"""Size of the largest patch that is drawn whole, in pictures."""


def _bounds(sprites: Sequence[Sprite]) -> tuple[int, int, int, int]:
    """Return the bounds of all patches: x0, y0, and the column and row past the last ones."""
    edges = [(each.x0, each.y0, each.x0 + each.alpha.shape[1], each.y0 + each.alpha.shape[0]) for each in sprites]
    lefts, tops, rights, bottoms = zip(*edges, strict=True)
    return min(lefts), min(tops), max(rights), max(bottoms)


def _light_centroid(middle: Sprite, parts: Sequence[Sprite]) -> tuple[float, float]:
    """Return the centroid of the light of all parts, equally weighted in time; that of `middle` if all are dark."""
    lights = [float(part.emission.sum()) for part in parts]
    if sum(lights) <= 0:
        return middle.signal_center
    x, y = np.average([part.signal_center for part in parts], axis=0, weights=lights).tolist()
    return x, y


class OccludedBlur(NamedTuple):
    """Deviation of a moving object's light from its exposure mean, for occlusion within the exposure.

    patch  slices of the picture
    light  (n, h, w) W/m2/sr, light at each instant minus the mean over the instants

    An occluder hides the light that a moving object has at each instant, which differs from hiding a part of its mean.
    Deviations are kept for targets and occluders; the background counts as its mean over the exposure.
    """

    patch: Slices
    light: Floats

    @classmethod
    def of(cls, samples: ExposureSamples, light: Floats, within: tuple[Slices, Slices]) -> OccludedBlur:
        """Return the deviations of an object drawn over `light` (rows, cols); `within`: slices of its patch and of
        `light`."""
        inner, outer = within
        alpha, emission = (each[(..., *inner)] for each in (samples.alpha, samples.emission))
        added = emission - alpha * light[outer]
        return cls(outer, added - added.mean(axis=0))

    def hide(self, light: Floats, where: Slices, hidden: Floats) -> None:
        """Correct `light` (rows, cols) in place for a nearer object already drawn over it.

        where   pixels of the patch covered by the nearer object
        hidden  share 0..1 of their light that it hides, (h, w) or (n, h, w) at each instant
        """
        own = self.light[(..., *where)]
        lost = hidden * own
        mean = lost.mean(axis=0)
        own += mean - lost
        rows, columns = self.patch
        down, across = where
        light[rows, columns][down, across] -= mean
