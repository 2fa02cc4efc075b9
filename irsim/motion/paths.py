"""The table of target paths by their names in YAML."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.motion.base import MetrePath, Path
from irsim.motion.dive import Dive, DivePx
from irsim.motion.random_turns import Manoeuvre, ManoeuvreM
from irsim.motion.relative import Crosses, CrossesM, Follow, Thrown
from irsim.motion.scripted import Straight, StraightM, Turns, TurnsM, Waypoints, WaypointsM, Weave, WeaveM
from irsim.motion.stochastic import Singer, SingerM, StopAndGo, StopAndGoM
from irsim.motion.turn_rate_chain import Jump, JumpM

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
"""Paths in metres, which do not depend on the camera."""
