"""Slender occluders, placed by whom they hide, that the camera's own way makes into walls."""

from __future__ import annotations

import numpy as np

from irsim.scenario.placement_hold import Hold
from irsim.scenario.placement_window import MARGIN_PX, asked, speed, window

WIDE = 2.0
"""It is warned of one that is so many times as wide as the target's own size and way ask for,"""
WIDE_PX = 10.0
"""and by so many px wider."""


def walled(hold: Hold) -> str | None:
    """What is to be said where a slender occluder is wide only because the camera is carried past it.

    What is nearer than its target goes by before it as the camera does (parallax): to hide it for several frames takes
    what is as wide as that way.
    """
    watch, occluder = hold.watch, hold.occluder
    placed = hold.screen.extent(watch.context)
    if not occluder.slender or placed is None or not np.ptp(watch.mount.places, axis=0).any():
        return None
    name, (first, last) = asked(occluder)
    frames = range(first, last + 1)
    own = [sprite.box.w for index in frames if (sprite := watch.sprite(name, index)) is not None]
    seen = watch.context.geometry.project(watch.courses[name].positions[first : last + 1])
    needed = max(own) + float(np.ptp(seen[:, 0])) + 2 * MARGIN_PX
    wide = min(placed.w, window(watch, occluder).w)
    if not wide > max(WIDE * needed, needed + WIDE_PX):  # nor where the unmoved camera does not see it
        return None
    metres = wide * watch.context.geometry.ifov_rad * occluder.range_m
    away = min(watch.first_m(name, index, sprite) for index in frames if (sprite := watch.sprite(name, index)))
    pace = speed(watch, occluder)
    return (
        f"a {occluder.kind} {wide:.0f} px or {metres:.2g} m wide: the camera is carried, and {name} goes by behind it "
        f"at {pace:.2g} px a frame; its own size and way need {needed:.0f} px: try a range nearer to that of {name}, "
        f"{away:.0f} m, or fewer frames"
    )
