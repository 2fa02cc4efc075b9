"""A tree that hides targets."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import reduce
from itertools import accumulate
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, Pair, Positive
from irsim.errors import counted
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import as_changes, coverage, outline
from irsim.geometry.pose import CameraPose
from irsim.geometry.silhouette import Grid, spread, within_sight
from irsim.geometry.sprite import Sprite
from irsim.occluders.bar import Size
from irsim.occluders.base import Occluder, bounds, given, kept
from irsim.occluders.crown import BARK, CORE, THICK, Form, Heat, form_of, gapless, lit
from irsim.occluders.standing import foot
from irsim.rng import stream
from irsim.types import Box, Floats, arrays_frozen

CORNER = math.radians(60.0)
"""Seen from the crown's middle, what its core is placed over has its corners this far from upright."""
LEAST_TRUNK = 1.15
"""Placed by intent it is so many times as high as its crown at least."""
FLARE = 1.35
"""How many times wider the trunk is at its foot."""
LEVELS = np.array([0.0, 0.25, 0.5, 0.7, 0.85, 1.0])
"""The trunk is drawn in pieces that end at these shares of its way down: it widens most at its foot."""
STRIPS = 6
"""And in so many across, from its lit side to the other."""
ROUND = 0.3
"""Its foot's edges end higher than the middle by this share of its width, as of a round trunk seen from above."""
STREAKS = 0.4
"""Standard deviation of temperature between its pieces, in that of the leaves."""
LONE = 1.8
"""A tree up to so many times as high as its crown looks like one with a lone crown."""
LOWER = 0.38
"""Where a crown stands below another one: its top so much of the other one's height below the other one's top."""
WIDER = 1.25
"""How many times larger it is."""
MOST_TIERS = 20
"""Crowns of a tree."""
LEAVES_K = 290.0
"""How warm leaves are where nothing says it, K."""
WARMER_K = 1.0
"""Trunks are so much warmer."""
BARE = 0.12
"""Share of a tree's height below which no crown reaches."""
NEARLY = 1e-9
"""A crown may end so much lower than its foot, as a share of its height: numbers are rounded."""


class Tree(Occluder):
    """A broadleaf tree: a trunk, boughs, and a ragged crown of clumps of leaves with gaps towards its rim."""

    placing: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "crown_px")
    slender: ClassVar[bool] = True

    temperature_k: Kelvin | None = None
    """Mean temperature of the leaves, kelvin; by the background's `hour` where not given, else 290."""
    emissivity: Fraction = 0.95
    foot_px: Pair | None = None
    """[x, y] of the middle of its foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """From foot to top, px."""
    crown_px: Size | None = None
    """[width, height] of the crown, px."""
    tiers: Annotated[int, Field(ge=1, le=MOST_TIERS)] | None = None
    """Crowns one below the other, each larger than the one above, as of a fir; none ends below its foot. Where not
    given: one; placed by whom it hides as many as a trunk that would be long and bare takes, for its top one
    hides; fewer than are given where there is no room for them above the ground (warned of)."""
    leaves: Fraction = 0.8
    """How much of the crown's outer part hides what is behind: 0.4 is a bare tree; the middle hides all."""
    trunk_k: Kelvin | None = None
    """Temperature of trunk and boughs, kelvin; where not given 1 K above that of leaves at the background's `hour`,
    else 291."""
    spread_k: KelvinSpread = 1.0
    """Standard deviation of temperature within the crown, kelvin: the lit side is warmer, as the trunk's is, and each
    clump's."""

    @model_validator(mode="after")
    def _crowns_end_above_the_foot(self) -> Self:
        if self.hides is None and self.height_px is not None and self.crown_px is not None:
            tall, tiers = self.crown_px[1], self.tiers or 1
            deep, most = tall * _reaches()[tiers - 1], _fitting(self.height_px / tall)
            if most == 0:
                raise PydanticCustomError(
                    "crown", "its crown would reach {deep} px below its foot; allowed: {high} px high at most",
                    {"deep": f"{tall - self.height_px:.4g}", "high": f"{self.height_px:g}", "at": ("crown_px",)},
                )  # fmt: skip
            if most < tiers:
                raise PydanticCustomError(
                    "crown", "so many crowns end {deep} px below its foot; allowed: {most} at most in {high} px",
                    {
                        "deep": f"{deep - self.height_px:.4g}", "most": most, "high": f"{self.height_px:g}",
                        "at": ("tiers",),
                    },
                )  # fmt: skip
        return self

    def draw(self, pose: CameraPose) -> Sprite | None:
        return _drawn(self, pose)

    def crowns(self, context: SceneContext) -> list[tuple[Form, Floats]]:
        """Each crown with its boughs, the top one first, and the corners (4, 2) of its arrays, px of the unmoved
        camera."""
        (x, y), high, (wide, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        found = []
        for tier, (down, times) in enumerate(_stacked(self.tiers or 1)):
            form, foot_y = self._form(tall / wide, context, tier), y - high + (down + times) * tall
            (left, top), (right, bottom) = form.reach * [times * wide, times * tall] + [x, foot_y]
            found.append((form, np.array([[left, top], [right, top], [right, bottom], [left, bottom]])))
        return found

    def trunk(self, context: SceneContext) -> tuple[Floats, Floats]:
        """The trunk below its crowns, and a little into the lowest, in pieces, perhaps none: their corners (n, 4, 2),
        px of the unmoved camera, and their temperatures (n,)."""
        (x, y), high, (wide, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        down, times = _stacked(self.tiers or 1)[-1]
        if high <= (down + times) * tall:
            return np.empty((0, 4, 2)), np.empty(0)
        top, thin = y - high + (down + 0.95 * times) * tall, THICK * times * wide / 2
        across = np.linspace(-1, 1, STRIPS + 1)
        half = thin * (1 + (FLARE - 1) * LEVELS**2)
        columns = x + half[:, None] * across
        rows = np.broadcast_to((top + (y - top) * LEVELS)[:, None], columns.shape).copy()
        rows[-1] -= min(2 * ROUND * half[-1], (y - top) * (1 - LEVELS[-2]) / 2) * across**2
        corners = np.stack([columns, rows], axis=-1)
        pieces = np.stack([corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]], axis=2)
        streaks = stream(context.seed, self.name, "bark").standard_normal((len(LEVELS) - 1, STRIPS))
        facing = -(across[:-1] + across[1:]) / 2
        _, trunk_k = self.warmth(context)
        kelvin = trunk_k + self.spread_k * (BARK * facing + STREAKS * streaks)
        return pieces.reshape(-1, 4, 2), np.maximum(kelvin, 1.0).ravel()

    def warmth(self, context: SceneContext) -> tuple[float, float]:
        """Mean temperatures of the leaves and of the trunk, kelvin."""
        usual_k = LEAVES_K if context.leaves_k is None else context.leaves_k
        leaves_k = usual_k if self.temperature_k is None else self.temperature_k
        return leaves_k, usual_k + WARMER_K if self.trunk_k is None else self.trunk_k

    def extent(self, context: SceneContext) -> Box:
        pieces, _ = self.trunk(context)
        return bounds(np.concatenate([*(corners for _, corners in self.crowns(context)), pieces.reshape(-1, 2)]))

    def over(self, window: Box, share: float, context: SceneContext) -> Tree:
        # The core's ellipse goes through the window's corners, and the crown is about as high as wide.
        aside, above = (CORE * function(CORNER) for function in (math.sin, math.cos))
        wide = window.w / aside
        tall = max(window.h / above, 0.9 * wide)
        # Beyond its core this crown has no gaps in places: as a smaller one it hides the window, and less else.
        times, (right, down) = gapless(self._form(tall / wide, context), window.w / wide, window.h / tall)
        wide, tall = wide / times, tall / times
        x, top = window.cx - right * wide, window.cy - (1 + down) * tall
        least = max(LEAST_TRUNK, _reaches()[self.tiers - 1]) if self.tiers else LEAST_TRUNK
        y = max(foot(window, context)[1], top + least * tall)
        tiers = self.tiers or _tiers((y - top) / tall)
        return self.at(foot_px=(x, y), height_px=y - top, crown_px=(wide, tall), tiers=tiers)

    def rooted(self, y: float) -> Tree:
        (x, foot_y), high, (_, tall) = given(self.foot_px), given(self.height_px), given(self.crown_px)
        shorter = min(foot_y - y, high - LEAST_TRUNK * tall)
        if shorter <= 0:
            return self
        tiers = min(self.tiers or 1, _tiers((high - shorter) / tall))
        return self.at(foot_px=(x, foot_y - shorter), height_px=high - shorter, tiers=tiers)

    def short(self, placed: Occluder) -> tuple[str, str] | None:
        if not isinstance(placed, Tree) or not self.tiers or given(placed.tiers) >= self.tiers:
            return None
        high, (_, tall) = given(placed.height_px), given(placed.crown_px)
        needed = _reaches()[self.tiers - 1] * tall
        return "tiers", (
            f"it has {counted(given(placed.tiers), 'crown')}: the top one, which hides {self.hides}, is {tall:.0f} px "
            f"high, so {self.tiers} of them need a tree {needed:.0f} px high, and from its top to the ground are "
            f"{high:.0f}; try a range_m nearer to the camera, or foot_px, height_px and crown_px"
        )

    def _form(self, slim: float, context: SceneContext, tier: int = 0) -> Form:
        """A crown of its, so many times as high as wide."""
        return form_of(slim, self.leaves, context, f"{self.name} {tier}" if tier else self.name)


def _stacked(tiers: int) -> list[tuple[float, float]]:
    """For crowns one below the other: how far each top lies below the tree's, and its size, in those of the first."""
    sizes = [WIDER**tier for tier in range(tiers)]
    return list(zip(accumulate((LOWER * size for size in sizes[:-1]), initial=0.0), sizes, strict=True))


def _reaches() -> list[float]:
    """How far below a tree's top each of its crowns ends, in heights of the first."""
    return [down + size for down, size in _stacked(MOST_TIERS)]


def _fitting(slim: float) -> int:
    """How many crowns end above the foot of a tree that is so many times as high as its top one."""
    return bisect_right(_reaches(), (1 + NEARLY) * slim)


def _tiers(slim: float) -> int:
    """How many crowns such a tree has where that is not given."""
    return 1 if slim <= LONE else max(_fitting((1 - BARE) * slim), 1)


@kept
def _drawn(tree: Tree, pose: CameraPose) -> Sprite | None:
    """A tree drawn."""
    context = pose.context
    forms, corners = zip(*tree.crowns(context), strict=True)
    pieces, kelvin = tree.trunk(context)
    *crowns, trunk = (pose.pixels(points, tree.range_m) for points in (*corners, pieces.reshape(-1, 2)))
    points = np.concatenate([*crowns, trunk])
    box = bounds(points)
    window = within_sight(box, pose.zoomed) if np.isfinite(points).all() else None
    if window is None:
        return None
    grid = Grid.over(window)
    heat = Heat(*tree.warmth(context), tree.spread_k, tree.emissivity)
    several, below = len(forms) > 1, range(len(forms) - 1, -1, -1)
    pictures = (
        lit(form, heat, lower == 0, several, context).fields(crown, grid)
        for form, crown, lower in zip(forms, crowns, below, strict=True)
    )
    fields = reduce(_before, pictures)
    if len(trunk):
        ends = [outline(piece) for piece in trunk.reshape(-1, 4, 2)]
        start, stop = ((np.concatenate(end) - grid.corner) * grid.fine for end in zip(*ends, strict=True))
        light = np.stack([np.ones(len(kelvin)), context.glow(kelvin, tree.emissivity)], axis=1)
        fields = _before(fields, coverage(start, stop, np.repeat(light, 4, axis=0), grid.cells))
    middle = np.array([box.cx, box.cy])
    area = float(fields[0, 0].sum()) / grid.fine**2
    away_m = pose.away_m(bounds(np.concatenate([*corners, pieces.reshape(-1, 2)])), tree.range_m)
    drawn = spread(grid, as_changes(fields), (middle, middle), area, box, pose.zoomed.psf, away_m)
    return arrays_frozen(drawn)


def _before(near: Floats, far: Floats) -> Floats:
    """Areas and moments (3, 2, rows, columns) of (cover, light) of one thing before another.

    Within a cell each covers the other by chance.
    """
    both = near + far * (1 - near[0, :1])
    both[1:] -= far[0] * near[1:, :1]
    return both
