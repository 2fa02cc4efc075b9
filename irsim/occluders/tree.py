"""A tree that hides targets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import accumulate
from typing import Annotated, ClassVar

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.foliage import Crown, Foliage, broadleaf, wood
from irsim.geometry import Geometry
from irsim.kinds import Fraction, Kelvin, KelvinSpread, Pair, Positive
from irsim.occluders.bar import Size
from irsim.occluders.base import Occluder, bounds, given
from irsim.occluders.picture import Picture
from irsim.occluders.standing import foot
from irsim.rng import stream
from irsim.shapes.polygon import as_changes, coverage, outline
from irsim.shapes.silhouette import Grid, spread, within_sight
from irsim.sight import Sight
from irsim.sprite import Sprite
from irsim.stage import Stage
from irsim.types import Box, Floats, arrays_frozen

Mask = npt.NDArray[np.bool_]

CELLS = 512
"""A crown is drawn on so many cells on its longer side, and scaled to where it is seen."""
PROPORTIONS = 4
"""Crowns are drawn in so many proportions, height to width, for each factor of two, and stretched to those between."""
SLIMMEST = 3.0
"""Factors of two between height and width beyond which crowns are drawn no slimmer, and only stretched."""
CORE = 0.6
"""The crown has no gaps within an ellipse of this share of its width and height."""
FADING = 0.2
"""Over such a share of its width and height it then becomes as it would be without."""
CORNER = math.radians(60.0)
"""Seen from the crown's middle, what its core is placed over has its corners this far from upright."""
CENTRE = np.array([0.0, -0.5])
"""The crown's middle, in widths and heights of it from its foot."""
RIM = 1
"""Cells around what a crown is placed over that have no gap either: it is drawn between its cells."""
HALVINGS = 10
"""Of the step in which the least crown is sought: to a thousandth of its size."""
THICK = 0.065
"""The trunk's width at the crown, as a share of the crown's width."""
LEAST_TRUNK = 1.15
"""Placed by intent it is so many times as high as its crown at least."""
FLARE = 1.35
"""How many times wider the trunk is at its foot."""
LONE = 1.8
"""A tree up to so many times as high as its crown looks like one with a lone crown."""
LOWER = 0.38
"""Where a crown stands below another one: its top so much of the other one's height below the other one's top."""
WIDER = 1.25
"""How many times larger it is."""
MOST_TIERS = 20
"""Crowns of a tree."""
BARE = 0.12
"""Share of a tree's height below which no crown reaches."""


class Tree(Occluder):
    """A broadleaf tree: a trunk, boughs, and a ragged crown of clumps of leaves with gaps towards its rim."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "crown_px")

    temperature_k: Kelvin = 290.0
    """Mean temperature of the leaves, kelvin."""
    emissivity: Fraction = 0.95
    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """From foot to top, px."""
    crown_px: Size | None = None
    """[width, height] of the crown, px."""
    tiers: Annotated[int, Field(ge=1, le=MOST_TIERS)] | None = None
    """Crowns one below the other, each larger than the one above, as of a fir. Where not given: one; placed by whom it
    hides as many as a trunk that would be long and bare takes."""
    leaves: Fraction = 0.8
    """How much of the crown's outer part hides what is behind: 0.4 is a bare tree; the middle hides all."""
    trunk_k: Kelvin = 292.0
    """Temperature of trunk and boughs, kelvin."""
    spread_k: KelvinSpread = 1.0
    """Standard deviation of temperature within the crown, kelvin: the lit side is warmer, and each clump's."""

    def draw(self, sight: Sight) -> Sprite | None:
        return _drawn(self, sight.stage, sight.lens, sight.rotation.tobytes(), sight.place.tobytes())

    def crowns(self, stage: Stage) -> list[tuple[Form, Floats]]:
        """Each crown with its boughs, the top one first, and the corners (4, 2) of its arrays, px of the unmoved
        camera."""
        (x, y), high, (wide, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        found = []
        for tier, (down, times) in enumerate(_stacked(self.tiers or 1)):
            form, foot_y = self._form(tall / wide, stage, tier), y - high + (down + times) * tall
            (left, top), (right, bottom) = form.reach * [times * wide, times * tall] + [x, foot_y]
            found.append((form, np.array([[left, top], [right, top], [right, bottom], [left, bottom]])))
        return found

    def trunk(self) -> Floats:
        """(n, 2) px of the unmoved camera: the trunk below the crown, and a little into it; perhaps none."""
        (x, y), high, (wide, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        if high <= tall:
            return np.empty((0, 2))
        _, times = _stacked(self.tiers or 1)[-1]
        thin, thick, top = THICK * wide / 2, FLARE * THICK * times * wide / 2, y - high + 0.95 * tall
        return np.array([[x - thin, top], [x + thin, top], [x + thick, y], [x - thick, y]])

    def extent(self, stage: Stage) -> Box:
        return bounds(np.concatenate([*(corners for _, corners in self.crowns(stage)), self.trunk()]))

    def over(self, window: Box, share: float, stage: Stage) -> Tree:
        # The core's ellipse goes through the window's corners, and the crown is about as high as wide.
        aside, above = (CORE * function(CORNER) for function in (math.sin, math.cos))
        wide = window.w / aside
        tall = max(window.h / above, 0.9 * wide)
        # Beyond its core this crown has no gaps in places: as a smaller one it hides the window, and less else.
        times, (right, down) = _gapless(self._form(tall / wide, stage), window.w / wide, window.h / tall)
        wide, tall = wide / times, tall / times
        x, top = window.cx - right * wide, window.cy - (1 + down) * tall
        y = max(foot(window, stage)[1], top + LEAST_TRUNK * tall)
        tiers = self.tiers or _tiers((y - top) / tall)
        return self.at(foot_px=(x, y), height_px=y - top, crown_px=(wide, tall), tiers=tiers)

    def rooted(self, y: float) -> Tree:
        (x, foot_y), high, (_, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        shorter = min(foot_y - y, high - LEAST_TRUNK * tall)
        if shorter <= 0:
            return self
        tiers = min(self.tiers or 1, _tiers((high - shorter) / tall))
        return self.at(foot_px=(x, foot_y - shorter), height_px=high - shorter, tiers=tiers)

    def _form(self, slim: float, stage: Stage, tier: int = 0) -> Form:
        """A crown of its, so many times as high as wide."""
        proportion = round(PROPORTIONS * min(max(math.log2(slim), -SLIMMEST), SLIMMEST)) / PROPORTIONS
        return _form(proportion, self.leaves, stage.seed, f"{self.name} {tier}" if tier else self.name)


def _stacked(tiers: int) -> list[tuple[float, float]]:
    """For crowns one below the other: how far each top lies below the tree's, and its size, in those of the first."""
    sizes = [WIDER**tier for tier in range(tiers)]
    return list(zip(accumulate((LOWER * size for size in sizes[:-1]), initial=0.0), sizes, strict=True))


def _tiers(slim: float) -> int:
    """How many crowns a tree has that is so many times as high as its top one."""
    if slim <= LONE:
        return 1
    reach = (down + size for down, size in _stacked(MOST_TIERS))
    return max(sum(bottom <= (1 - BARE) * slim for bottom in reach), 1)


@dataclass(frozen=True, eq=False)
class Form:
    """A crown without a size: arrays (rows, cols).

    leaves  where they hide what is behind;  warmth  of mean 0 and variance 1 over them
    wood    where boughs are, behind the leaves
    reach   (2, 2): left, top and right, bottom of the arrays from the crown's foot, in widths and heights of it
    """

    leaves: Mask
    warmth: Floats
    wood: Mask
    reach: Floats


@lru_cache(maxsize=32)
def _form(proportion: float, leaves: float, seed: int, name: str) -> Form:
    """A crown whose height to width is 2 ** proportion."""
    draw = stream(seed, name, "crown")
    high, wide = CELLS * min(1.0, 2**proportion), CELLS * min(1.0, 2**-proportion)
    crown = broadleaf(high, wide, draw)
    rows, columns = crown.depth.shape
    x, y = np.arange(columns) - crown.middle, np.arange(rows) - (rows - 1)
    off = np.hypot(2 * x[None, :] / wide, 2 * y[:, None] / high + 1)  # 1 on the crown's ellipse
    dense = np.maximum(crown.depth, 2 * np.minimum((CORE + FADING - off) / FADING, 1))
    hides, warmth = Foliage(CELLS, leaves, seed, name).grown(Crown(dense, crown.shade, crown.middle), draw)
    boughs = np.zeros((rows, columns), np.uint8)
    for limb in wood(high, wide, THICK * wide, draw):
        cv2.fillConvexPoly(
            boughs, np.rint((limb + np.array([crown.middle, rows - 1])) * 16).astype(np.int32), 1, shift=4
        )
    filled = hides | (boughs > 0)
    top, bottom, left, right = (ends for axis in (1, 0) for ends in np.flatnonzero(filled.any(axis=axis))[[0, -1]])
    part = slice(top, bottom + 1), slice(left, right + 1)
    reach = np.array([[left, top], [right + 1, bottom + 1]]) - [crown.middle + 0.5, rows]
    even = (warmth - warmth[hides].mean()) / warmth[hides].std()
    return arrays_frozen(Form(hides[part], even[part].astype(np.float32), boughs[part] > 0, reach / [wide, high]))


def _gapless(form: Form, wide: float, tall: float) -> tuple[float, Floats]:
    """How many times larger a rectangle may be that lies where a crown has no gaps, and (2,) its middle then.

    wide, tall: of the rectangle, in widths and heights of the crown, as the middle is, from the crown's foot; so
    large it fits into the core about the crown's middle.
    """
    sums = cv2.integral((form.leaves | form.wood).astype(np.uint8))
    cells = np.array(form.leaves.shape[::-1]) / (form.reach[1] - form.reach[0])
    fits, middle, too_large = 1.0, CENTRE, 1 / CORE**2
    for _ in range(HALVINGS):
        times = (fits + too_large) / 2
        columns, rows = np.ceil(times * np.array([wide, tall]) * cells).astype(int) + 2 * RIM
        whole = sums[rows:, columns:] - sums[:-rows, columns:] - sums[rows:, :-columns] + sums[:-rows, :-columns]
        corners = np.argwhere(whole == rows * columns)[:, ::-1]
        if len(corners):
            middles = (corners + np.array([columns, rows]) / 2) / cells + form.reach[0]
            fits, middle = times, middles[np.argmin(np.hypot(*(middles - CENTRE).T))]
        else:
            too_large = times
    return fits, middle


@lru_cache(maxsize=32)
def _lit(form: Form, leaves_k: float, spread_k: float, wood_k: float, emissivity: float, stage: Stage) -> Picture:
    """A crown's light."""
    kelvin = np.where(form.leaves, leaves_k + spread_k * form.warmth, wood_k)
    cover = (form.leaves | form.wood).astype(np.float32)
    glow = stage.glow(np.maximum(kelvin, 1.0), emissivity).astype(np.float32)
    return arrays_frozen(Picture(np.stack([cover, cover * glow], axis=-1)))


@lru_cache(maxsize=32)
def _drawn(tree: Tree, stage: Stage, lens: Geometry, rotation: bytes, place: bytes) -> Sprite | None:
    """A tree drawn, and kept for a camera that stands still."""
    sight = Sight(stage, lens, np.frombuffer(rotation).reshape(3, 3), np.frombuffer(place))
    forms, corners = zip(*tree.crowns(stage), strict=True)
    *crowns, trunk = (sight.pixels(points, tree.range_m) for points in (*corners, tree.trunk()))
    points = np.concatenate([*crowns, trunk])
    box = bounds(points)
    window = within_sight(box, stage) if np.isfinite(points).all() else None
    if window is None:
        return None
    grid = Grid.over(window)
    heat = tree.temperature_k, tree.spread_k, tree.trunk_k, tree.emissivity
    pictures = (_lit(form, *heat, stage).fields(crown, grid) for form, crown in zip(forms, crowns, strict=True))
    fields = reduce(_before, pictures)
    if len(trunk):
        start, stop = ((end - grid.corner) * grid.fine for end in outline(trunk))
        light = np.array([[1.0, float(stage.glow(tree.trunk_k, tree.emissivity))]])
        fields = _before(fields, coverage(start, stop, np.repeat(light, len(start), axis=0), grid.cells))
    middle = np.array([box.cx, box.cy])
    area = float(fields[0, 0].sum()) / grid.fine**2
    drawn = spread(grid, as_changes(fields), (middle, middle), area, box, stage.psf, tree.range_m)
    return arrays_frozen(drawn)


def _before(near: Floats, far: Floats) -> Floats:
    """Areas and moments (3, 2, rows, columns) of (cover, light) of one thing before another.

    Within a cell each covers the other by chance.
    """
    both = near + far * (1 - near[0, :1])
    both[1:] -= far[0] * near[1:, :1]
    return both
