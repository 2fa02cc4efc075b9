"""Precision, recall and F of long-term tracking, in which the target leaves and returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Floats


@dataclass(frozen=True, slots=True)
class LongTerm:
    """Point of largest F on the precision-recall curve; nan where the curve has no point.

    precision   mean overlap over the frames in which the tracker reports a position
    recall      mean overlap over the frames in which part of the target is visible
    f           2 precision recall / (precision + recall)
    threshold   threshold on the confidence at this point
    """

    precision: float
    recall: float
    f: float
    threshold: float


def long_term(overlap: Floats, confidence: Floats, present: np.ndarray) -> LongTerm:
    """Return the point of largest F over all thresholds of the confidence.

    Lukezic, Kart, Kapyla, Durmush, Kamarainen, Matas, Kristan, "CDTB", ICCV 2019, and Lukezic, Cehovin
    Zajc, Vojir, Matas, Kristan, "Now you see me", arXiv:1804.07056, eqs. 1 to 3.

    overlap     (n,) 0..1; taken as 0 where the target is absent
    confidence  (n,) of any scale; nan where the tracker reports no position (status "lost")
    present     (n,) bool: part of the target is visible
    """
    met = np.where(present & ~np.isnan(overlap), overlap, 0.0)
    (said,) = np.nonzero(~np.isnan(confidence))
    if not present.any() or len(said) == 0:
        return LongTerm(*[np.nan] * 4) if not present.any() else LongTerm(np.nan, 0.0, 0.0, np.nan)
    falling = said[(-confidence[said]).argsort(kind="stable")]
    thresholds = confidence[falling]
    sums = met[falling].cumsum()
    last = np.ones(len(falling), bool)
    last[:-1] = thresholds[1:] != thresholds[:-1]  # frames of equal confidence pass a threshold together
    precision = (sums / np.arange(1, len(falling) + 1))[last]
    recall = (sums / present.sum())[last]
    total = precision + recall
    f = np.divide(2 * precision * recall, total, out=np.zeros_like(total), where=total > 0)
    best = int(f.argmax())
    return LongTerm(float(precision[best]), float(recall[best]), float(f[best]), float(thresholds[last][best]))
