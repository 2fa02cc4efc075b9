"""Things that hide targets."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.occluders.bar import Bar
from irsim.occluders.base import Occluder, Opaque
from irsim.occluders.smoke import Smoke
from irsim.occluders.standing import Building, Pole
from irsim.occluders.tree import Tree

OCCLUDERS = Family("occluder", Occluder, {"bar": Bar, "pole": Pole, "tree": Tree, "building": Building, "smoke": Smoke})

__all__ = ["OCCLUDERS", "Bar", "Occluder", "Opaque"]
