"""Where targets go and where the camera looks."""

from __future__ import annotations

from irsim.kinds import Family
from irsim.motion.attitude import angles_deg
from irsim.motion.base import MetrePath, Path, PixelPath, Pointing
from irsim.motion.dive import Dive
from irsim.motion.dynamics import Dynamics
from irsim.motion.jitter import Jitter
from irsim.motion.jump import Jump
from irsim.motion.manoeuvre import Manoeuvre
from irsim.motion.mount import Company, Mount
from irsim.motion.others import Crosses, Follow, Thrown
from irsim.motion.pan import Pan
from irsim.motion.platform import Platform
from irsim.motion.posture import attitudes
from irsim.motion.singer import Singer, SingerM
from irsim.motion.stop_and_go import StopAndGo
from irsim.motion.straight import Straight, StraightM
from irsim.motion.tracks import Tracks
from irsim.motion.turns import Turns, TurnsM
from irsim.motion.vibration import Shake, Vibration
from irsim.motion.waypoints import Waypoints, WaypointsM
from irsim.motion.weave import Weave
from irsim.motion.zoom import Zoom

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

POINTINGS = Family(
    "camera motion",
    Pointing,
    {
        "pan": Pan,
        "jitter": Jitter,
        "shake": Shake,
        "vibration": Vibration,
        "zoom": Zoom,
        "platform": Platform,
        "tracks": Tracks,
    },
)

__all__ = [
    "PATHS",
    "POINTINGS",
    "Company",
    "Crosses",
    "Dynamics",
    "MetrePath",
    "Mount",
    "Path",
    "PixelPath",
    "Pointing",
    "angles_deg",
    "attitudes",
]
