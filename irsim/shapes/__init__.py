"""What targets look like."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.shapes.base import Shape, View
from irsim.shapes.point import Point

SHAPES = Family("shape", Shape, {"point": Point})

__all__ = ["SHAPES", "Shape", "View"]
