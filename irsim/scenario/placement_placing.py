"""Where an occluder goes that shall hide a target in given frames: found from the target's path."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from irsim.occluders import Occluder
from irsim.scenario.placement_hold import LEEWAY, Hold
from irsim.scenario.placement_parts import Part, parts, whole
from irsim.scenario.placement_unmet import UnmetError, no_frame
from irsim.scenario.placement_window import asked, goes_up_or_down, window
from irsim.scenario.visibility import Watch
from irsim.types import Box, Floats

SHORT = 1e-3
"""It may hide so much less of the target than asked. Where nearly all of it is asked, a trace of its ends may stick
out: all but LEEWAY will do."""
CLOSE = 0.1
"""A first part of the window that hides at most so much more than asked is as good as another."""
_ROUNDS = 12
_BULGE = 4.0
"""How far, in windows, a crown may stick out above what it is placed over."""
_LOOKED = 5
"""Frames, spread over those that are asked for, at which a search begins to look."""

Placing = Callable[[float], Occluder]
"""The occluder, placed, that is so dense or covers so large a part."""


def place(watch: Watch, occluder: Occluder) -> Hold:
    """The occluder with the place that its intent asks for, and what it hides; UnmetError where there is none."""
    _, (_, last) = asked(occluder)
    if last >= watch.scenario.frames:
        raise UnmetError("frames", no_frame(last, watch.scenario.frames))
    covered = window(watch, occluder)
    try:
        hold = _nearest(watch, occluder, covered)
    except UnmetError:
        raise
    except ValueError as error:
        raise UnmetError("hides", str(error)) from None
    why = hold.never_ends()
    if why is not None:
        raise UnmetError("frames", why)
    return hold


def _nearest(watch: Watch, occluder: Occluder, covered: Box) -> Hold:
    """The occluder over the part of the window that hides at least what is asked, hardly longer than asked, and where
    most is hidden the least more. The first part that is CLOSE is taken."""
    name, _ = asked(occluder)
    sideways = goes_up_or_down(watch, occluder)
    found = []
    for part in (whole,) if occluder.translucent else parts(sideways):
        screen, shares = _densest_needed(watch, occluder, _placing(watch, occluder, covered, part, sideways))
        if shares.min() < min(occluder.fraction - SHORT, 1 - LEEWAY):
            # At its largest, every part is the whole window.
            raise UnmetError("fraction", f"it can hide {shares.min():.2f} of {name} at most; allowed: so much")
        found.append(Hold(watch, screen, occluder))
        if shares.max() <= occluder.fraction + CLOSE and (len(found) == 1 or not found[-1].outlasts()):
            return found[-1]
    return min(found, key=lambda hold: (hold.outlasts(), hold.most))


def _placing(watch: Watch, occluder: Occluder, covered: Box, part: Part, sideways: bool) -> Placing:
    def of(share: float) -> Occluder:
        screen = occluder.covering(part(covered, share), share, watch.context)
        return screen.standing_at(max(covered.bottom, _horizon(watch) if sideways else _level(watch, occluder)))

    return of


def _densest_needed(watch: Watch, occluder: Occluder, of: Placing) -> tuple[Occluder, Floats]:
    """The occluder, no denser or larger than it has to be, and how much it hides in each frame that is asked for."""
    name, (first, last) = asked(occluder)

    def shares(screen: Occluder, frames: list[int]) -> Floats:
        return np.array([watch.hidden_of_shown(screen, name, index) for index in frames])

    every = list(range(first, last + 1))
    looked = np.unique(np.linspace(first, last, _LOOKED).round().astype(int)).tolist()
    while True:
        high = 1.0
        if occluder.fraction < 1:
            low = 0.0 if occluder.translucent else -_BULGE
            for _ in range(_ROUNDS):
                middle = (low + high) / 2
                enough = shares(of(middle), looked).min() >= min(occluder.fraction, 1 - SHORT)
                low, high = (low, middle) if enough else (middle, high)
        screen = of(high)
        found = shares(screen, every)
        worst = every[int(found.argmin())]
        if occluder.fraction == 1 or found.min() >= occluder.fraction - SHORT or worst in looked:
            return screen, found
        looked.append(worst)


def _horizon(watch: Watch) -> float:
    """The least y, px of the unmoved camera, at which something can stand on the ground: not in the sky."""
    return -math.inf if watch.scenario.background.clear(watch.context) is None else _row(watch, 0.0)


def _level(watch: Watch, occluder: Occluder) -> float:
    """The y, px of the unmoved camera, at which level ground is as far away as the occluder; endless where no
    background says how deep it lies, or it is nowhere so near: what stands there stands below the picture."""
    down = watch.scenario.background.surface_m
    return math.inf if down is None or down >= occluder.range_m else _row(watch, math.asin(down / occluder.range_m))


def _row(watch: Watch, below: float) -> float:
    """The y, px of the unmoved camera, of what it sees `below` the level, rad; endless where that is behind it."""
    geometry = watch.context.geometry
    off = below + geometry.elevation_rad
    return float(geometry.axis_px[1] + math.tan(off) / geometry.ifov_rad) if off < math.pi / 2 else math.inf
