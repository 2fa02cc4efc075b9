"""Training of the classifiers that trackers use: `irtrack train`."""

from __future__ import annotations

from irtrack.training.train import KINDS, train

__all__ = ["KINDS", "train"]
