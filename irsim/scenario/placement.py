"""Placement: the search for a place at which an occluder hides a required fraction of a target in given frames.

The occluder covers a part of the target's window (`occlusion_window`). Bisection finds the smallest part (for smoke the
lowest density) that hides the required fraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from irsim.errors import InputError
from irsim.occluders import Occluder
from irsim.scenario.model import Scenario
from irsim.scenario.occlusion_window import (
    TOLERANCE,
    InfeasibleError,
    Occlusion,
    moves_vertically,
    no_frame,
    occlusion_window,
    target_and_frames,
)
from irsim.scenario.visibility import TargetVisibility
from irsim.types import Box, Floats, arrays_frozen

_SHORTFALL = 1e-3
"""Shortfall of the occluded fraction that the search accepts. Where nearly all of the target must be hidden, its ends
may remain visible, up to the fraction TOLERANCE."""
_GOOD_EXCESS = 0.1
"""Excess of the occluded fraction up to which the first part of the window is accepted without trying the others."""
_ROUNDS = 12
_CROWN_WINDOWS = 4.0
"""Largest height of a tree's crown above the window, in heights of the window."""
_FIRST_FRAMES = 5
"""Number of frames, spread over the required ones, with which a search starts."""
_THIN_PX = 1.0
"""Least width and height of a part of the window, px."""

Part = Callable[[Box, float], Box]
"""Function that returns a part of a window, given the window and a fraction of it, at most 1.

At a fraction of 0 or less, a part at the lower or right edge lies outside the window, below or right of it, as a tree's
crown rises above its part. Any other part is as thin as possible.
"""
Placing = Callable[[float], Occluder]
"""Function that returns the occluder for a density (smoke) or a fraction of the window."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Occluder at its place, with the fraction of its target that it hides in each frame, if it has a target."""

    screen: Occluder
    fractions: Floats | None = None


_CACHED = 32
"""Number of scenarios whose placements are cached, as for all severities of a suite. A placement may take seconds."""
_cache: dict[str, tuple[Placed | InfeasibleError, ...]] = {}
"""Placements by the hash of the scenario."""


def placements(scenario: Scenario) -> tuple[Placed | InfeasibleError, ...]:
    """Return each occluder at its place, or the error that prevents it. `without` does not change the places."""
    whole = scenario.whole
    if all(occluder.hides is None for occluder in whole.occluders):
        return tuple(map(Placed, whole.occluders))
    key = whole.hash
    if key not in _cache:
        if len(_cache) == _CACHED:
            del _cache[next(iter(_cache))]
        visibility = TargetVisibility(whole)
        _cache[key] = tuple(_place(visibility, occluder) for occluder in whole.occluders)
    return _cache[key]


def placed_occluders(scenario: Scenario) -> tuple[Occluder, ...]:
    """Return the occluders, each at its place; InputError where a placement is infeasible."""
    found = []
    for occluder, result in zip(scenario.occluders, placements(scenario), strict=True):
        if isinstance(result, InfeasibleError):
            raise InputError(f"occluders.{occluder.name}.{result.key}: {result}")
        found.append(result.screen)
    return tuple(found)


def with_placements(scenario: Scenario) -> Scenario:
    """Return the scenario with every occluder at its place, and without what is switched off."""
    return scenario.model_copy(update={"occluders": placed_occluders(scenario)}).shown


def _place(visibility: TargetVisibility, occluder: Occluder) -> Placed | InfeasibleError:
    if occluder.hides is None:
        return Placed(occluder)
    try:
        occlusion = _search(visibility, occluder)
        return arrays_frozen(Placed(occlusion.screen, occlusion.fractions))
    except InfeasibleError as fault:
        return InfeasibleError(fault.key, str(fault))  # without its traceback, which would hold the frames' sprites


def _search(visibility: TargetVisibility, occluder: Occluder) -> Occlusion:
    """Return the occlusion by the occluder at its best place; InfeasibleError where there is none."""
    _, (_, last) = target_and_frames(occluder)
    if last >= visibility.scenario.frames:
        raise InfeasibleError("frames", no_frame(last, visibility.scenario.frames))
    window = occlusion_window(visibility, occluder)
    try:
        occlusion = _best(visibility, occluder, window)
    except InfeasibleError:
        raise
    except ValueError as error:
        raise InfeasibleError("hides", str(error)) from None
    fault = occlusion.recurs()
    if fault is not None:
        raise InfeasibleError("frames", fault)
    return occlusion


def _best(visibility: TargetVisibility, occluder: Occluder, window: Box) -> Occlusion:
    """Return the occlusion by the best part of the window. The first part within _GOOD_EXCESS of the required fraction
    is taken, else the one with the smallest excess among those that do not last too long."""
    name, _ = target_and_frames(occluder)
    vertical = moves_vertically(visibility, occluder)
    found = []
    for part in (_whole,) if occluder.translucent else _parts(vertical):
        screen, fractions = _smallest(visibility, occluder, _placing(visibility, occluder, window, part, vertical))
        if fractions.min() < min(occluder.fraction - _SHORTFALL, 1 - TOLERANCE):
            # At its largest every part is the whole window, so that no other part hides more.
            raise InfeasibleError(
                "fraction", f"it can hide at most {fractions.min():.2f} of {name}; allowed: that much"
            )
        found.append(Occlusion(visibility, screen, occluder))
        if fractions.max() <= occluder.fraction + _GOOD_EXCESS and (len(found) == 1 or not found[-1].lasts_too_long()):
            return found[-1]
    return min(found, key=lambda occlusion: (occlusion.lasts_too_long(), occlusion.max_fraction))


def _placing(visibility: TargetVisibility, occluder: Occluder, window: Box, part: Part, vertical: bool) -> Placing:
    def placed(fraction: float) -> Occluder:
        screen = occluder.covering(part(window, fraction), fraction, visibility.context)
        ground = _horizon_row(visibility) if vertical else _ground_row(visibility, occluder)
        return screen.standing_at(max(window.bottom, ground))

    return placed


def _smallest(visibility: TargetVisibility, occluder: Occluder, placed: Placing) -> tuple[Occluder, Floats]:
    """Return the smallest (smoke: thinnest) sufficient occluder, and the fraction it hides in each required frame."""
    name, (first, last) = target_and_frames(occluder)

    def fractions(screen: Occluder, frames: list[int]) -> Floats:
        return np.array([visibility.occluded_in_picture(screen, name, frame) for frame in frames])

    every = list(range(first, last + 1))
    frames = np.unique(np.linspace(first, last, _FIRST_FRAMES).round().astype(int)).tolist()
    while True:
        high = 1.0
        if occluder.fraction < 1:
            low = 0.0 if occluder.translucent else -_CROWN_WINDOWS
            for _ in range(_ROUNDS):
                middle = (low + high) / 2
                enough = fractions(placed(middle), frames).min() >= min(occluder.fraction, 1 - _SHORTFALL)
                low, high = (low, middle) if enough else (middle, high)
        screen = placed(high)
        found = fractions(screen, every)
        worst = every[int(found.argmin())]
        if occluder.fraction == 1 or found.min() >= occluder.fraction - _SHORTFALL or worst in frames:
            return screen, found
        frames.append(worst)


def _horizon_row(visibility: TargetVisibility) -> float:
    """Return the row y of the horizon, px of the camera at rest. Occluders stand below it; -inf without a sky."""
    return -math.inf if visibility.scenario.background.clear(visibility.context) is None else _row(visibility, 0.0)


def _ground_row(visibility: TargetVisibility, occluder: Occluder) -> float:
    """Return the row y of level ground at the occluder's range, px of the camera at rest. It is inf, below the picture,
    where the background gives no depth of the ground or a depth beyond that range."""
    depth_m = visibility.scenario.background.surface_m
    if depth_m is None or depth_m >= occluder.range_m:
        return math.inf
    return _row(visibility, math.asin(depth_m / occluder.range_m))


def _row(visibility: TargetVisibility, depression: float) -> float:
    """Return the row y, px of the camera at rest, of an angle below the horizontal, rad; inf behind the camera."""
    geometry = visibility.context.geometry
    angle = depression + geometry.elevation_rad
    return float(geometry.axis_px[1] + math.tan(angle) / geometry.ifov_rad) if angle < math.pi / 2 else math.inf


def _parts(vertical: bool) -> tuple[Part, ...]:
    """Return the parts of the window to try in turn, first those that are shorter along the target's motion.

    Parts that are narrower across the motion follow; they hide less of a target that weaves or moves diagonally. The
    centre is last: within a large target it hides less than the other parts.
    """
    along, across = (_right, _left, _middle_columns), (_lower, _upper, _middle_rows)
    if not vertical:
        along, across = across, along
    return (*along, *reversed(across), _center)


def _whole(window: Box, fraction: float) -> Box:
    return window


def _lower(window: Box, fraction: float) -> Box:
    top = window.bottom - fraction * window.h
    return Box.from_edges(window.left, top, window.right, max(window.bottom, top + _THIN_PX))


def _right(window: Box, fraction: float) -> Box:
    left = window.right - fraction * window.w
    return Box.from_edges(left, window.top, max(window.right, left + _THIN_PX), window.bottom)


def _upper(window: Box, fraction: float) -> Box:
    return Box.from_edges(window.left, window.top, window.right, window.top + max(fraction * window.h, _THIN_PX))


def _left(window: Box, fraction: float) -> Box:
    return Box.from_edges(window.left, window.top, window.left + max(fraction * window.w, _THIN_PX), window.bottom)


def _middle_columns(window: Box, fraction: float) -> Box:
    half = max(fraction * window.w, _THIN_PX) / 2
    return Box.from_edges(window.cx - half, window.top, window.cx + half, window.bottom)


def _middle_rows(window: Box, fraction: float) -> Box:
    half = max(fraction * window.h, _THIN_PX) / 2
    return Box.from_edges(window.left, window.cy - half, window.right, window.cy + half)


def _center(window: Box, fraction: float) -> Box:
    return Box(window.cx, window.cy, max(fraction * window.w, _THIN_PX), max(fraction * window.h, _THIN_PX))
