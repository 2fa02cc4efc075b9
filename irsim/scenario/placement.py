"""Placement: occluders that hide a target in given frames get their place, and impossible placements are faults."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from irsim.errors import InputError, Notice
from irsim.motion import Crosses, Crossing
from irsim.occluders import Occluder
from irsim.scenario.model import Scenario
from irsim.scenario.occlusion_window import STILL_PX, InfeasibleError, Occlusion, no_frame
from irsim.scenario.placement_search import find_place
from irsim.scenario.visibility import TargetVisibility
from irsim.types import Floats, arrays_frozen

_CACHED = 32
"""Scenarios whose placements are cached: all severities of a suite in turn. Some take seconds."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Occluder at its place, with the occluded fraction of its target in each frame, where it has one."""

    screen: Occluder
    fractions: Floats | None = None


class _Key:
    """Cache key of a scenario: all its parts, whether or not disabled. Equal parts of another file match."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario.whole
        self.parts = tuple(getattr(scenario, key) for key in type(scenario).model_fields if key != "without")

    def __hash__(self) -> int:
        return hash((self.scenario.frames, self.scenario.seed))

    def __eq__(self, other: object) -> bool:
        try:
            return isinstance(other, _Key) and self.parts == other.parts
        except (TypeError, ValueError):  # a user's kind that holds an array
            return False


def placements(scenario: Scenario) -> tuple[Placed | InfeasibleError, ...]:
    """Return each occluder at its place, or the reason against it. Disabled parts count: occluders stay in place."""
    if all(occluder.hides is None for occluder in scenario.whole.occluders):
        return tuple(map(Placed, scenario.whole.occluders))
    return _cached_placements(_Key(scenario))


def placed_occluders(scenario: Scenario) -> tuple[Occluder, ...]:
    """Return the occluders, each at its place; InputError for an infeasible one."""
    found = []
    for occluder, result in zip(scenario.occluders, placements(scenario), strict=True):
        if isinstance(result, InfeasibleError):
            raise InputError(f"occluders.{occluder.name}.{result.key}: {result}")
        found.append(result.screen)
    return tuple(found)


def with_placements(scenario: Scenario) -> Scenario:
    """Return the scenario with every occluder at its place, and without its disabled parts."""
    return scenario.model_copy(update={"occluders": placed_occluders(scenario)}).shown


def infeasible(scenario: Scenario) -> Iterator[Notice]:
    """Yield impossible crossings and placements."""
    visibility = TargetVisibility(scenario.whole)
    for index, target in enumerate(scenario.targets):
        if isinstance(target.path, Crossing):
            try:
                check_crossing(visibility, index)
            except InfeasibleError as fault:
                yield Notice(("targets", index, "path", fault.key), str(fault))
    for index, result in enumerate(placements(scenario)):
        if isinstance(result, InfeasibleError):
            yield Notice(("occluders", index, result.key), str(result))


def check_crossing(visibility: TargetVisibility, index: int) -> None:
    """Raise InfeasibleError for a crossing that cannot happen."""
    target = visibility.scenario.targets[index]
    path, context = target.path, visibility.context
    assert isinstance(path, Crossing)
    if path.at_frame > visibility.scenario.frames - 1:
        raise InfeasibleError("at_frame", no_frame(path.at_frame, visibility.scenario.frames))
    frame = round(path.at_frame)
    for name in (path.target, target.id):
        if not visibility.trajectories[name].target.exists(frame):
            raise InfeasibleError(
                "at_frame", f"{name} does not exist in frame {frame}; allowed: a frame in which it does"
            )
    if isinstance(path, Crosses):
        _check_range(path, visibility, frame)
    if path.separation_speed_px(context) < STILL_PX:
        raise InfeasibleError(
            "angle_deg", f"at this speed and angle it never separates from {path.target}; allowed: another angle"
        )
    for name in (path.target, target.id):
        x, y = visibility.camera.project(visibility.trajectories[name].positions)[frame]
        if not visibility.scenario.camera.geometry.inside(x, y):
            raise InfeasibleError(
                "at_frame", f"{name} is outside the picture in frame {frame}; allowed: a frame in which it is inside"
            )


def _check_range(path: Crosses, visibility: TargetVisibility, frame: int) -> None:
    """Raise InfeasibleError where the other target, or the crossing, is behind the camera."""
    here, _, _, range_m = path.meeting(visibility.context)
    if not np.isfinite(here).all():
        raise InfeasibleError(
            "at_frame", f"{path.target} is outside the picture in frame {frame}; allowed: a frame in which it is inside"
        )
    if range_m + path.farther_m <= 0:
        away = round(range_m, 1)
        raise InfeasibleError("farther_m", f"{path.target} is at {away:g} m; allowed: more than {0 - away:g}")


@lru_cache(maxsize=_CACHED)
def _cached_placements(key: _Key) -> tuple[Placed | InfeasibleError, ...]:
    visibility = TargetVisibility(key.scenario)
    return tuple(
        _place(visibility, occluder) if occluder.hides is not None else Placed(occluder)
        for occluder in key.scenario.occluders
    )


def _place(visibility: TargetVisibility, occluder: Occluder) -> Placed | InfeasibleError:
    try:
        occlusion: Occlusion = find_place(visibility, occluder)
        return arrays_frozen(Placed(occlusion.screen, occlusion.fractions))
    except InfeasibleError as fault:
        return InfeasibleError(fault.key, str(fault))  # without its traceback, which would hold the frames' sprites
