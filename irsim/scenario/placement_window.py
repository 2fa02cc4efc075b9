"""What an occluder has to cover, and how its target goes by it."""

from __future__ import annotations

import numpy as np

from irsim.geometry.sprite import Sprite
from irsim.occluders import Occluder
from irsim.occluders.base import required
from irsim.scenario.placement_unmet import UnmetError
from irsim.scenario.visibility import Watch
from irsim.types import Box, Floats

MARGIN_PX = 1.0
"""An occluder reaches this far past what it hides: pixels that both cover in part are not hidden by parts."""
STILL_PX = 0.02
"""A target that moves less than this in a frame stands, as far as getting out from behind something goes."""
_TRACE = 1e-3
"""Share of a target's area, on each side, that counts as nothing: a point's far skirts."""


def asked(occluder: Occluder) -> tuple[str, tuple[int, int]]:
    """Whom it shall hide, and the first and the last frame; ValueError where it has no intent."""
    return required(occluder.hides), required(occluder.frames)


def window(watch: Watch, occluder: Occluder) -> Box:
    """What has to be covered, px of the unmoved camera at the occluder's range. UnmetError where it cannot be."""
    name, (first, last) = asked(occluder)
    boxes = []
    for index in range(first, last + 1):
        target = watch.sprite(name, index)
        if target is None:
            raise UnmetError("frames", f"{name} is not there at frame {index}; allowed: frames in which it is")
        if not watch.scenario.camera.geometry.inside(*target.center):
            raise UnmetError(
                "frames", f"{name} is out of the picture at frame {index}; allowed: frames in which it is seen"
            )
        away = watch.first_m(name, index, target)
        if away <= occluder.range_m:
            raise UnmetError(
                "range_m",
                f"{name} is {away:.0f} m away at frame {index}, nearer than {occluder.range_m:.0f} m; "
                "allowed: less than its range",
            )
        for instant in watch.instants:
            drawn = instant.sprite(name, index)
            corners = instant.at_first(_corners(drawn or target), occluder.range_m, index)
            if not np.isfinite(corners).all():
                raise UnmetError(
                    "hides", f"the unmoved camera cannot see where {name} is at frame {index}; allowed: a place"
                )
            boxes.append((*corners.min(axis=0), *corners.max(axis=0)))
    edges = np.array(boxes)
    low, high = edges[:, :2].min(axis=0) - MARGIN_PX, edges[:, 2:].max(axis=0) + MARGIN_PX
    return Box.from_edges(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def goes_up_or_down(watch: Watch, occluder: Occluder) -> bool:
    """Does the target move more up or down than across in those frames (and the frame before and after)?"""
    name, (first, last) = asked(occluder)
    around = [max(first - 1, 0), min(last + 1, watch.scenario.frames - 1)]
    across, down = np.abs(np.diff(watch.way(name, occluder.range_m)[around], axis=0)[0])
    return bool(down > across)


def speed(watch: Watch, occluder: Occluder) -> float:
    """Of the target in the frames that are asked for, px a frame at the occluder's range."""
    name, (first, last) = asked(occluder)
    pixels = watch.way(name, occluder.range_m)
    steps = np.hypot(*np.diff(pixels, axis=0).T) if len(pixels) > 1 else np.zeros(1)
    return float(np.median(steps[max(first - 1, 0) : last + 1]))


def _corners(sprite: Sprite) -> Floats:
    """(4, 2) px: corners of what holds all of a sprite's area but a trace."""
    ends = []
    for axis, origin in ((0, sprite.x0), (1, sprite.y0)):
        sums = np.cumsum(sprite.cover.sum(axis=axis))
        inside = np.flatnonzero(
            (sums > _TRACE * sums[-1]) & (sums - np.diff(sums, prepend=0.0) < (1 - _TRACE) * sums[-1])
        )
        ends.append((origin + inside[0] - 0.5, origin + inside[-1] + 0.5))
    (left, right), (top, bottom) = ends
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
