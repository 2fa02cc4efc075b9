"""What targets look like."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.shapes.base import Shape, View
from irsim.shapes.fighter import Fighter
from irsim.shapes.point import Point
from irsim.shapes.tank import Tank

SHAPES = Family("shape", Shape, {"point": Point, "fighter": Fighter, "tank": Tank})

__all__ = ["SHAPES", "Shape", "View"]
