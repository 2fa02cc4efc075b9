"""What targets look like."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.shapes.airliner import Airliner
from irsim.shapes.base import Shape, View
from irsim.shapes.bird import Bird
from irsim.shapes.boat import Boat
from irsim.shapes.body import draw_all
from irsim.shapes.car import Car
from irsim.shapes.fighter import Fighter
from irsim.shapes.flare import Flare
from irsim.shapes.helicopter import Helicopter
from irsim.shapes.hot_spot import HotSpot
from irsim.shapes.meant import MEANT
from irsim.shapes.missile import Missile
from irsim.shapes.model import Model
from irsim.shapes.pedestrian import Pedestrian
from irsim.shapes.point import Point
from irsim.shapes.quadrotor import Quadrotor
from irsim.shapes.tank import Tank
from irsim.shapes.truck import Truck

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
