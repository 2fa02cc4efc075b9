"""The HOG model: layout of a window, the target's box in it, and a linear SVM with probabilities."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from irsim.types import Floats
from irtrack.features.hog import HOG
from irtrack.features.scaled_region import ScaledRegion
from irtrack.models.files import read_model
from irtrack.models.svm import LinearSVM


@dataclass(frozen=True, slots=True, eq=False)
class HOGModel:
    """Classifier of windows. A target's box has `standard` (w, h) pixels in the middle of the window."""

    layout: HOG
    standard: tuple[int, int]
    svm: LinearSVM

    @classmethod
    def read(cls, path: Path) -> HOGModel:
        """Return the model of a file; InputError, one line, where it is none."""
        values = read_model(path, "hog")
        svm = LinearSVM(np.array(values["w"]), values["b"], values["a"], values["c"])
        return cls(HOG(*values["window"]), (values["standard"][0], values["standard"][1]), svm)

    def values(self) -> dict[str, Any]:
        """Return the values of the model's file."""
        svm = self.svm
        window = [self.layout.columns, self.layout.rows, self.layout.cell]
        return {"window": window, "standard": self.standard, "w": svm.w, "b": svm.b, "a": svm.a, "c": svm.c}

    def vectors(self, region: ScaledRegion, boxes: Floats) -> Floats:
        """Return the vectors (n, d) of windows that frame boxes (n, 4): cx, cy, w, h px of the frame."""
        spacing = boxes[:, 2:] / np.array(self.standard) / region.step
        return self.layout.vectors(region.pixels, region.places(boxes[:, :2]), spacing)

    def margins(self, region: ScaledRegion, boxes: Floats) -> Floats:
        """Return the margins (n,) of windows that frame boxes (n, 4) px of the frame."""
        return self.svm.margins(self.vectors(region, boxes))
