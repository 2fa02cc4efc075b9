"""Compensation of the camera's own motion: the homography from the last frame to the next."""

from __future__ import annotations

from typing import Literal

import numpy as np

import irsim
from irsim.types import Floats, Frame, Pose
from irtrack.detectors.base import checked_picture
from irtrack.detectors.frame_difference import displacement, reduced
from irtrack.detectors.peaks import Picture
from irtrack.errors import InputError

EgoMotion = Literal["none", "pose", "image"]
"""Source of the camera's motion: none, its pose in each frame, or the registration of successive pictures."""

View = Pose | Picture
"""Pose or picture of a frame, with which that of the next frame is compared."""


def ego_view(kind: EgoMotion, frame: Frame) -> View | None:
    """Return the pose or the picture of a frame; None without compensation. InputError where there is no pose."""
    if kind == "none":
        return None
    if kind == "image":
        return checked_picture(frame)
    if frame.pose is None:
        raise InputError(f"frame {frame.index}: it has no camera pose; allowed with ego_motion=pose: frames with one")
    return frame.pose


def scene_motion(last: View, view: View, size: tuple[int, int]) -> Floats:
    """Return the homography (3, 3) of distant points between the views of two frames of `size` (columns, rows).

    From poses it is exact (`irsim.homography`). From pictures it is a shift, by phase correlation and least squares
    (`irtrack.features.background`): the camera's roll and zoom are not in it.
    """
    if isinstance(last, Pose) and isinstance(view, Pose):
        found: Floats = irsim.homography(last, view, size)
        return found
    assert isinstance(last, np.ndarray)
    assert isinstance(view, np.ndarray)
    _, dx, dy = displacement(reduced(last), reduced(view))
    return np.array([[1.0, 0, dx], [0, 1.0, dy], [0, 0, 1.0]])
