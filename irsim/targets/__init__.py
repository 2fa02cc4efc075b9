"""What targets look like."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.targets.airliner import Airliner
from irsim.targets.base import Shape, View
from irsim.targets.bird import Bird
from irsim.targets.boat import Boat
from irsim.targets.body import draw_all
from irsim.targets.car import Car
from irsim.targets.fighter import Fighter
from irsim.targets.flare import Flare
from irsim.targets.helicopter import Helicopter
from irsim.targets.hot_spot import HotSpot
from irsim.targets.meant import MEANT
from irsim.targets.missile import Missile
from irsim.targets.model import Model
from irsim.targets.pedestrian import Pedestrian
from irsim.targets.point import Point
from irsim.targets.quadrotor import Quadrotor
from irsim.targets.tank import Tank
from irsim.targets.truck import Truck

SHAPES = Family(
    "shape",
    Shape,
    {
        "point": Point,
        "fighter": Fighter,
        "airliner": Airliner,
        "helicopter": Helicopter,
        "quadrotor": Quadrotor,
        "missile": Missile,
        "bird": Bird,
        "tank": Tank,
        "truck": Truck,
        "car": Car,
        "boat": Boat,
        "pedestrian": Pedestrian,
        "mesh": Model,
        "flare": Flare,
        "hot_spot": HotSpot,
    },
    MEANT,
)

__all__ = ["SHAPES", "Shape", "View", "draw_all"]
