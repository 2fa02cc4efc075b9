"""An occluding broadleaf tree: trunk, boughs and one or several crowns."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import reduce
from itertools import accumulate
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import Fraction, Kelvin, KelvinSpread, Pair, Positive
from irsim.errors import counted
from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import as_row_differences, coverage, polygon_edges
from irsim.geometry.pose import CameraPose
from irsim.geometry.silhouette import Grid, blur_to_pixels, clip_to_view
from irsim.geometry.sprite import Sprite
from irsim.occluders.base import Occluder, Size, bounding_box, cached_by_pose, misplaced, required
from irsim.occluders.crown import (
    BARK,
    CORE,
    THICK,
    CrownTexture,
    TreeTemperatures,
    crown_light,
    crown_texture,
    largest_gapless,
    projected_fields,
)
from irsim.occluders.solid import foot_below_picture
from irsim.rng import stream
from irsim.types import Box, Floats, arrays_frozen

CORNER = math.radians(60.0)
"""Angle from the vertical at which the corners of a covered window lie, seen from the crown's middle."""
LEAST_TRUNK = 1.15
"""Least height of a tree placed by `hides`, in heights of its crown."""
FLARE = 1.35
"""Ratio of the trunk's width at its foot to its width at the crown."""
LEVELS = np.array([0.0, 0.25, 0.5, 0.7, 0.85, 1.0])
"""Ends of the trunk's pieces, as shares of its length from the top. Pieces are shorter towards the foot, where the
trunk widens most."""
STRIPS = 6
"""Number of pieces across the trunk, from its lit side to its dark one."""
ROUND = 0.3
"""Rise of the foot's edges above its middle, as a share of its width: a round trunk seen from above."""
STREAKS = 0.4
"""Ratio of the standard deviation of temperature between pieces of the trunk to that between leaves."""
LONE = 1.8
"""Largest height of a tree that gets one crown by default, in heights of the crown."""
LOWER = 0.38
"""Distance of a crown's top below the top of the crown above, in heights of the crown above."""
WIDER = 1.25
"""Size of a crown relative to the crown above."""
MOST_TIERS = 20
"""Largest number of crowns of a tree."""
LEAVES_K = 290.0
"""Default temperature of leaves, K."""
WARMER_K = 1.0
"""Default temperature of the trunk minus that of the leaves, K."""
BARE = 0.12
"""Share of a tree's height, above the foot, that a default number of crowns leaves free."""
NEARLY = 1e-9
"""Rounding tolerance of a crown's lower end, as a share of its height."""


class Tree(Occluder):
    """A broadleaf tree: a trunk, boughs, and a ragged crown of clumps of leaves with gaps towards its rim."""

    placement_keys: ClassVar[tuple[str, ...]] = ("foot_px", "height_px", "crown_px")
    slender: ClassVar[bool] = True

    temperature_k: Kelvin | None = None
    """Mean temperature of the leaves, kelvin; default: the temperature of foliage at the background's `hour`, or 290
    without an hour."""
    emissivity: Fraction = 0.95
    """Emissivity."""
    foot_px: Pair | None = None
    """[x, y] of the middle of the foot, px of the unmoved camera."""
    height_px: Positive | None = None
    """Height from foot to top, px of the unmoved camera."""
    crown_px: Size | None = None
    """[width, height] of the crown, px of the unmoved camera."""
    tiers: Annotated[int, Field(ge=1, le=MOST_TIERS)] | None = None
    """Number of stacked crowns, each larger than the one above, as on a fir; all end above the foot. Default: 1, or
    with `hides` as many as the trunk has room for; the top crown then hides the target. With `hides` a number too large
    for the height above the ground is reduced, with a warning."""
    leaves: Fraction = 0.8
    """Opaque share of the outer part of the crown: 0.4 is a bare tree. The middle is always opaque."""
    trunk_k: Kelvin | None = None
    """Temperature of trunk and boughs, kelvin; default: 1 K above the temperature of foliage at the background's
    `hour`, or 291 without an hour."""
    spread_k: KelvinSpread = 1.0
    """Standard deviation of temperature within the crown, kelvin: the lit sides of crown, trunk and clumps are
    warmer."""

    @model_validator(mode="after")
    def _crowns_end_above_the_foot(self) -> Self:
        if self.hides is None and self.height_px is not None and self.crown_px is not None:
            high, tall, tiers = self.height_px, self.crown_px[1], self.tiers or 1
            most = _fitting(high / tall)
            if most == 0:
                deep = f"its crown would reach {tall - high:.4g} px below its foot"
                raise misplaced("crown_px", f"{deep}; allowed: {high:g} px high at most")
            if most < tiers:
                deep = f"so many crowns end {tall * _lower_ends()[tiers - 1] - high:.4g} px below its foot"
                raise misplaced("tiers", f"{deep}; allowed: {most} at most in {high:g} px")
        return self

    def draw(self, pose: CameraPose) -> Sprite | None:
        return _draw_tree(self, pose)

    def crowns(self, context: SceneContext) -> list[tuple[CrownTexture, Floats]]:
        """Return each crown's texture and its corners (4, 2), px of the unmoved camera; the top crown first."""
        (x, y), high, (wide, tall) = required(self.foot_px), required(self.height_px), required(self.crown_px)
        found = []
        for tier, (down, times) in enumerate(_stacked(self.tiers or 1)):
            texture, foot_y = self._texture(tall / wide, context, tier), y - high + (down + times) * tall
            (left, top), (right, bottom) = texture.reach * [times * wide, times * tall] + [x, foot_y]
            found.append((texture, np.array([[left, top], [right, top], [right, bottom], [left, bottom]])))
        return found

    def trunk(self, context: SceneContext) -> tuple[Floats, Floats]:
        """Return corners (n, 4, 2), px of the unmoved camera, and temperatures (n,), K, of the trunk's pieces.

        The trunk reaches a little into the lowest crown; n is 0 if the crown reaches the foot.
        """
        (x, y), high, (wide, tall) = required(self.foot_px), required(self.height_px), required(self.crown_px)
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
        """Return the mean temperatures of the leaves and of the trunk, kelvin."""
        usual_k = LEAVES_K if context.leaves_k is None else context.leaves_k
        leaves_k = usual_k if self.temperature_k is None else self.temperature_k
        return leaves_k, usual_k + WARMER_K if self.trunk_k is None else self.trunk_k

    def extent(self, context: SceneContext) -> Box:
        pieces, _ = self.trunk(context)
        return bounding_box(np.concatenate([*(corners for _, corners in self.crowns(context)), pieces.reshape(-1, 2)]))

    def covering(self, window: Box, density: float, context: SceneContext) -> Tree:
        # The ellipse of the core passes through the window's corners, and the crown is about as high as wide.
        aside, above = (CORE * function(CORNER) for function in (math.sin, math.cos))
        wide = window.w / aside
        tall = max(window.h / above, 0.9 * wide)
        # Parts of the crown beyond its core are gapless too, so a smaller crown, which hides less, covers the window.
        times, (right, down) = largest_gapless(self._texture(tall / wide, context), window.w / wide, window.h / tall)
        wide, tall = wide / times, tall / times
        x, top = window.cx - right * wide, window.cy - (1 + down) * tall
        least = max(LEAST_TRUNK, _lower_ends()[self.tiers - 1]) if self.tiers else LEAST_TRUNK
        y = max(foot_below_picture(window, context)[1], top + least * tall)
        tiers = self.tiers or _tiers((y - top) / tall)
        return self.placed(foot_px=(x, y), height_px=y - top, crown_px=(wide, tall), tiers=tiers)

    def standing_at(self, y: float) -> Tree:
        (x, foot_y), high, (_, tall) = required(self.foot_px), required(self.height_px), required(self.crown_px)
        shorter = min(foot_y - y, high - LEAST_TRUNK * tall)
        if shorter <= 0:
            return self
        tiers = min(self.tiers or 1, _tiers((high - shorter) / tall))
        return self.placed(foot_px=(x, foot_y - shorter), height_px=high - shorter, tiers=tiers)

    def shortfall(self, placed: Occluder) -> tuple[str, str] | None:
        if not isinstance(placed, Tree) or not self.tiers or required(placed.tiers) >= self.tiers:
            return None
        high, (_, tall) = required(placed.height_px), required(placed.crown_px)
        needed = _lower_ends()[self.tiers - 1] * tall
        return "tiers", (
            f"it has {counted(required(placed.tiers), 'crown')}: the top one, which hides {self.hides}, is {tall:.0f} "
            f"px high, so {self.tiers} of them need a tree {needed:.0f} px high, but its top is {high:.0f} px "
            f"above the ground; try a range_m nearer to the camera, or foot_px, height_px and crown_px"
        )

    def _texture(self, slim: float, context: SceneContext, tier: int = 0) -> CrownTexture:
        """Return the texture of a crown whose height is `slim` times its width."""
        return crown_texture(slim, self.leaves, context, f"{self.name} {tier}" if tier else self.name)


def _stacked(tiers: int) -> list[tuple[float, float]]:
    """Return for each crown from the top its offset below the tree's top and its height, in heights of the top
    crown."""
    sizes = [WIDER**tier for tier in range(tiers)]
    return list(zip(accumulate((LOWER * size for size in sizes[:-1]), initial=0.0), sizes, strict=True))


def _lower_ends() -> list[float]:
    """Return how far below the tree's top each of MOST_TIERS stacked crowns ends, in heights of the top crown."""
    return [down + size for down, size in _stacked(MOST_TIERS)]


def _fitting(slim: float) -> int:
    """Return the largest number of crowns of a tree whose height is `slim` heights of its top crown."""
    return bisect_right(_lower_ends(), (1 + NEARLY) * slim)


def _tiers(slim: float) -> int:
    """Return the default number of crowns of a tree whose height is `slim` heights of its top crown."""
    return 1 if slim <= LONE else max(_fitting((1 - BARE) * slim), 1)


@cached_by_pose
def _draw_tree(tree: Tree, pose: CameraPose) -> Sprite | None:
    context = pose.context
    textures, corners = zip(*tree.crowns(context), strict=True)
    pieces, kelvin = tree.trunk(context)
    *crowns, trunk = (pose.pixels(points, tree.range_m) for points in (*corners, pieces.reshape(-1, 2)))
    points = np.concatenate([*crowns, trunk])
    box = bounding_box(points)
    window = clip_to_view(box, pose.zoomed) if np.isfinite(points).all() else None
    if window is None:
        return None
    grid = Grid.over(window)
    temperatures = TreeTemperatures(*tree.warmth(context), tree.spread_k, tree.emissivity)
    several, below = len(textures) > 1, range(len(textures) - 1, -1, -1)
    pictures = (
        projected_fields(crown_light(texture, temperatures, lower == 0, several, context), crown, grid)
        for texture, crown, lower in zip(textures, crowns, below, strict=True)
    )
    fields = reduce(_in_front, pictures)
    if len(trunk):
        ends = [polygon_edges(piece) for piece in trunk.reshape(-1, 4, 2)]
        start, stop = ((np.concatenate(end) - grid.corner) * grid.fine for end in zip(*ends, strict=True))
        light = np.stack([np.ones(len(kelvin)), context.grey_body_radiance(kelvin, tree.emissivity)], axis=1)
        fields = _in_front(fields, coverage(start, stop, np.repeat(light, 4, axis=0), grid.cells))
    middle = np.array([box.cx, box.cy])
    area = float(fields[0, 0].sum()) / grid.fine**2
    distance_m = pose.distance_m(bounding_box(np.concatenate([*corners, pieces.reshape(-1, 2)])), tree.range_m)
    differences, centers = as_row_differences(fields), (middle, middle)
    return arrays_frozen(blur_to_pixels(grid, differences, centers, area, box, pose.zoomed.psf, distance_m))


def _in_front(near: Floats, far: Floats) -> Floats:
    """Return areas and moments of cover and radiance, (3, 2, rows, columns), of a near picture in front of a far one.

    Within a cell the two pictures are assumed to overlap at random.
    """
    both = near + far * (1 - near[0, :1])
    both[1:] -= far[0] * near[1:, :1]
    return both
