"""Ways that targets go, by their names in YAML."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.motion.base import MetrePath, Path
from irsim.motion.dive import Dive
from irsim.motion.jump import Jump
from irsim.motion.manoeuvre import Manoeuvre
from irsim.motion.others import Crosses, Follow, Thrown
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

METRE_PATHS = Family(
    "metre path", MetrePath, {word: kind for word, kind in PATHS.kinds.items() if issubclass(kind, MetrePath)}
)
"""Those that say where something is, in metres, whatever the camera."""
