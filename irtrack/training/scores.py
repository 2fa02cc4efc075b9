"""Scores of a classifier of windows: area under the ROC, and the share of positives at a share of false alarms."""

from __future__ import annotations

import numpy as np
from scipy.stats import rankdata

from irsim.types import Bools, Floats


def area_under_roc(scores: Floats, positive: Bools) -> float:
    """Return the probability that a positive scores above a negative, ties counted half (Hanley, McNeil 1982)."""
    ranks, count = rankdata(scores), int(positive.sum())
    return float((ranks[positive].sum() - count * (count + 1) / 2) / (count * (len(scores) - count)))


def detection_rate(scores: Floats, positive: Bools, false_alarms: float) -> float:
    """Return the share of positives above the threshold that this share of negatives passes."""
    threshold = np.quantile(scores[~positive], 1 - false_alarms)
    return float((scores[positive] > threshold).mean())


def roc_scores(scores: Floats, positive: Bools) -> dict[str, float]:
    """Return the figures of a card."""
    return {
        "area under ROC": round(area_under_roc(scores, positive), 4),
        "detection rate at 1 % false alarms": round(detection_rate(scores, positive, 0.01), 4),
        "detection rate at 0.1 % false alarms": round(detection_rate(scores, positive, 0.001), 4),
    }
