"""Crossings that are not seen as they are asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.errors import Notice
from irsim.motion import Crosses, Crossing
from irsim.motion.relative import STILL_PX
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import Watch
from irsim.targets.trajectory import TargetTrajectory
from irsim.types import Floats

TURNED_DEG = 10.0
"""An angle in the picture that is off by more is told."""
AROUND = 5
"""Frames before a crossing and after it between which ways are measured: a camera that shakes shows their mean."""


def _pairs(watch: Watch) -> Iterator[tuple[int, Crossing, tuple[TargetTrajectory, TargetTrajectory]]]:
    """Of each crossing whose two are on: the number of the target that crosses, its path, and the courses of both."""
    for index, target in enumerate(watch.scenario.targets):
        path = target.path
        if isinstance(path, Crossing) and {target.id, path.target} <= watch.courses.keys():
            yield index, path, (watch.courses[target.id], watch.courses[path.target])


def misses(scenario: Scenario) -> Iterator[Notice]:
    """Crossings so far apart that the two never touch in the picture."""
    watch = Watch(scenario)
    for index, path, pair in _pairs(watch):
        seen = [watch.mount.seen(course.positions) for course in pair]
        apart = _nearest(seen[1] - seen[0])
        there = [all(course.target.exists(frame) for course in pair) for frame in range(scenario.frames)]
        frame = int(np.argmin(np.where(there, apart, np.inf)))
        both = [watch.sprite(course.target.id, frame) for course in pair]
        reach = sum(one.box.diagonal / 2 for one in both if one is not None)
        if None not in both and apart[frame] > reach:
            yield Notice(
                ("targets", index, "path", "miss_px" if isinstance(path, Crosses) else "miss_m"),
                f"{pair[0].target.id} and {path.target} never meet: they stay {apart[frame]:.3g} px apart; "
                f"they touch at {reach:.1f} and less",
            )


def turned(scenario: Scenario) -> Iterator[Notice]:
    """Crossings in pixels whose angle is another in the picture, as the camera moves: it adds its motion to both."""
    watch = Watch(scenario)
    for index, path, pair in _pairs(watch):
        between = [max(round(path.at_frame) - AROUND, 0), min(round(path.at_frame) + AROUND, scenario.frames - 1)]
        if not isinstance(path, Crosses) or between[0] >= between[1]:
            continue
        positions = [course.positions for course in pair]
        meant = _angle_deg(*(watch.context.geometry.project(places[between]) for places in positions))
        shown = _angle_deg(*(watch.mount.seen(places)[between] for places in positions))
        if abs(math.remainder(shown - meant, 360)) > TURNED_DEG:
            both = f"{pair[0].target.id} and {path.target}"
            yield Notice(
                ("targets", index, "path", "angle_deg"),
                f"in the picture {both} cross at {math.remainder(shown, 360):.0f} degrees, and "
                f"for a camera that stands still at {math.remainder(meant, 360):.0f}: its motion is in both their ways",
            )


def _angle_deg(ours: Floats, other: Floats) -> float:
    """From the other's way to ours, each (2, 2) px from and to, degrees clockwise; nan where one stands or is behind
    the camera."""
    ways = [float(to[0] - before[0]) + 1j * float(to[1] - before[1]) for before, to in (ours, other)]
    if not min(map(abs, ways)) > STILL_PX:
        return math.nan
    return float(np.degrees(np.angle(ways[0] / ways[1])))


def _nearest(gaps: Floats) -> Floats:
    """(n,) px: how near two come from each frame to the next, of gaps (n, 2) px between them; inf where one is behind
    the camera."""
    steps = np.diff(gaps, axis=0, append=gaps[-1:])
    part = -np.sum(gaps * steps, axis=1) / np.maximum(np.sum(steps**2, axis=1), 1e-12)
    nearest = np.linalg.norm(gaps + part.clip(0, 1)[:, None] * steps, axis=1)
    return np.where(np.isnan(nearest), np.inf, nearest)
