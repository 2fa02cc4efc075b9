"""The centroid of what stands out in a gate: the plainest measurement of a target's place."""

from __future__ import annotations

import numpy as np

from irsim.types import Image


def contrast(patch: Image, region: Image) -> float:
    """How far the target stands out, counts: positive for a hot one, negative for a cold one.

    `region` holds the patch and what surrounds it; its median is the level. The target's own level
    is the quartile of its patch on the side of its mean: a silhouette fills only part of its box.
    """
    level = float(np.median(region))
    hot = float(patch.mean()) >= level
    return float(np.percentile(patch, 75 if hot else 25)) - level


def centroid(region: Image, contrast: float, threshold: float) -> tuple[float, float] | None:
    """(x, y) of what passes `threshold` times the contrast, weighted by its excess, region's px.

    The level is the region's median, so the region should be at least twice as large as the target.
    None where nothing passes; with a contrast of zero there is nothing to look for.
    """
    if contrast == 0:
        return None
    excess = np.maximum((region - np.median(region)) / contrast - threshold, 0)
    total = float(excess.sum())
    if total <= 0:
        return None
    x = float(excess.sum(axis=0) @ np.arange(region.shape[1])) / total
    y = float(excess.sum(axis=1) @ np.arange(region.shape[0])) / total
    return x, y
