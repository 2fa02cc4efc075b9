"""The centroid of what stands out in a gate: the plainest measurement of a target's place."""

from __future__ import annotations

import numpy as np

from irsim.types import Image


def contrast(patch: Image, region: Image) -> float:
    """How far the target stands out, counts: positive for a hot one, negative for a cold one.

    `region` holds the patch and what surrounds it; its median is the level. The patch holds target
    and background, in any shares (boxes may be tight or loose): it is split in two where the
    threshold is midway between the means of its halves (Ridler, Calvard, "Picture thresholding
    using an iterative selection method", IEEE Trans. SMC 8, 1978); the target is the half whose mean
    is farther from the level. 0 where the patch is constant.
    """
    if patch.min() == patch.max():
        return 0.0
    threshold, before = float(patch.mean()), -1.0
    while threshold != before:
        low, high = float(patch[patch <= threshold].mean()), float(patch[patch > threshold].mean())
        threshold, before = (low + high) / 2, threshold
    level = float(np.median(region))
    return max(low - level, high - level, key=abs)


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
