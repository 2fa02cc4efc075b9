"""Ways that targets go, by their names in YAML."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.motion.base import MetrePath, Path
from irsim.motion.crosses import Crosses, CrossesM
from irsim.motion.dive import Dive, DivePx
from irsim.motion.jump import Jump, JumpM
from irsim.motion.manoeuvre import Manoeuvre, ManoeuvreM
from irsim.motion.others import Follow, Thrown
from irsim.motion.singer import Singer, SingerM
from irsim.motion.stop_and_go import StopAndGo, StopAndGoM
from irsim.motion.straight import Straight, StraightM
from irsim.motion.turns import Turns, TurnsM
from irsim.motion.waypoints import Waypoints, WaypointsM
from irsim.motion.weave import Weave, WeaveM

PATHS = Family(
    "path",
    Path,
    {
        "straight": Straight,
        "waypoints": Waypoints,
        "weave": Weave,
        "weave_m": WeaveM,
        "manoeuvre": Manoeuvre,
        "manoeuvre_m": ManoeuvreM,
        "straight_m": StraightM,
        "waypoints_m": WaypointsM,
        "turns": Turns,
        "turns_m": TurnsM,
        "dive": Dive,
        "dive_px": DivePx,
        "singer": Singer,
        "singer_m": SingerM,
        "jump": Jump,
        "jump_m": JumpM,
        "stop_and_go": StopAndGo,
        "stop_and_go_m": StopAndGoM,
        "follow": Follow,
        "crosses": Crosses,
        "crosses_m": CrossesM,
        "thrown": Thrown,
    },
)

METRE_PATHS = Family(
    "metre path", MetrePath, {word: kind for word, kind in PATHS.kinds.items() if issubclass(kind, MetrePath)}
)
"""Those that say where something is, in metres, whatever the camera."""
