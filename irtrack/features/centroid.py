"""Contrast of a target with its background, and the centroid of its pixels in a gate."""

from __future__ import annotations

import numpy as np

from irsim.types import Image


def contrast(patch: Image, region: Image) -> float:
    """Return the contrast of a target with its background, counts: above 0 for a hot target, below 0 for a cold one.

    `region` is the patch and its surroundings; its median is the background level. The patch, which shows target and
    background in any shares, is split by a threshold midway between the means of the two parts (Ridler, Calvard,
    "Picture thresholding using an iterative selection method", IEEE Trans. SMC 8, 1978). The target is the part whose
    mean is farther from the background level. 0 where the patch is constant.
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
    """Return the centroid (x, y), px of the region, of pixels above `threshold` times the contrast.

    Pixels are weighted by their excess over the threshold. The background level is the region's median, so the region
    should be at least twice as large as the target. None where no pixel passes, or the contrast is 0.
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
