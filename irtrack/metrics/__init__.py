"""Figures from tracks: arrays in, values out; no file is opened here."""

from irtrack.metrics.scoring import Score

__all__ = ["Score"]
