"""Woods at the edge of the farthest ground: what stands before the sky between the trees of a row."""

from __future__ import annotations

import numpy as np

from irsim.backgrounds.fields import profile
from irsim.backgrounds.panorama import Sheet
from irsim.backgrounds.structures import Trees, grain
from irsim.types import Floats

TYPICAL_MRAD = 1.5
"""Height of woods far away, mrad: trees of 15 m at 10 km."""

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
TALLEST = 4.0
"""Hardly any is so many times as high as the mean."""
DEEP = 0.6
"""How far their edge comes down over the ground, as a share of their height."""


Ground = tuple[Floats, Floats]
"""Temperature, K, and cover 0..1, (rows, cols) of a sheet each."""


def wooded(
    sheet: Sheet, edge: Floats, bare: Ground, mean_px: float, row: Trees, trees_k: float, seed: int
) -> tuple[Ground, Floats]:
    """Ground whose edge is at rows (cols,) of the map with woods of a mean height along it, and what these leave of its
    bare cover to what lies on it, (rows, cols).

    row, trees_k  nearer trees, like which they vary, and their temperature
    """
    kelvin, cover = bare
    if mean_px == 0:
        return bare, cover
    stretch, trees, hem = (
        profile(len(sheet.columns), beta, size * mean_px, seed, "far woods", what)
        for beta, size, what in ((3.0, STRETCH, "stretches"), (3.2, TREES, "trees"), (3.0, STRETCH / 4, "hem"))
    )
    dense = np.maximum(1 + VARIED * stretch, HEDGE)
    top = edge - mean_px * np.minimum(dense * np.clip(1 + RAGGED * trees, 0.1, None), TALLEST)
    foot = edge + DEEP * mean_px * np.minimum(dense, 1) * np.clip(1 + hem / 2, 0.2, None)
    rows = sheet.rows[:, None]
    hidden = np.clip(foot - rows + 0.5, 0, 1)
    warmth = trees_k + 0.8 * row.spread_k * grain(sheet, row.beta, max(mean_px, 2.0), seed, "far woods", "grain")
    return (kelvin + hidden * (warmth - kelvin), np.clip(rows - top + 0.5, 0, 1)), cover * (1 - hidden)
