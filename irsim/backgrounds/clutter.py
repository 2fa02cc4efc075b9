"""Clutter: small things of the size and grey of targets that lie on the ground, and the forms that they may have."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Annotated, Literal, NamedTuple, Protocol

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.backgrounds.patches import Painted, Shape
from irsim.backgrounds.plane import VANISHING_PX
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
"""Side of the periodic field that outlines and insides are cut from, texels."""
ACROSS = 24
"""Texels of it to half a thing's length, so that a thing of any size shows lumps of the same share of it."""
LUMP = 16.0
"""Size of its largest lumps, texels: a third of a thing's length."""
SLOPE = 2.9
"""Slope of its spectrum: that of clumps of leaves (`irsim.geometry.vegetation`), and of ground from the air."""
RAGGED = 0.3
"""How far lumps move the outline, as a share of half the width: about the standard deviation."""
MOST = 1.7
"""No lump moves it by more than so many times that."""
UNEVEN = 0.35
"""Standard deviation of temperature within a thing, as a share of its contrast."""
LIT = 0.4
"""How much warmer its lit end is than its middle, as a share of its contrast."""
SOFTEST = 0.9
"""Things differ in how soft their edge is: from a pixel to so much of half their width, as bushes do from bare soil."""
TOGETHER = 4096
"""Things that are drawn from one lot of chances, and worked out together as far as they are small."""
SMALL_PX = 12
"""Those whose squares reach no farther from their middles."""
SWELLS = (1 + RAGGED**2 + SOFTEST**2 / 36) ** -0.5
"""Half axes are this much shorter, or ragged and soft things would cover more than their ellipses: at the radius
1 + u, u of mean 0 and variance RAGGED^2 and, evenly within a soft edge, SOFTEST^2 / 36 on an average, the area is
that of the ellipse times 1 + u^2 in the mean."""


class Thing(NamedTuple):
    """One piece of clutter: its middle (x, y) px, how it is turned, rad, half its length and width, px, and its mean
    temperature less the ground's, K."""

    middle: tuple[float, float]
    angle: float
    length: float
    width: float
    contrast_k: float

    def around(self, times: float = 1.0) -> tuple[Integers, Integers, Floats, Floats]:
        """Columns and rows of a square that holds it `times` larger, and how far each pixel's middle lies ahead of and
        beside its own, (rows, columns) px."""
        (x, y), reach = self.middle, self.reach(times)
        columns, rows = (np.arange(int(at) - reach, int(at) + reach + 1) for at in self.middle)
        return columns, rows, *_turned(columns - x, (rows - y)[:, None], self.angle)

    def reach(self, times: float = 1.0) -> int:
        """How far that square reaches from the pixel of its middle, px."""
        return int(times * self.length) + 2


def _turned(dx: Floats, dy: Floats, angle: Floats | float) -> tuple[Floats, Floats]:
    """How far what lies dx to the right and dy below lies ahead and beside, where ahead is turned by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return dx * cosine + dy * sine, dy * cosine - dx * sine


Drawn = tuple[Integers, Integers, Floats, "Floats | float"]
"""Columns and rows of a patch, and a thing's cover (rows, columns), 0..1, and temperature there, K."""

Wins = Callable[[Floats, Floats], npt.NDArray[np.bool_]]
"""Of two covers, where the first one's thing is seen rather than the other's: np.greater or np.greater_equal."""


class Form(Protocol):
    """How things look."""

    @abstractmethod
    def drawn(self, thing: Thing) -> Drawn:
        """A thing alone."""

    def each(self, things: Sequence[Thing]) -> Iterable[Drawn]:
        """All of them, each alone, in turn."""
        return map(self.drawn, things)

    @abstractmethod
    def over(self, thing: tuple[Floats, Floats | float], under: Painted, wins: Wins) -> Painted:
        """Cover and temperature of a thing where there are others already."""


class Ellipses(Form):
    """Each of one temperature, its edge half-way soft over a pixel."""

    def drawn(self, thing: Thing) -> Drawn:
        columns, rows, ahead, beside = thing.around()
        return columns, rows, _inside(ahead, beside, thing.length, thing.width), thing.contrast_k

    def each(self, things: Sequence[Thing]) -> Iterator[Drawn]:
        """Small ones that need as large a square are worked out together: one by one they take several times as
        long."""
        alike: dict[int, list[int]] = {}
        for number, thing in enumerate(things):
            alike.setdefault(thing.reach(), []).append(number)
        together: dict[int, Drawn] = {}
        for reach, numbers in alike.items():
            if reach <= SMALL_PX:
                together.update(zip(numbers, self._alike([things[number] for number in numbers], reach), strict=True))
        for number, thing in enumerate(things):
            yield together[number] if number in together else self.drawn(thing)

    @staticmethod
    def _alike(things: Sequence[Thing], reach: int) -> Iterator[Drawn]:
        """Those whose squares reach as far."""
        middles = np.array([thing.middle for thing in things])
        angle, length, width = np.array([thing[1:4] for thing in things]).T[..., None, None]
        spans = middles.astype(int)[..., None] + np.arange(-reach, reach + 1)  # (n, 2, columns or rows)
        off = spans - middles[..., None]
        inside = _inside(*_turned(off[:, None, 0], off[:, 1, :, None], angle), length, width)
        for thing, (columns, rows), cover in zip(things, spans, inside, strict=True):
            yield columns, rows, cover, thing.contrast_k

    def over(self, thing: tuple[Floats, Floats | float], under: Painted, wins: Wins) -> Painted:
        return np.maximum(under[0], thing[0]), np.where(wins(thing[0], under[0]), thing[1], under[1])


def _inside(ahead: Floats, beside: Floats, length: Floats | float, width: Floats | float) -> Floats:
    """Cover of ellipses of half axes, px, at places ahead of and beside their middles."""
    return np.asarray(np.clip((1 - np.hypot(ahead / length, beside / width)) * width + 0.5, 0, 1))


class Rough(Form):
    """Ragged outlines, warm and cold lumps within and a lit side, and edges from sharp to soft.

    In the mean each covers as much as its ellipse, and is as warm as it, weighted by cover.
    """

    def __init__(self, seed: int) -> None:
        self._draw = stream(seed, "clutter", "rough")
        outline, inside = (
            power_law((LUMPS, LUMPS), SLOPE, LUMP, 1.0, seed, "clutter", what) for what in ("outline", "inside")
        )
        self._lumps = np.stack([RAGGED * MOST * np.tanh(outline / MOST), inside], axis=-1)

    def drawn(self, thing: Thing) -> Drawn:
        length, width = SWELLS * thing.length, SWELLS * thing.width
        columns, rows, ahead, beside = thing.around(1 + RAGGED * MOST + SOFTEST / 2)
        begin, softness = self._draw.uniform(0, LUMPS, 2), SOFTEST * self._draw.random()
        x, y = (
            np.mod(part / length * ACROSS + own, LUMPS).astype(np.float32)
            for part, own in zip((ahead, beside), begin, strict=True)
        )
        lumps = cv2.remap(self._lumps, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        depth = 1 - np.hypot(ahead / length, beside / width) + lumps[..., 0]
        cover = np.clip(depth * width / max(softness * width, 1.0) + 0.5, 0, 1)
        (x0, y0), (right, down) = thing.middle, LIGHT
        side = ((columns - x0) * right + (rows - y0)[:, None] * down) / length
        uneven = UNEVEN * lumps[..., 1] + LIT * np.sign(thing.contrast_k) * side
        uneven -= (cover * uneven).sum() / max(float(cover.sum()), 1e-6)
        return columns, rows, cover, thing.contrast_k * (1 + uneven)

    def over(self, thing: tuple[Floats, Floats | float], under: Painted, wins: Wins) -> Painted:
        left = under[0] * (1 - thing[0])
        cover = thing[0] + left
        return cover, (thing[0] * thing[1] + left * under[1]) / np.maximum(cover, 1e-6)


FORMS: dict[FormName, Callable[[int], Form]] = {"ellipse": lambda _: Ellipses(), "rough": Rough}
"""What draws the things of each form, of a scene's seed."""


class Clutter(Part):
    """Small warm and cold things of the size and grey of targets: false targets."""

    form: FormName = "ellipse"
    """ellipse: each of one temperature, with a sharp edge. rough: at the same places, of the same sizes and mean
    temperatures, ragged, uneven within, with a warm side and an edge that is sharp or soft."""
    per_mrad2: Annotated[float, Field(ge=0, le=10)] = 0.002
    """How many in a square milliradian; on a landscape, at its horizon, and where all is p times as wide, p^3 times
    fewer."""
    size_mrad: Annotated[tuple[Length, Length], Field(strict=False), Rising] = (1.0, 4.0)
    """Smallest and largest length, mrad; on a landscape, at its horizon, where w metres seen from h metres up are
    40 ifov_mrad w / h; nearer ones are larger."""
    contrast_k: Annotated[tuple[KelvinSpread, KelvinSpread], Field(strict=False), Rising] = (3.0, 10.0)
    """Least and greatest temperature less the ground's mean, without sign, K."""
    cold: Fraction = 0.2
    """Share of them that is colder than the ground."""

    @property
    def deep(self) -> float:
        """How many lie on a place in the mean, on a landscape at its horizon."""
        short, long = self.size_mrad
        return self.per_mrad2 * math.pi / 4 * 0.75 * (short * short + short * long + long * long) / 3

    def thrown(self, shape: Shape, px_per_mrad: float) -> float:
        """How many there are in the mean on a periodic map."""
        high, wide = shape
        return self.per_mrad2 * (high / px_per_mrad * (wide / px_per_mrad))

    def stood(self, width: int, least: float, px_per_mrad: float) -> float:
        """How many there are in the mean on a plane: the integral of 1 / p^3 over its rows, of which p(d) = 1 + d /
        VANISHING_PX, down to where it is least^(-1/2)."""
        return self.per_mrad2 / px_per_mrad**2 * width * VANISHING_PX / 2 * (1 - least)

    def paint(self, shape: Shape, px_per_mrad: float, seed: int) -> Painted:
        """On a periodic map: things turned at random, twice as long as wide at most."""
        draw, form = stream(seed, "clutter"), FORMS[self.form](seed)
        cover, kelvin = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        count = draw.poisson(self.thrown(shape, px_per_mrad))
        for begin in range(0, count, TOGETHER):
            things = self._thrown(draw.random((min(TOGETHER, count - begin), 7)), shape, px_per_mrad)
            for columns, rows, inside, offset in form.each(things):
                patch = _patch(rows, columns, shape)
                cover[patch], kelvin[patch] = form.over((inside, offset), (cover[patch], kelvin[patch]), np.greater)
        return cover, kelvin

    def _thrown(self, chances: Floats, shape: Shape, px_per_mrad: float) -> list[Thing]:
        """Things anywhere on a map, by (n, 7) even chances, 0..1."""
        (high, wide), (shortest, longest), (least, most) = shape, self.size_mrad, self.contrast_k
        low = np.array([0.0, 0.0, 0.0, shortest, 0.5, least])
        x, y, angle, long, slim, contrast = (low + ([wide, high, np.pi, longest, 1.0, most] - low) * chances[:, :6]).T
        length = long * px_per_mrad / 2
        signed = contrast * np.where(chances[:, 6] < self.cold, -1, 1)
        of_each = (part.tolist() for part in (x, y, angle, length, length * slim, signed))
        return [Thing((x, y), *rest) for x, y, *rest in zip(*of_each, strict=True)]

    def stand(self, below: Floats, px_per_mrad: float, seed: int) -> Painted:
        """On a plane that is seen slantwise, evenly over its ground; below: (rows, cols) px below its horizon.

        What is as wide as p px where at the horizon it is as wide as one is p times as near. So it is p times as
        large, and as a px shows 1 / p^3 of the ground, there are so many fewer.
        """
        draw, form = stream(seed, "clutter"), FORMS[self.form](seed)
        cover, kelvin = np.zeros(below.shape, np.float32), np.zeros(below.shape, np.float32)
        (height, width), lowest = below.shape, below[-1]
        least = (1 + float(lowest.max()) / VANISHING_PX) ** -2
        count = draw.poisson(self.stood(width, least, px_per_mrad))
        nearness = np.sort(draw.uniform(least, 1, count) ** -0.5)  # the nearest last: they hide the others
        xs, angles = draw.uniform(0, width, count), draw.uniform(0, np.pi, count)
        lengths = draw.uniform(*self.size_mrad, count) * px_per_mrad / 2 * nearness
        widths = lengths * draw.uniform(0.5, 1, count)
        contrasts = draw.uniform(*self.contrast_k, count)
        contrasts *= np.where(draw.random(count) < self.cold, -1, 1)
        ys = height - 1 - lowest[xs.astype(int)] + (nearness - 1) * VANISHING_PX
        of_each = (part.tolist() for part in (xs, ys, angles, lengths, widths, contrasts))
        things = [Thing((x, y), *rest) for x, y, *rest in zip(*of_each, strict=True)]
        blocks = (things[begin : begin + TOGETHER] for begin in range(0, count, TOGETHER))
        for columns, rows, inside, offset in (each for block in blocks for each in form.each(block)):
            across, down = (columns >= 0) & (columns < width), (rows >= 0) & (rows < height)
            patch, seen = np.ix_(rows[down], columns[across]), np.ix_(down, across)
            within = inside[seen], np.broadcast_to(offset, inside.shape)[seen]
            cover[patch], kelvin[patch] = form.over(within, (cover[patch], kelvin[patch]), np.greater_equal)
        return cover, kelvin


def _patch(rows: Integers, columns: Integers, shape: Shape) -> tuple[Integers | slice, ...]:
    """Where consecutive rows and columns lie on a periodic map: slices within it, which are much quicker to look up."""
    (high, wide), top, left = shape, int(rows[0]), int(columns[0])
    if 0 <= top <= high - len(rows) and 0 <= left <= wide - len(columns):
        return slice(top, top + len(rows)), slice(left, left + len(columns))
    return np.ix_(rows % high, columns % wide)
