"""Where targets go and where the camera looks."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.motion.attitude import angles_deg, attitudes
from irsim.motion.base import MetrePath, Path, PixelPath, Pointing
from irsim.motion.dive import Dive
from irsim.motion.dynamics import Dynamics
from irsim.motion.jitter import Jitter
from irsim.motion.jump import Jump
from irsim.motion.manoeuvre import Manoeuvre
from irsim.motion.mount import Company, Mount
from irsim.motion.others import Crosses, Follow, Thrown
from irsim.motion.pan import Pan
from irsim.motion.singer import Singer, SingerM
from irsim.motion.stop_and_go import StopAndGo
from irsim.motion.straight import Straight, StraightM
from irsim.motion.turns import Turns, TurnsM
from irsim.motion.waypoints import Waypoints, WaypointsM
from irsim.motion.weave import Weave

PATHS = Family(
    "path",
    Path,
    {
        "straight": Straight,
        "waypoints": Waypoints,
        "weave": Weave,
        "manoeuvre": Manoeuvre,
        "straight_m": StraightM,
        "waypoints_m": WaypointsM,
        "turns": Turns,
        "turns_m": TurnsM,
        "dive": Dive,
        "singer": Singer,
        "singer_m": SingerM,
        "jump": Jump,
        "stop_and_go": StopAndGo,
        "follow": Follow,
        "crosses": Crosses,
        "thrown": Thrown,
    },
)

POINTINGS = Family("camera motion", Pointing, {"pan": Pan, "jitter": Jitter})

__all__ = [
    "PATHS",
    "POINTINGS",
    "Company",
    "Dynamics",
    "MetrePath",
    "Mount",
    "Path",
    "PixelPath",
    "Pointing",
    "angles_deg",
    "attitudes",
]
