"""Targets: their shapes, trajectories and drawing."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.targets.aircraft import Airliner, Fighter, Missile
from irsim.targets.animals import Bird, Pedestrian
from irsim.targets.base import Shape, View
from irsim.targets.drones import FixedWing, Hexacopter
from irsim.targets.mesh import MeshShape
from irsim.targets.point import Flare, HotSpot, Point
from irsim.targets.rotorcraft import Helicopter, Quadrotor
from irsim.targets.vehicles import Boat, Car, Tank, Truck

_SYNONYMS = {
    "fighter": "jet warplane",
    "airliner": "plane airplane aeroplane aircraft jetliner",
    "helicopter": "helo heli chopper rotorcraft",
    "quadrotor": "quadcopter drone uav uas multirotor multicopter",
    "hexacopter": "hexarotor hexa octocopter",
    "fixed_wing": "fixedwing glider wing",
    "missile": "rocket sam",
    "bird": "gull goose duck pigeon",
    "tank": "apc ifv armour armor",
    "truck": "lorry bus van",
    "car": "vehicle automobile suv sedan",
    "boat": "ship vessel yacht frigate",
    "pedestrian": "person human man woman people walker soldier",
    "point": "dot blob point_source",
    "mesh": "obj stl model",
    "flare": "decoy",
}
"""Other words for each kind, for suggestions in error messages only."""

SHAPES = Family(
    "shape",
    Shape,
    {
        "point": Point,
        "fighter": Fighter,
        "airliner": Airliner,
        "helicopter": Helicopter,
        "quadrotor": Quadrotor,
        "hexacopter": Hexacopter,
        "fixed_wing": FixedWing,
        "missile": Missile,
        "bird": Bird,
        "tank": Tank,
        "truck": Truck,
        "car": Car,
        "boat": Boat,
        "pedestrian": Pedestrian,
        "mesh": MeshShape,
        "flare": Flare,
        "hot_spot": HotSpot,
    },
    {word: kind for kind, words in _SYNONYMS.items() for word in words.split()},
)

__all__ = ["SHAPES", "Shape", "View"]
