"""Where targets go and where the camera looks."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.motion.attitude import angles_deg
from irsim.motion.base import MetrePath, Path, PixelPath, Pointing
from irsim.motion.crosses import Crosses, CrossesM, Crossing
from irsim.motion.dynamics import Dynamics
from irsim.motion.jitter import Jitter
from irsim.motion.mount import CameraTrajectory, Company
from irsim.motion.others import Companion
from irsim.motion.pan import Pan
from irsim.motion.paths import PATHS
from irsim.motion.platform import Platform
from irsim.motion.posture import attitudes
from irsim.motion.tracks import Tracks
from irsim.motion.vibration import Shake, Vibration
from irsim.motion.zoom import Zoom

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
    "CameraTrajectory",
    "Companion",
    "Company",
    "Crosses",
    "CrossesM",
    "Crossing",
    "Dynamics",
    "MetrePath",
    "Path",
    "PixelPath",
    "Pointing",
    "Tracks",
    "angles_deg",
    "attitudes",
]
