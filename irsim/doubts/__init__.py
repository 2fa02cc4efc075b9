"""What is legal in a scenario but may not be meant."""

from __future__ import annotations

from irsim.doubts.all import doubts, unheeded

__all__ = ["doubts", "unheeded"]
