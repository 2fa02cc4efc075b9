"""A crown of a tree that hides targets: its leaves and boughs without a size, and where it has no gaps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.vegetation import LIGHT, SHADED, Crown, Foliage, broadleaf, wood
from irsim.occluders.billboard import Billboard
from irsim.rng import stream
from irsim.types import Bools, Floats, arrays_frozen

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
CENTRE = np.array([0.0, -0.5])
"""The crown's middle, in widths and heights of it from its foot."""
RIM = 1
"""Cells around what a crown is placed over that have no gap either: it is drawn between its cells."""
HALVINGS = 10
"""Of the step in which the least crown is sought: to a thousandth of its size."""
THICK = 0.065
"""The trunk's width at the crown, as a share of the crown's width."""
BARK = 0.8
"""How much warmer wood is on its lit side, and cooler on the other, in standard deviations of the leaves'."""


@dataclass(frozen=True, eq=False)
class Form:
    """A crown without a size: arrays (rows, cols).

    leaves  where they hide what is behind;  warmth  of mean 0 and variance 1 over them
    joined  their warmth where it is one of several crowns: of clumps, and of the sides of the tree alone, so that
            no crown's dark lower edge lies on the lit top of the next
    wood    where boughs are, behind the leaves;  side  how far, -1 to 1, they face the light
    reach   (2, 2): left, top and right, bottom of the arrays from the crown's foot, in widths and heights of it
    """

    leaves: Bools
    warmth: Floats
    joined: Floats
    wood: Bools
    side: Floats
    reach: Floats


def form_of(slim: float, leaves: float, context: SceneContext, name: str) -> Form:
    """A crown so many times as high as wide."""
    proportion = round(PROPORTIONS * min(max(math.log2(slim), -SLIMMEST), SLIMMEST)) / PROPORTIONS
    return _form(proportion, leaves, context.seed, name)


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
    # A trunk is lit on its left and not on its right, all the way round; a thinner bough shows less of both.
    half = max(round(THICK * wide / 2), 1)
    near = cv2.blur(boughs.astype(np.float32), (2 * half + 1, 1), borderType=cv2.BORDER_CONSTANT)
    lit_side = np.roll(near, -half, axis=1) - np.roll(near, half, axis=1)
    filled = hides | (boughs > 0)
    top, bottom, left, right = (ends for axis in (1, 0) for ends in np.flatnonzero(filled.any(axis=axis))[[0, -1]])
    part = slice(top, bottom + 1), slice(left, right + 1)
    reach = np.array([[left, top], [right + 1, bottom + 1]]) - [crown.middle + 0.5, rows]
    side = np.clip(3 * LIGHT[0] * x[None, :] / wide, -1, 1)
    even, joined = (
        ((each - each[hides].mean()) / each[hides].std())[part].astype(np.float32)
        for each in (warmth, warmth + SHADED * (side - crown.shade))
    )
    return arrays_frozen(Form(hides[part], even, joined, boughs[part] > 0, lit_side[part], reach / [wide, high]))


def gapless(form: Form, wide: float, tall: float) -> tuple[float, Floats]:
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


@dataclass(frozen=True)
class Heat:
    """Temperatures of a tree's leaves and wood, K, how they spread, and its emissivity."""

    leaves_k: float
    wood_k: float
    spread_k: float
    emissivity: float


@lru_cache(maxsize=32)
def lit(form: Form, heat: Heat, lowest: bool, several: bool, context: SceneContext) -> Billboard:
    """The light of a crown of a tree; of several, those above the lowest show no wood, since leaves of the next are
    behind its gaps."""
    kelvin = heat.leaves_k + heat.spread_k * (form.joined if several else form.warmth)
    if lowest:
        kelvin = np.where(form.leaves, kelvin, heat.wood_k + heat.spread_k * BARK * form.side)
    cover = (form.leaves | form.wood).astype(np.float32)
    glow = context.glow(np.maximum(kelvin, 1.0), heat.emissivity).astype(np.float32)
    return arrays_frozen(Billboard(np.stack([cover, cover * glow], axis=-1)))
