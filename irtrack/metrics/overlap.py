"""Overlap with the true box, and success curves."""

from __future__ import annotations

import numpy as np

from irsim.types import Floats
from irtrack.metrics.statistics import share
from irtrack.types import LEAST_PX

SUCCESS = np.arange(21) / 20
"""Thresholds of the success curve (OTB toolkit: 0:0.05:1)."""


def overlaps(centers: Floats, sizes: Floats, truth_centers: Floats, truth_sizes: Floats) -> Floats:
    """Return the intersection over union of boxes by centres and sizes (n, 2) px, (n,) 0..1; nan without a true box."""
    low = np.maximum(centers - sizes / 2, truth_centers - truth_sizes / 2)
    high = np.minimum(centers + sizes / 2, truth_centers + truth_sizes / 2)
    common = np.clip(high - low, 0, None).prod(axis=1)
    union = sizes.prod(axis=1) + truth_sizes.prod(axis=1) - common
    return np.asarray(common / union)


def widened(sizes: Floats) -> Floats:
    """Return sizes (n, 2) px with sides raised to at least `LEAST_PX`; nan stays nan.

    Start boxes are widened in the same way, so that a tracker that keeps the start box of a point target has the true
    size.
    """
    return np.asarray(np.maximum(sizes, LEAST_PX))


def success_curve(overlap: Floats, thresholds: Floats = SUCCESS) -> Floats:
    """Return the share of the overlaps (n,) that are > each threshold; nan without overlaps.

    Wu, Lim, Yang, Online Object Tracking: A Benchmark, CVPR 2013, section 3.2. The area under it
    (`area`) is its mean over the 21 thresholds; as no overlap is above 1, a perfect track scores 20/21 = 0.952.
    """
    if len(overlap) == 0:
        return np.full(len(thresholds), np.nan)
    return np.asarray((np.asarray(overlap)[:, None] > thresholds).sum(axis=0) / len(overlap))


def success_rate(overlap: Floats, threshold: float) -> float:
    """Return the share of the overlaps (n,) that are > threshold; nan without overlaps.

    Huang, Zhao, Huang, GOT-10k, IEEE TPAMI 43 (2021), section 3.4: SR at 0.5 and 0.75. Its AO, the
    average overlap, is the mean of the overlaps.
    """
    return share(np.asarray(overlap) > threshold)
