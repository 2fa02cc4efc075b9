"""Occluders: objects between the camera and the targets."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.occluders.base import Occluder, Opaque
from irsim.occluders.smoke import Smoke
from irsim.occluders.solid import Bar, Building, Pole
from irsim.occluders.tree import Tree

OCCLUDERS = Family("occluder", Occluder, {"bar": Bar, "pole": Pole, "tree": Tree, "building": Building, "smoke": Smoke})

__all__ = ["OCCLUDERS", "Bar", "Occluder", "Opaque"]
