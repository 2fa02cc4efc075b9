"""The AdaBoost model: Haar-like features of a window, the target's box in it, and boosted stumps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irsim.types import Floats
from irtrack.features.haar import HaarFeatures, IntegralImage
from irtrack.features.scaled_region import ScaledRegion
from irtrack.models.adaboost import Stumps
from irtrack.models.files import read_model


@dataclass(frozen=True, slots=True, eq=False)
class HaarModel:
    """Classifier of windows of `side` x `side` pixels, in whose middle a target's box has `standard` (w, h) pixels.

    features    those of the stumps, in their order
    threshold   least decision of a detection
    """

    features: HaarFeatures
    standard: tuple[int, int]
    stumps: Stumps
    threshold: float

    @classmethod
    def read(cls, path: Path) -> HaarModel:
        """Return the model of a file; InputError, one line, where it is none."""
        values = read_model(path, "adaboost")
        x, y, weights = (np.array(values[name]) for name in ("x", "y", "weights"))
        columns = (np.array(values[name], np.float64) for name in ("thresholds", "above", "below", "alpha"))
        return cls(
            HaarFeatures(values["side"], x, y, weights.astype(np.float64)),
            (values["standard"][0], values["standard"][1]),
            Stumps(np.arange(len(x)), *columns),
            values["threshold"],
        )

    def values(self) -> dict[str, Any]:
        """Return the values of the model's file."""
        of, stumps = self.features, self.stumps
        return {
            "side": of.side,
            "standard": self.standard,
            "threshold": self.threshold,
            "x": of.x,
            "y": of.y,
            "weights": of.weights,
            "thresholds": stumps.threshold,
            "above": stumps.above,
            "below": stumps.below,
            "alpha": stumps.alpha,
        }

    def corners(self, region: ScaledRegion, centers: Floats) -> np.ndarray:
        """Return the top-left pixels (n, 2) in a region of the windows about centres (n, 2) px of the frame."""
        places: np.ndarray = np.floor(region.places(centers) - (self.features.side - 1) / 2 + 0.5).astype(np.int64)
        return places

    def decisions(self, region: ScaledRegion, centers: Floats) -> Floats:
        """Return the decisions (n,), -1 .. 1, of the windows about centres (n, 2) px, at the region's own scale.

        A window without contrast, whose features are all 0, has -1.
        """
        values = self.features.values(IntegralImage.of(region.pixels), self.corners(region, centers))
        return np.where(values.any(axis=1), self.stumps.decisions(values), -1.0)
