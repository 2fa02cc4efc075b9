"""The crown of an occluding tree: masks of leaves and wood, the largest window without gaps, and radiance.

Numbers without a source were chosen by eye.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.silhouette import Grid
from irsim.geometry.vegetation import LIGHT, SHADED, Crown, Foliage, broadleaf, wood
from irsim.rng import stream
from irsim.types import Bools, Floats, arrays_frozen

CELLS = 512
"""Cells along the longer side of a crown's texture."""
PROPORTIONS = 4
"""Number of textures per factor of two in the ratio of height to width. The nearest one is stretched to ratios in
between."""
SLIMMEST = 3.0
"""Largest log2 of the ratio of height to width for which textures exist; for slimmer crowns they are stretched."""
CORE = 0.6
"""Extent of the gapless elliptic core, as a share of the crown's width and height."""
FADING = 0.2
"""Width of the transition from the core to leaves with gaps, as a share of the crown's width and height."""
CENTRE = np.array([0.0, -0.5])
"""Middle (x, y) of the crown relative to its foot, in widths and heights of the crown."""
RIM = 1
"""Margin without gaps around a covered window, cells; drawing interpolates between cells."""
HALVINGS = 10
"""Bisection steps of `largest_gapless`, which give the size of the crown to a thousandth."""
THICK = 0.065
"""Width of the trunk at the crown, as a share of the crown's width."""
BARK = 0.8
"""Temperature excess of wood on its lit side, and deficit on the other, in standard deviations of leaf temperature."""
SAMPLES = 2
"""Texture samples on each axis of a grid cell, at the middles of its quarters."""


@dataclass(frozen=True, eq=False)
class CrownTexture:
    """Texture of a crown of any size and temperature; arrays are (rows, cols).

    leaves  mask of opaque leaves
    warmth  temperature pattern of a lone crown, of mean 0 and variance 1 over the leaves
    joined  warmth of one of several stacked crowns: shaded from side to side only, so that no dark lower edge lies on
            the lit top of the next crown
    wood    mask of boughs behind the leaves
    side    illumination of the boughs, -1 (dark side) to 1 (lit side)
    reach   (2, 2) left, top and right, bottom of the arrays from the crown's foot, in widths and heights of the crown
    """

    leaves: Bools
    warmth: Floats
    joined: Floats
    wood: Bools
    side: Floats
    reach: Floats


def crown_texture(slim: float, leaves: float, context: SceneContext, name: str) -> CrownTexture:
    """Return the texture of a crown whose height is `slim` times its width."""
    proportion = round(PROPORTIONS * min(max(math.log2(slim), -SLIMMEST), SLIMMEST)) / PROPORTIONS
    return _texture(proportion, leaves, context.seed, name)


@lru_cache(maxsize=32)
def _texture(proportion: float, leaves: float, seed: int, name: str) -> CrownTexture:
    """Return the texture of a crown whose height is 2 ** `proportion` times its width."""
    draw = stream(seed, name, "crown")
    high, wide = CELLS * min(1.0, 2**proportion), CELLS * min(1.0, 2**-proportion)
    crown = broadleaf(high, wide, draw)
    rows, columns = crown.depth.shape
    x, y = np.arange(columns) - crown.middle, np.arange(rows) - (rows - 1)
    radius = np.hypot(2 * x[None, :] / wide, 2 * y[:, None] / high + 1)  # 1 on the crown's ellipse
    dense = np.maximum(crown.depth, 2 * np.minimum((CORE + FADING - radius) / FADING, 1))
    opaque, warmth = Foliage(CELLS, leaves, seed, name).leaves_of(Crown(dense, crown.shade, crown.middle), draw)
    boughs = np.zeros((rows, columns), np.uint8)
    for limb in wood(high, wide, THICK * wide, draw):
        cv2.fillConvexPoly(
            boughs, np.rint((limb + np.array([crown.middle, rows - 1])) * 16).astype(np.int32), 1, shift=4
        )
    # A round trunk is lit on its left and dark on its right; thinner boughs less so.
    half = max(round(THICK * wide / 2), 1)
    near = cv2.blur(boughs.astype(np.float32), (2 * half + 1, 1), borderType=cv2.BORDER_CONSTANT)
    lit_side = np.roll(near, -half, axis=1) - np.roll(near, half, axis=1)
    filled = opaque | (boughs > 0)
    top, bottom, left, right = (ends for axis in (1, 0) for ends in np.flatnonzero(filled.any(axis=axis))[[0, -1]])
    part = slice(top, bottom + 1), slice(left, right + 1)
    reach = np.array([[left, top], [right + 1, bottom + 1]]) - [crown.middle + 0.5, rows]
    side = np.clip(3 * LIGHT[0] * x[None, :] / wide, -1, 1)
    lone, joined = (
        ((each - each[opaque].mean()) / each[opaque].std())[part].astype(np.float32)
        for each in (warmth, warmth + SHADED * (side - crown.shade))
    )
    return arrays_frozen(
        CrownTexture(opaque[part], lone, joined, boughs[part] > 0, lit_side[part], reach / [wide, high])
    )


def largest_gapless(texture: CrownTexture, wide: float, tall: float) -> tuple[float, Floats]:
    """Return the largest scale factor at which a rectangle covers no gaps of a crown, and the rectangle's middle (2,).

    wide, tall  size of the rectangle at factor 1, at which it fits into the core of the crown

    All lengths are in crown widths and heights; the middle is relative to the crown's foot.
    """
    sums = cv2.integral((texture.leaves | texture.wood).astype(np.uint8))
    cells = np.array(texture.leaves.shape[::-1]) / (texture.reach[1] - texture.reach[0])
    fits, middle, too_large = 1.0, CENTRE, 1 / CORE**2
    for _ in range(HALVINGS):
        times = (fits + too_large) / 2
        columns, rows = np.ceil(times * np.array([wide, tall]) * cells).astype(int) + 2 * RIM
        covered = sums[rows:, columns:] - sums[:-rows, columns:] - sums[rows:, :-columns] + sums[:-rows, :-columns]
        corners = np.argwhere(covered == rows * columns)[:, ::-1]
        if len(corners):
            middles = (corners + np.array([columns, rows]) / 2) / cells + texture.reach[0]
            fits, middle = times, middles[np.argmin(np.hypot(*(middles - CENTRE).T))]
        else:
            too_large = times
    return fits, middle


@dataclass(frozen=True)
class TreeTemperatures:
    """Mean temperatures of leaves and wood, K, their standard deviation, K, and the emissivity of the tree."""

    leaves_k: float
    wood_k: float
    spread_k: float
    emissivity: float


def projected_fields(light: Floats, corners: Floats, grid: Grid) -> Floats:
    """Return area, y moment and x moment of cover and radiance in the cells of a grid, (3, 2, rows, columns).

    light    (rows, cols, 2) float32 cover and radiance of a flat upright picture (`crown_light`)
    corners  (4, 2) px, projected outer corners of the picture, clockwise from the top left one

    The picture is averaged to the size of the samples, then sampled in the quarters of each cell. This keeps its area
    and blurs it by half a cell.
    """
    rows, columns, _ = light.shape
    own = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], np.float32)
    places = (corners - grid.corner) * grid.fine * SAMPLES
    to_places = cv2.getPerspectiveTransform(own, places.astype(np.float32))
    size = SAMPLES * grid.cells[1], SAMPLES * grid.cells[0]
    edge = np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1)
    fewer = [max(1, min(length, round(float(seen)))) for length, seen in ((columns, edge[1]), (rows, edge[2]))]
    averaged = cv2.resize(light, fewer, interpolation=cv2.INTER_AREA)
    shrink = np.diag([columns / fewer[0], rows / fewer[1], 1.0])
    middles = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])
    matrix = np.linalg.inv(middles) @ to_places @ shrink @ middles
    seen = cv2.warpPerspective(averaged, matrix, size, flags=cv2.INTER_LINEAR)
    quarters = seen.reshape(grid.cells[0], SAMPLES, grid.cells[1], SAMPLES, 2)
    upper, lower = quarters[:, 0], quarters[:, 1]
    whole, change = upper + lower, lower - upper
    # The middle of a quarter lies a quarter of the cell from the cell's middle.
    area = (whole[:, :, 0] + whole[:, :, 1]) / 4
    down, right = (change[:, :, 0] + change[:, :, 1]) / 16, (whole[:, :, 1] - whole[:, :, 0]) / 16
    return np.moveaxis(np.stack([area, down, right]).astype(np.float64), -1, 1)


@lru_cache(maxsize=32)
def crown_light(
    texture: CrownTexture, temperatures: TreeTemperatures, lowest: bool, several: bool, context: SceneContext
) -> Floats:
    """Return cover, 0..1, and cover times radiance, W/m2/sr, of the cells of a crown, (rows, cols, 2) float32.

    Of `several` stacked crowns only the lowest shows wood; behind the gaps of the others lie leaves of the next crown.
    """
    warmth = texture.joined if several else texture.warmth
    kelvin = temperatures.leaves_k + temperatures.spread_k * warmth
    if lowest:
        wood_k = temperatures.wood_k + temperatures.spread_k * BARK * texture.side
        kelvin = np.where(texture.leaves, kelvin, wood_k)
    cover = (texture.leaves | texture.wood).astype(np.float32)
    glow = context.grey_body_radiance(np.maximum(kelvin, 1.0), temperatures.emissivity).astype(np.float32)
    light = np.stack([cover, cover * glow], axis=-1)
    light.flags.writeable = False
    return light
