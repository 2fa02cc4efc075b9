"""Where the corners of a body lie in the picture."""

from __future__ import annotations

from dataclasses import dataclass

from irsim.geometry.silhouette import clip_or_corner
from irsim.targets.base import View
from irsim.types import Box, Floats


@dataclass(frozen=True, eq=False)
class Corners:
    """Of the n corners of a body.

    pixels  (n, 2) px
    depth   (n,) m before the camera
    box     around them, px
    window  the part of the box whose light can reach the frame
    eye     (3,) m, where the camera is, in body coordinates
    """

    pixels: Floats
    depth: Floats
    box: Box
    window: Box
    eye: Floats


def corners(vertices: Floats, view: View) -> Corners | None:
    """Of vertices (n, 3) m in body coordinates; None where any lies behind the camera."""
    points = vertices @ view.attitude.T + view.position
    if points[:, 2].min() <= 0:
        return None
    pixels = view.context.geometry.project(points)
    box = Box.from_edges(*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())
    return Corners(pixels, points[:, 2], box, clip_or_corner(box, view.context), -view.position @ view.attitude)
