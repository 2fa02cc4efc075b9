"""Whether a crossing of two targets can happen."""

from __future__ import annotations

import numpy as np

from irsim.motion import Crosses, Crossing
from irsim.scenario.placement_unmet import UnmetError, no_frame
from irsim.scenario.placement_window import STILL_PX
from irsim.scenario.visibility import Watch


def check_crossing(watch: Watch, index: int) -> None:
    """UnmetError where a crossing cannot happen."""
    target = watch.scenario.targets[index]
    path, context = target.path, watch.context
    assert isinstance(path, Crossing)
    if path.at_frame > watch.scenario.frames - 1:
        raise UnmetError("at_frame", no_frame(path.at_frame, watch.scenario.frames))
    frame = round(path.at_frame)
    for name in (path.target, target.id):
        if not watch.courses[name].target.exists(frame):
            raise UnmetError("at_frame", f"{name} is not there at frame {frame}; allowed: a frame in which it is")
    if isinstance(path, Crosses):
        _check_range(path, watch, frame)
    if path.parting_px(context) < STILL_PX:
        raise UnmetError(
            "angle_deg", f"at this speed and angle it never parts from {path.target}; allowed: another one"
        )
    for name in (path.target, target.id):
        x, y = watch.mount.seen(watch.courses[name].positions)[frame]
        if not watch.scenario.camera.geometry.inside(x, y):
            raise UnmetError(
                "at_frame", f"{name} is out of the picture at frame {frame}; allowed: a frame in which it is seen"
            )


def _check_range(path: Crosses, watch: Watch, frame: int) -> None:
    """UnmetError where the other is behind the camera at `frame`, or the crossing would be."""
    here, _, _, range_m = path.meeting(watch.context)
    if not np.isfinite(here).all():
        raise UnmetError(
            "at_frame", f"{path.target} is not in the picture at frame {frame}; allowed: a frame in which it is"
        )
    if range_m + path.farther_m <= 0:
        away = round(range_m, 1)
        raise UnmetError("farther_m", f"{path.target} is {away:g} m away; allowed: more than {0 - away:g}")
