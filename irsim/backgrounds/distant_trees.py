"""Woods along the horizon: what stands before the sky between the trees of a row."""

from __future__ import annotations

import numpy as np

from irsim.backgrounds.panorama import Sheet
from irsim.backgrounds.structures import Trees, grain
from irsim.geometry.random_fields import profile
from irsim.types import Floats

TREE_M = 15.0
"""Height of their trees: so they are as far away as these are that high."""
TYPICAL_MRAD = 1.5
"""Height of woods far away, mrad: at 10 km."""

STRETCH = 40.0
"""Length of woods, about, and of what is open between them, in their mean heights."""
TREES = 2.0
"""And of their crowns, in the same."""
VARIED = 0.8
"""Standard deviation of the height of woods along the horizon, as a share of the mean."""
HEDGE = 0.4
"""Where there are none, hedges are so high, as a share of it."""
RAGGED = 0.35
"""How much crowns stand out, as a share of the height."""
TALLEST = 2.5
"""None is so many times as high as the mean: heights come near it as a hyperbolic tangent does."""
DEEP = 0.6
"""How far their edge comes down over the ground, as a share of their height."""


def woods(sheet: Sheet, edge: Floats, mean_px: float, row: Trees, trees_k: float, seed: int) -> tuple[Floats, Floats]:
    """Cover 0..1 and temperature, K, (rows, cols) of a sheet each, of woods of a mean height, above 0, along the edge
    of ground that is at rows (cols,) of the map.

    row, trees_k  nearer trees, like which they vary, and their temperature
    """
    stretch, trees, hem = (
        profile(len(sheet.columns), beta, size * mean_px, seed, "far woods", what)
        for beta, size, what in ((3.0, STRETCH, "stretches"), (3.2, TREES, "trees"), (3.0, STRETCH / 4, "hem"))
    )
    dense = np.maximum(1 + VARIED * stretch, HEDGE)
    high = dense * np.clip(1 + RAGGED * trees, 0.1, None)
    top = edge - mean_px * TALLEST * np.tanh(high / TALLEST)
    foot = edge + DEEP * mean_px * np.minimum(dense, 1) * np.clip(1 + hem / 2, 0.2, None)
    rows = sheet.rows[:, None]
    cover = np.clip(rows - top + 0.5, 0, 1) * np.clip(foot - rows + 0.5, 0, 1)
    warmth = trees_k + 0.8 * row.spread_k * grain(sheet, row.beta, max(mean_px, 2.0), seed, "far woods", "grain")
    return cover, warmth
