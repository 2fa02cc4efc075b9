"""Trees: rows of them at their ranges, and distant woods along the horizon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.backgrounds.panorama import PanoramaGrid, PanoramicLayer
from irsim.backgrounds.structures import FINE, MOST_RELIEF, NEAREST_PX, Canvas, Spacing, Structure, texture_on
from irsim.config.base import Name, Switches
from irsim.config.fields import Plausible
from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, Metres
from irsim.geometry.context import SceneContext
from irsim.geometry.random_fields import profile
from irsim.geometry.vegetation import LARGEST, Crown, Foliage, broadleaf, bush, conifer
from irsim.rng import stream
from irsim.types import Floats

CROWDED = 1.4
"""Approximate largest width of crowns, in distances between trees: crowns in a wood are narrow."""
SLIMMEST = 0.42
"""Least width of a broadleaf crown, as a share of the tree's height."""

TREE_M = 15.0
"""Height of trees in distant woods, m; their apparent height gives their range."""
TYPICAL_MRAD = 1.5
"""Apparent height of distant woods, mrad, which is TREE_M seen from 10 km."""
STRETCH = 40.0
"""Length of woods and of gaps between them, in mean heights."""
CROWN = 2.0
"""Length of crowns of distant woods, in mean heights."""
VARIATION = 0.8
"""Standard deviation of the height of woods along the horizon, as a share of the mean."""
HEDGE = 0.4
"""Height of hedges between woods, as a share of the mean height."""
RAGGED = 0.35
"""Standard deviation of the height from crown to crown, as a share of the height."""
TALLEST = 2.5
"""Limit of the height of woods, in mean heights, approached as a hyperbolic tangent."""
DEPTH = 0.6
"""Extent of distant woods below the ground's far edge, as a share of their height."""


class Trees(Structure):
    """Row of trees: broadleaf trees and conifers, leafy or bare, with undergrowth."""

    switches: ClassVar[Switches] = {
        "texture": ("spread_k", 0.0),
        "undergrowth": ("undergrowth", 0.0),
        "relief": ("relief_m", 0.0),
    }

    id: Name = "trees"
    """Name for --without, and as an occluder in the ground truth."""
    height_m: Annotated[Metres, Plausible(0.2, 120, "m", "the tallest tree has 116")] = 14.0
    """Mean height, m; the standard deviation between trees is a quarter of it."""
    spacing_m: Spacing = 6.0
    """Mean distance between two trees, m."""
    leaves: Fraction = 0.9
    """Opacity of a crown: 0.4 is a bare tree."""
    conifers: Fraction = 0.25
    """Share of the trees that are conifers."""
    undergrowth: Fraction = 0.25
    """Height of the bushes between the trees, as a share of the height of the trees; 0: none."""
    temperature_k: Kelvin | None = None
    """Mean temperature, K; by default that of the landscape's `hour`, or 288 with `any`."""
    spread_k: KelvinSpread = 1.5
    """Standard deviation of temperature, K; half of the variance is between trees."""
    beta: Annotated[float, Field(ge=0, le=6)] = 2.2
    """Slope of the spectrum within the crowns (real bare trees: 2.2)."""

    def paint(self, grid: PanoramaGrid, height_m: float, temperature_k: float, context: SceneContext) -> PanoramicLayer:
        """Return the row of trees, seen from `height_m` above the ground."""
        ifov, draw = context.geometry.ifov_rad, stream(context.seed, self.id)
        px_per_m = 1 / (self.range_m * ifov)
        base, tall = self.base(grid, height_m, ifov), self.height_m * px_per_m
        rises = MOST_RELIEF * self.relief_m * px_per_m
        grid = grid.between(base - 1.9 * tall - rises, base + rises)
        foliage = Foliage(tall * FINE, self.leaves, context.seed, self.id)
        painter = _TreePainter(self, Canvas(grid), foliage, temperature_k, draw)
        room = self.spacing_m * px_per_m
        # The nearest, whose feet are the lowest, cover the others.
        feet = self.feet(grid, base, _along(grid, max(room, NEAREST_PX), draw), context, "trees")
        for foot in sorted(feet, key=itemgetter(1)):
            painter.tree(foot, tall, room)
        if self.undergrowth:
            bushes, high = stream(context.seed, self.id, "bushes"), self.undergrowth * tall
            places = _along(grid, max(0.5 * high, 2.0), bushes)
            for foot in sorted(self.feet(grid, base, places, context, "bushes"), key=itemgetter(1)):
                replace(painter, draw=bushes).bush(foot, high)
        texture = texture_on(grid, self.beta, max(tall / 2, 2.0), context.seed, self.id, "grain")
        texture_k = 0.8 * self.spread_k * np.sqrt(0.5) * texture
        return painter.canvas.layer(self.id, self.range_m, texture_k, context)


Foot = tuple[float, float]
"""Map position (x, y), px."""


@dataclass(frozen=True, eq=False)
class _TreePainter:
    """Painter of the trees and bushes of a row, whose mean temperature is `kelvin`, K."""

    row: Trees
    canvas: Canvas
    foliage: Foliage
    kelvin: float
    draw: np.random.Generator

    def tree(self, foot: Foot, tall: float, room: float) -> None:
        """Draw a tree of about the given height, px, with the given distance to the next tree, px."""
        draw = self.draw
        height = tall * float(np.clip(1 + 0.25 * draw.standard_normal(), 0.4, 1.7))
        own = self.kelvin + self.row.spread_k * np.sqrt(0.5) * float(draw.standard_normal())
        is_conifer = draw.random() < self.row.conifers
        bare, slim = (0.07, draw.uniform(0.25, 0.45)) if is_conifer else (0.16, draw.uniform(0.55, 0.95))
        wide = min(slim * height, max(CROWDED * draw.uniform(0.7, 1.3) * room, SLIMMEST * height))
        (x, base), trunk = foot, max(0.04 * height, 0.5)
        left, right, top = x - trunk / 2, x + trunk / 2, base - (0.9 if is_conifer else 0.5) * height
        corners = np.array([[left, base], [right, base], [x + trunk / 5, top], [x - trunk / 5, top]])
        self.canvas.polygon(corners, own)
        kind = conifer if is_conifer else broadleaf
        self.crown(kind, ((1 - bare) * height, wide), (x, base - bare * height), own)

    def bush(self, foot: Foot, tall: float) -> None:
        """Draw a bush of about the given height, px."""
        height = tall * float(np.clip(1 + 0.4 * self.draw.standard_normal(), 0.3, 2.0))
        size = height, height * self.draw.uniform(1.2, 2.4)
        own = self.kelvin + self.row.spread_k * (0.4 * float(self.draw.standard_normal()) - 0.3)
        self.crown(bush, size, foot, own)

    def crown(
        self,
        kind: Callable[[float, float, np.random.Generator], Crown],
        size: tuple[float, float],
        foot: Foot,
        kelvin: float,
    ) -> None:
        """Draw a crown of a size (high, wide) px, with leaves of a mean temperature, K; very large crowns are drawn
        coarser."""
        coarser = int(np.ceil(max(size) * FINE / LARGEST))
        crown = kind(size[0] * FINE / coarser, size[1] * FINE / coarser, self.draw)
        hides, warmth = self.foliage.leaves_of(crown, self.draw)
        self.canvas.stamp(foot, crown.middle, hides, kelvin + 0.7 * self.row.spread_k * warmth, coarser)


def _along(grid: PanoramaGrid, spacing_px: float, draw: np.random.Generator) -> Floats:
    """Return map columns (n,) in random order: one at random in each interval of about `spacing_px`."""
    first, last = float(grid.columns[0]), float(grid.columns[-1])
    count = max(1, round((last - first) / spacing_px))
    places = first + (np.arange(count) + draw.random(count)) * (last - first) / count
    return np.asarray(draw.permutation(places))


def distant_woods(
    grid: PanoramaGrid, edge: Floats, mean_px: float, row: Trees, trees_k: float, seed: int
) -> tuple[Floats, Floats]:
    """Return cover 0..1 and temperature, K, (rows, cols) each, of woods along the ground's edge at map rows (cols,).

    mean_px: mean height, above 0. row: nearer trees, whose temperature variation the woods share. trees_k: mean
    temperature, K.
    """
    stretch, trees, hem = (
        profile(len(grid.columns), beta, size * mean_px, seed, "far woods", what)
        for beta, size, what in ((3.0, STRETCH, "stretches"), (3.2, CROWN, "trees"), (3.0, STRETCH / 4, "hem"))
    )
    dense = np.maximum(1 + VARIATION * stretch, HEDGE)
    high = dense * np.clip(1 + RAGGED * trees, 0.1, None)
    top = edge - mean_px * TALLEST * np.tanh(high / TALLEST)
    foot = edge + DEPTH * mean_px * np.minimum(dense, 1) * np.clip(1 + hem / 2, 0.2, None)
    rows = grid.rows[:, None]
    cover = np.clip(rows - top + 0.5, 0, 1) * np.clip(foot - rows + 0.5, 0, 1)
    warmth = trees_k + 0.8 * row.spread_k * texture_on(grid, row.beta, max(mean_px, 2.0), seed, "far woods", "grain")
    return cover, warmth
