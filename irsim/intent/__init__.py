"""What a scenario asks for by its effect: occluders that hide a target in given frames, crossings."""

from __future__ import annotations

from irsim.intent.all import built, overdone, placed, unmet

__all__ = ["built", "overdone", "placed", "unmet"]
