"""Training of the classifiers that trackers use: `irtrack train`."""

from __future__ import annotations

from irtrack.training.trainers import KINDS, train

__all__ = ["KINDS", "train"]
