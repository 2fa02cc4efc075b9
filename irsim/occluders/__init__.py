"""Things that hide targets."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.occluders.bar import Bar
from irsim.occluders.base import Occluder, Opaque, Sight

OCCLUDERS = Family("occluder", Occluder, {"bar": Bar})

__all__ = ["OCCLUDERS", "Bar", "Occluder", "Opaque", "Sight"]
