"""What is legal in a scenario but may not be meant."""

from __future__ import annotations

from irsim.lint.registry import DOUBTS, doubts, ineffective

__all__ = ["DOUBTS", "doubts", "ineffective"]
