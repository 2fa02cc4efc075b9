"""Classifiers and their files: `irtrack train` writes them, trackers read them. The shipped ones lie here."""

from __future__ import annotations

from irtrack.models.files import SHIPPED, Card, model_path, read_model, write_model

__all__ = ["SHIPPED", "Card", "model_path", "read_model", "write_model"]
