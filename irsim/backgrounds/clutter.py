"""Clutter: small objects on the ground with the size and grey level of targets, as ellipses or with rough outlines."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import Annotated, Literal, NamedTuple, Protocol

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.backgrounds.ground_cover import Painted, Shape
from irsim.backgrounds.ground_texture import VANISHING_PX
from irsim.config.base import Part
from irsim.config.quantities import Fraction, KelvinSpread, Rising
from irsim.geometry.random_fields import power_law
from irsim.geometry.vegetation import LIGHT
from irsim.rng import stream
from irsim.types import Floats

Integers = npt.NDArray[np.integer]

Length = Annotated[float, Field(ge=0.001, le=50)]

FormName = Literal["ellipse", "rough"]

LUMPS = 256
"""Side of the periodic random fields that shape outlines and interiors of rough objects, texels."""
ACROSS = 24
"""Texels of these fields per half length of an object, so lumps scale with the object."""
LUMP = 16.0
"""Size of the largest lumps, texels: a third of an object's length."""
SLOPE = 2.9
"""Spectral slope of lumps, as of clumps of leaves (`irsim.geometry.vegetation`) and of ground seen from the air."""
RAGGED = 0.3
"""Displacement of the outline by lumps, as a share of half the width: about the standard deviation."""
MOST = 1.7
"""Limit of the displacement of the outline, in standard deviations."""
UNEVEN = 0.35
"""Standard deviation of temperature within an object, as a share of its contrast."""
LIT = 0.4
"""Temperature of the lit end minus the centre, as a share of the contrast."""
SOFTEST = 0.9
"""Greatest width of an object's blurred edge, as a share of half the object's width; the least is a pixel."""
SWELLS = (1 + RAGGED**2 + SOFTEST**2 / 36) ** -0.5
"""Factor on the half axes that gives rough objects the mean area of their ellipses. An outline at the radius 1 + u half
axes encloses on average the ellipse's area times 1 + mean(u^2); u has mean 0 and variance RAGGED^2, plus on average
SOFTEST^2 / 36 for a soft edge."""


class ClutterObject(NamedTuple):
    """Object of clutter: centre (x, y) px, orientation, rad, half length and half width, px, and mean temperature minus
    the ground's, K."""

    middle: tuple[float, float]
    angle: float
    length: float
    width: float
    contrast_k: float

    def around(self, times: float = 1.0) -> tuple[Integers, Integers, Floats, Floats]:
        """Return columns and rows of a square around it, enlarged by `times`, and the pixels' coordinates along and
        across its axis, (rows, columns) px."""
        (x, y), reach = self.middle, int(times * self.length) + 2
        columns, rows = (np.arange(int(at) - reach, int(at) + reach + 1) for at in self.middle)
        dx, dy, cosine, sine = columns - x, (rows - y)[:, None], np.cos(self.angle), np.sin(self.angle)
        return columns, rows, dx * cosine + dy * sine, dy * cosine - dx * sine


Drawn = tuple[Integers, Integers, Floats, "Floats | float"]
"""Columns and rows of a patch, and an object's cover (rows, columns), 0..1, and temperature there, K."""

FrontRule = Callable[[Floats, Floats], npt.NDArray[np.bool_]]
"""Rule by which the first of two covers is in front: np.greater or np.greater_equal."""


class ClutterForm(Protocol):
    """Appearance of clutter objects."""

    @abstractmethod
    def drawn(self, item: ClutterObject) -> Drawn:
        """Return the patch of one object: its pixels, cover and temperature."""

    @abstractmethod
    def over(self, item: tuple[Floats, Floats | float], under: Painted, wins: FrontRule) -> Painted:
        """Return cover and temperature of an object drawn over others."""


class EllipseForm(ClutterForm):
    """Ellipses of one temperature each, antialiased over a pixel."""

    def drawn(self, item: ClutterObject) -> Drawn:
        columns, rows, ahead, beside = item.around()
        inside = (1 - np.hypot(ahead / item.length, beside / item.width)) * item.width + 0.5
        return columns, rows, np.clip(inside, 0, 1), item.contrast_k

    def over(self, item: tuple[Floats, Floats | float], under: Painted, wins: FrontRule) -> Painted:
        return np.maximum(under[0], item[0]), np.where(wins(item[0], under[0]), item[1], under[1])


class RoughForm(ClutterForm):
    """Ragged outlines, warm and cold lumps and a lit side, and edges from sharp to soft.

    On average an object has the area of its ellipse; its mean temperature, weighted by cover, is the ellipse's.
    """

    def __init__(self, seed: int) -> None:
        self._draw = stream(seed, "clutter", "rough")
        outline, inside = (
            power_law((LUMPS, LUMPS), SLOPE, LUMP, 1.0, seed, "clutter", what) for what in ("outline", "inside")
        )
        self._lumps = np.stack([RAGGED * MOST * np.tanh(outline / MOST), inside], axis=-1)

    def drawn(self, item: ClutterObject) -> Drawn:
        length, width = SWELLS * item.length, SWELLS * item.width
        columns, rows, ahead, beside = item.around(1 + RAGGED * MOST + SOFTEST / 2)
        begin, softness = self._draw.uniform(0, LUMPS, 2), SOFTEST * self._draw.random()
        x, y = (
            np.mod(part / length * ACROSS + own, LUMPS).astype(np.float32)
            for part, own in zip((ahead, beside), begin, strict=True)
        )
        lumps = cv2.remap(self._lumps, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        depth = 1 - np.hypot(ahead / length, beside / width) + lumps[..., 0]
        cover = np.clip(depth * width / max(softness * width, 1.0) + 0.5, 0, 1)
        (x0, y0), (right, down) = item.middle, LIGHT
        side = ((columns - x0) * right + (rows - y0)[:, None] * down) / length
        uneven = UNEVEN * lumps[..., 1] + LIT * np.sign(item.contrast_k) * side
        uneven -= (cover * uneven).sum() / max(float(cover.sum()), 1e-6)
        return columns, rows, cover, item.contrast_k * (1 + uneven)

    def over(self, item: tuple[Floats, Floats | float], under: Painted, wins: FrontRule) -> Painted:
        left = under[0] * (1 - item[0])
        cover = item[0] + left
        return cover, (item[0] * item[1] + left * under[1]) / np.maximum(cover, 1e-6)


FORMS: dict[FormName, Callable[[int], ClutterForm]] = {"ellipse": lambda _: EllipseForm(), "rough": RoughForm}
"""Constructor of each form, by the scene's seed."""


class Clutter(Part):
    """Small warm and cold objects of the size and grey of targets: false targets."""

    form: FormName = "ellipse"
    """`ellipse`: ellipses of one temperature each, with a sharp edge. `rough`: objects with the positions, sizes and
    mean temperatures of these ellipses, but ragged outlines, internal texture, a warm side and a sharp or soft edge."""
    per_mrad2: Annotated[float, Field(ge=0, le=10)] = 0.002
    """Number of objects per square milliradian. On a landscape this is the number at the horizon; where objects appear
    p times as wide, there are p^3 times fewer."""
    size_mrad: Annotated[tuple[Length, Length], Field(strict=False), Rising] = (1.0, 4.0)
    """[smallest, largest] length, mrad. On a landscape this is the length at the horizon, where w metres seen from h
    metres above the ground appear as 40 ifov_mrad w / h. Nearer objects appear larger."""
    contrast_k: Annotated[tuple[KelvinSpread, KelvinSpread], Field(strict=False), Rising] = (3.0, 10.0)
    """[least, greatest] magnitude of the difference from the ground's mean temperature, K."""
    cold: Fraction = 0.2
    """Share of the objects that is colder than the ground."""

    @property
    def deep(self) -> float:
        """Mean number of objects that cover a point; on a landscape, a point at the horizon."""
        short, long = self.size_mrad
        return self.per_mrad2 * math.pi / 4 * 0.75 * (short * short + short * long + long * long) / 3

    def mean_count(self, shape: Shape, px_per_mrad: float) -> float:
        """Return the mean number of objects on a periodic map."""
        high, wide = shape
        return self.per_mrad2 * (high / px_per_mrad * (wide / px_per_mrad))

    def mean_count_perspective(self, width: int, least: float, px_per_mrad: float) -> float:
        """Return the mean number of objects on a plane in perspective: the integral of 1 / p^3 over its rows, p(d) =
        1 + d / VANISHING_PX, down to p = least^(-1/2)."""
        return self.per_mrad2 / px_per_mrad**2 * width * VANISHING_PX / 2 * (1 - least)

    def paint(self, shape: Shape, px_per_mrad: float, seed: int) -> Painted:
        """Return objects of random orientation, at most twice as long as wide, painted on a periodic map."""
        draw, form = stream(seed, "clutter"), FORMS[self.form](seed)
        cover, kelvin = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        count = draw.poisson(self.mean_count(shape, px_per_mrad))
        for item in self._scattered(draw.random((count, 7)), shape, px_per_mrad):
            columns, rows, inside, offset = form.drawn(item)
            patch = _map_index(rows, columns, shape)
            cover[patch], kelvin[patch] = form.over((inside, offset), (cover[patch], kelvin[patch]), np.greater)
        return cover, kelvin

    def _scattered(self, chances: Floats, shape: Shape, px_per_mrad: float) -> list[ClutterObject]:
        """Return objects on a map from (n, 7) uniform numbers, 0..1."""
        (high, wide), (shortest, longest), (least, most) = shape, self.size_mrad, self.contrast_k
        low = np.array([0.0, 0.0, 0.0, shortest, 0.5, least])
        x, y, angle, long, slim, contrast = (low + ([wide, high, np.pi, longest, 1.0, most] - low) * chances[:, :6]).T
        length = long * px_per_mrad / 2
        signed = contrast * np.where(chances[:, 6] < self.cold, -1, 1)
        return _objects(x, y, angle, length, length * slim, signed)

    def paint_perspective(self, below: Floats, px_per_mrad: float, seed: int) -> Painted:
        """Return objects painted on a plane in perspective, with uniform density on the ground; below: px below the
        horizon.

        An object that appears p times as wide as at the horizon is p times as near. A pixel covers 1 / p^3 of the
        ground there, so the density on the image falls as p^-3.
        """
        draw, form = stream(seed, "clutter"), FORMS[self.form](seed)
        cover, kelvin = np.zeros(below.shape, np.float32), np.zeros(below.shape, np.float32)
        (height, width), lowest = below.shape, below[-1]
        least = (1 + float(lowest.max()) / VANISHING_PX) ** -2
        count = draw.poisson(self.mean_count_perspective(width, least, px_per_mrad))
        nearness = np.sort(draw.uniform(least, 1, count) ** -0.5)  # nearest last: they cover the others
        xs, angles = draw.uniform(0, width, count), draw.uniform(0, np.pi, count)
        lengths = draw.uniform(*self.size_mrad, count) * px_per_mrad / 2 * nearness
        widths = lengths * draw.uniform(0.5, 1, count)
        contrasts = draw.uniform(*self.contrast_k, count)
        contrasts *= np.where(draw.random(count) < self.cold, -1, 1)
        ys = height - 1 - lowest[xs.astype(int)] + (nearness - 1) * VANISHING_PX
        for item in _objects(xs, ys, angles, lengths, widths, contrasts):
            columns, rows, inside, offset = form.drawn(item)
            across, down = (columns >= 0) & (columns < width), (rows >= 0) & (rows < height)
            patch, seen = np.ix_(rows[down], columns[across]), np.ix_(down, across)
            within = inside[seen], np.broadcast_to(offset, inside.shape)[seen]
            cover[patch], kelvin[patch] = form.over(within, (cover[patch], kelvin[patch]), np.greater_equal)
        return cover, kelvin


def _objects(x: Floats, y: Floats, *rest: Floats) -> list[ClutterObject]:
    """Return the objects of the given centres, angles, half lengths, half widths and contrasts, (n,) each."""
    of_each = (part.tolist() for part in (x, y, *rest))
    return [ClutterObject((x, y), *others) for x, y, *others in zip(*of_each, strict=True)]


def _map_index(rows: Integers, columns: Integers, shape: Shape) -> tuple[Integers | slice, ...]:
    """Return the index of consecutive rows and columns on a periodic map: slices where possible, which are faster."""
    (high, wide), top, left = shape, int(rows[0]), int(columns[0])
    if 0 <= top <= high - len(rows) and 0 <= left <= wide - len(columns):
        return slice(top, top + len(rows)), slice(left, left + len(columns))
    return np.ix_(rows % high, columns % wide)
