"""What stands on the ground: rows of trees, each a layer at its own range; and what buildings share with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.backgrounds.painting import Painting
from irsim.backgrounds.panorama import Panorama, Sheet
from irsim.backgrounds.parallax import Cylinder, Standing
from irsim.backgrounds.texture import TILE
from irsim.config.base import Name, Part, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, Metres, NotNegative, Range
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import profile, spectral
from irsim.geometry.vegetation import LARGEST, Crown, Foliage, broadleaf, bush, conifer
from irsim.physics.radiometry import radiance
from irsim.rng import stream
from irsim.types import Bools, Floats

Spacing = Annotated[float, Field(ge=0.5, le=100_000)]
"""Metres; nearer to each other they would be too many to draw."""
Feet = Callable[[Floats], Floats]
"""The rows of the map where things stand at columns of it, (n,) each."""

FINE = 2
"""Outlines are drawn on a grid this much finer than pixels, then averaged."""

FARTHEST_PX = 2.0**20
"""Corners farther off are drawn so far off, far past any sheet: what has such corners is as large as that, and where it
is seen at all it fills the picture."""

CROWDED = 1.4
"""Crowns are no wider than about so many times the room between their trees: in a wood they are narrow."""

NEAREST_PX = 0.25
"""Trees and buildings stand so far apart in the picture at least: more would not be seen, and take long to draw."""

RELIEF_M = 80.0
"""Length of the largest waves of the ground that things stand on, m: a few to each field."""
RELIEF_BETA = 3.5
"""Slope of their spectrum: that of the hills at the horizon."""
MOST_RELIEF = 4.0
"""Hardly anything stands more than so many times `relief_m` higher or lower."""
STAGGERED = 0.35
"""How much higher or lower one by one they stand, as a share of `relief_m`: at unlike distances."""

SLIMMEST = 0.42
"""A broadleaf crown stays this wide, as a share of its tree's height, however crowded it is."""


class Canvas:
    """Cover and temperature, drawn on a fine grid over a sheet."""

    def __init__(self, sheet: Sheet) -> None:
        rows, columns = sheet.shape
        self.sheet = sheet
        self.cover = np.zeros((rows * FINE, columns * FINE), np.uint8)
        self.kelvin = np.zeros((rows * FINE, columns * FINE), np.float32)

    def polygon(self, points: Floats, kelvin: float) -> None:
        """A polygon of map places (n, 2) of one temperature."""
        origin = np.array([self.sheet.columns[0], self.sheet.rows[0]])
        within = np.clip(np.asarray(points) - origin, -FARTHEST_PX, FARTHEST_PX)
        fine = np.rint((within + 0.5) * FINE * 16 - 8).astype(np.int32)
        cv2.fillPoly(self.cover, [fine], 1, shift=4)
        cv2.fillPoly(self.kelvin, [fine], kelvin, shift=4)

    def stamp(self, foot: tuple[float, float], middle: float, hides: Bools, kelvin: Floats, coarser: int) -> None:
        """A picture whose last row stands at a map place (x, y), `middle` being its column there.

        hides, kelvin  (rows, cols): where it covers what is behind it, and its temperatures; each pixel
        is `coarser` of the fine grid wide and high
        """
        left = round((foot[0] - self.sheet.columns[0] + 0.5) * FINE - middle * coarser)
        top = round((foot[1] - self.sheet.rows[0] + 0.5) * FINE) - len(hides) * coarser
        rows, columns = (
            slice(max(begin, 0), max(min(begin + length * coarser, whole), 0))
            for begin, length, whole in zip((top, left), hides.shape, self.cover.shape, strict=True)
        )
        here = np.ix_(
            *((np.arange(span.start, span.stop) - begin) // coarser for span, begin in ((rows, top), (columns, left)))
        )
        self.cover[rows, columns][hides[here]] = 1
        self.kelvin[rows, columns][hides[here]] = kelvin[here][hides[here]]

    def layer(self, name: str, range_m: float, texture_k: Floats | float, context: SceneContext) -> Standing:
        """The layer that was drawn, its temperatures varied by texture_k (rows, cols) of the sheet."""
        size = self.sheet.shape[::-1]
        cover: Floats = np.asarray(
            cv2.resize(self.cover.astype(np.float32), size, interpolation=cv2.INTER_AREA), np.float32
        )
        mean = cv2.resize(self.kelvin * self.cover, size, interpolation=cv2.INTER_AREA) / np.maximum(cover, 1e-6)
        kelvin = np.maximum(mean + texture_k, 1.0)
        emission = context.through(cover * radiance(context.band, kelvin), cover, range_m, 0.0)
        pictures = tuple(Panorama.on(self.sheet, np.asarray(part), context.psf) for part in (1 - cover, emission))
        return Standing(name, Cylinder(range_m), Painting(pictures))


def grain(sheet: Sheet, beta: float, size_px: float, seed: int, *address: str) -> Floats:
    """(rows, cols) of a sheet: a field of mean 0 and variance 1."""
    field = spectral((TILE, TILE), beta, None, size_px, 1.0, seed, *address)
    rows, columns = (np.mod(np.arange(length), TILE) for length in sheet.shape)
    return np.asarray(field[np.ix_(rows, columns)])


class Structure(Part):
    """Something that stands on the ground, all around."""

    id: Name
    """Its name for --without, and in truth where it hides a target."""
    range_m: Range = 800.0
    """Metres; targets farther away are behind it."""
    relief_m: Annotated[NotNegative, Plausible(0, 50, "m", "500 m along a slope of 1 in 10 are 50 m")] = 0.0
    """Standard deviation of the height of the ground that it stands on, m: feet rise and fall along the row, and a
    third as much from one to the next. At 0 they stand on one straight line."""

    def base(self, sheet: Sheet, height_m: float, ifov_rad: float) -> float:
        """Row of the map where it meets the ground, seen from `height_m` above it."""
        return float(sheet.horizon + np.arctan(height_m / self.range_m) / ifov_rad)

    def feet(self, sheet: Sheet, base: float, context: SceneContext, what: str) -> Feet:
        """Where things that are called so stand on ground that would else be at row `base`."""
        if self.relief_m == 0:
            return lambda columns: np.full(len(columns), base)
        px_per_m = 1 / (self.range_m * context.geometry.ifov_rad)
        waves = profile(len(sheet.columns), RELIEF_BETA, RELIEF_M * px_per_m, context.seed, self.id, "relief")
        draw = stream(context.seed, self.id, what, "feet")

        def rows(columns: Floats) -> Floats:
            off = np.interp(columns, sheet.columns, waves) + STAGGERED * draw.standard_normal(len(columns))
            return np.asarray(base - self.relief_m * px_per_m * off)

        return rows


class Trees(Structure):
    """A row of trees: broadleaf ones and conifers, leafy or bare, with undergrowth."""

    switches: ClassVar[Switches] = {
        "texture": ("spread_k", 0.0),
        "undergrowth": ("undergrowth", 0.0),
        "relief": ("relief_m", 0.0),
    }

    id: Name = "trees"
    """Its name for --without, and in truth where it hides a target."""
    height_m: Annotated[Metres, Plausible(0.2, 120, "m", "the tallest tree has 116")] = 14.0
    """Mean height, m; single trees differ by a quarter."""
    spacing_m: Spacing = 6.0
    """Mean distance between two trees, m."""
    leaves: Fraction = 0.9
    """How much of a crown hides what is behind it: 0.4 is a bare tree."""
    conifers: Fraction = 0.25
    """Share of the trees that are conifers."""
    undergrowth: Fraction = 0.25
    """Height of the bushes between them, as a share of the trees'."""
    temperature_k: Kelvin | None = None
    """Mean temperature, K; by the `hour` where not given, else 288."""
    spread_k: KelvinSpread = 1.5
    """Standard deviation of temperature, K: half of it from tree to tree."""
    beta: Annotated[float, Field(ge=0, le=6)] = 2.2
    """Slope of the spectrum within the crowns (real bare trees: 2.2)."""

    def paint(self, sheet: Sheet, height_m: float, temperature_k: float, context: SceneContext) -> Standing:
        """The row of trees, seen from `height_m` above the ground."""
        ifov, draw = context.geometry.ifov_rad, stream(context.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base, tall = self.base(sheet, height_m, ifov), self.height_m * px_per_m
        rises = MOST_RELIEF * self.relief_m * px_per_m
        sheet = sheet.between(base - 1.9 * tall - rises, base + rises)
        canvas = Canvas(sheet)
        foliage = Foliage(tall * FINE, self.leaves, context.seed, self.id)
        room = self.spacing_m * px_per_m
        for foot in self._standing(sheet, base, _along(sheet, max(room, NEAREST_PX), draw), context, "trees"):
            self._tree(canvas, foliage, foot, tall, room, temperature_k, draw)
        if self.undergrowth:
            bushes, high = stream(context.seed, self.id, "bushes"), self.undergrowth * tall
            places = _along(sheet, max(0.5 * high, 2.0), bushes)
            for foot in self._standing(sheet, base, places, context, "bushes"):
                self._bush(canvas, foliage, foot, high, temperature_k, bushes)
        texture = grain(sheet, self.beta, max(tall / 2, 2.0), context.seed, self.id, "grain")
        return canvas.layer(self.id, self.range_m, 0.8 * self.spread_k * np.sqrt(0.5) * texture, context)

    def _standing(
        self, sheet: Sheet, base: float, columns: Floats, context: SceneContext, what: str
    ) -> list[tuple[float, float]]:
        """Places (x, y) of the map where they stand, the highest, which are the farthest, first; else as they come."""
        feet = self.feet(sheet, base, context, what)(columns)
        order = np.argsort(feet, kind="stable")
        return list(zip(columns[order].tolist(), feet[order].tolist(), strict=True))

    def _tree(
        self,
        canvas: Canvas,
        foliage: Foliage,
        foot: tuple[float, float],
        tall: float,
        room: float,
        kelvin: float,
        draw: np.random.Generator,
    ) -> None:
        """A tree of about that height, with so much room to the next, px."""
        height = tall * float(np.clip(1 + 0.25 * draw.standard_normal(), 0.4, 1.7))
        own = kelvin + self.spread_k * np.sqrt(0.5) * float(draw.standard_normal())
        is_conifer = draw.random() < self.conifers
        bare, slim = (0.07, draw.uniform(0.25, 0.45)) if is_conifer else (0.16, draw.uniform(0.55, 0.95))
        wide = min(slim * height, max(CROWDED * draw.uniform(0.7, 1.3) * room, SLIMMEST * height))
        (x, base), trunk = foot, max(0.04 * height, 0.5)
        left, right, top = x - trunk / 2, x + trunk / 2, base - (0.9 if is_conifer else 0.5) * height
        canvas.polygon(np.array([[left, base], [right, base], [x + trunk / 5, top], [x - trunk / 5, top]]), own)
        kind, size = conifer if is_conifer else broadleaf, ((1 - bare) * height, wide)
        self._leaves(canvas, foliage, kind, size, (x, base - bare * height), own, draw)

    def _bush(
        self,
        canvas: Canvas,
        foliage: Foliage,
        foot: tuple[float, float],
        tall: float,
        kelvin: float,
        draw: np.random.Generator,
    ) -> None:
        """A bush of about that height, px."""
        height = tall * float(np.clip(1 + 0.4 * draw.standard_normal(), 0.3, 2.0))
        size = height, height * draw.uniform(1.2, 2.4)
        own = kelvin + self.spread_k * (0.4 * float(draw.standard_normal()) - 0.3)
        self._leaves(canvas, foliage, bush, size, foot, own, draw)

    def _leaves(
        self,
        canvas: Canvas,
        foliage: Foliage,
        kind: Callable[[float, float, np.random.Generator], Crown],
        size: tuple[float, float],
        foot: tuple[float, float],
        kelvin: float,
        draw: np.random.Generator,
    ) -> None:
        """A crown of a size (high, wide) px that stands at a map place; its leaves vary about one temperature.

        One that would be too large is drawn coarser and enlarged.
        """
        coarser = int(np.ceil(max(size) * FINE / LARGEST))
        crown = kind(size[0] * FINE / coarser, size[1] * FINE / coarser, draw)
        hides, warmth = foliage.grown(crown, draw)
        canvas.stamp(foot, crown.middle, hides, kelvin + 0.7 * self.spread_k * warmth, coarser)


def _along(sheet: Sheet, spacing_px: float, draw: np.random.Generator) -> Floats:
    """(n,) columns of the map in random order, at that mean distance: by chance, each in its own share of the way."""
    first, last = float(sheet.columns[0]), float(sheet.columns[-1])
    count = max(1, round((last - first) / spacing_px))
    places = first + (np.arange(count) + draw.random(count)) * (last - first) / count
    return np.asarray(draw.permutation(places))
