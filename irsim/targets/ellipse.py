"""An even ellipse across the line of sight."""

from __future__ import annotations

import math

import numpy as np

from irsim.geometry.context import SceneContext
from irsim.geometry.polygon import polygon_edges
from irsim.geometry.silhouette import LayeredPolygons, clip_to_view, draw_sprite
from irsim.geometry.sprite import Sprite
from irsim.types import Box, Floats

_CORNERS = 20
"""Of the polygon that it is drawn as."""
_REACH = math.sqrt(2 * math.pi / (_CORNERS * math.sin(2 * math.pi / _CORNERS)))
"""How far out they lie, in radii: the polygon's area is then that of the ellipse. Turned by half a corner it lies
within the ellipse's box."""


def ellipse(middle: Floats, halves: Floats, glow: float, range_m: float, context: SceneContext) -> Sprite | None:
    """An ellipse about `middle` (2,) px, `halves` (2,) px wide and high on each side, shining with `glow`, W/m2/sr.

    None where the frame sees none of it and it is larger than the frame.
    """
    angles = 2 * np.pi * (np.arange(_CORNERS) + 0.5) / _CORNERS
    corners = middle + _REACH * halves * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    box = Box.from_edges(*(middle - halves).tolist(), *(middle + halves).tolist())
    window = clip_to_view(box, context) if max(box.w, box.h) > max(context.geometry.size) else box
    if window is None:
        return None
    edges = (*polygon_edges(corners), np.zeros(_CORNERS, dtype=np.int64))
    return draw_sprite(LayeredPolygons(edges, np.atleast_1d(glow), box, window, context.psf, range_m))
