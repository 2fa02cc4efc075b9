"""Target paths, attitudes and camera motions."""

from __future__ import annotations

from irsim.config.base import Family
from irsim.geometry.rotations import angles_deg
from irsim.motion.attitude import attitudes
from irsim.motion.base import CameraMotion, Dynamics, MetrePath, Path, PixelPath
from irsim.motion.camera_motion import Jitter, Pan, Platform, Shake, Tracks, Vibration, Zoom
from irsim.motion.camera_trajectory import CameraTrajectory, SceneMotion
from irsim.motion.paths import PATHS
from irsim.motion.relative import Crosses, CrossesM, Crossing, RelativePath

CAMERA_MOTIONS = Family(
    "camera motion",
    CameraMotion,
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
    "CAMERA_MOTIONS",
    "PATHS",
    "CameraMotion",
    "CameraTrajectory",
    "Crosses",
    "CrossesM",
    "Crossing",
    "Dynamics",
    "MetrePath",
    "Path",
    "PixelPath",
    "RelativePath",
    "SceneMotion",
    "Tracks",
    "angles_deg",
    "attitudes",
]
