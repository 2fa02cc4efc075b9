"""Warnings about occluders without effect, and about a target to follow that is mostly occluded."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from irsim.errors import Notice
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import TargetVisibility, sampled_frames

_RENDERED_FRAMES = 24
"""Frames, spread evenly, whose ground truth is rendered."""
_MOST = 0.5
"""Fraction of the frames in view from which a target more than half hidden is reported."""


def occluder_without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Warn of occluders at a place that hide no target in any frame."""
    visibility = TargetVisibility(scenario)
    for index, occluder in enumerate(visibility.shown.occluders):
        at_place = occluder.hides is None
        if (
            at_place
            and visibility.trajectories
            and not any(visibility.ever_occludes(occluder, name) for name in visibility.trajectories)
        ):
            yield Notice(("occluders", index), "it hides no target in any frame")


def target_mostly_occluded(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a target to follow that is more than half hidden in most frames.

    An occluder placed to hide it counts only where the target is hidden in all frames.
    """
    placed = {occluder.name for occluder in scenario.occluders if occluder.hides is not None}
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = [int(frame) for frame in sampled_frames(scenario.frames, _RENDERED_FRAMES) if target.exists(int(frame))]
    nearer = _nearer(scenario, target.id, frames)
    if not nearer:
        return
    enough_visible = 1 if nearer <= placed else (1 - _MOST) * len(frames)
    renderer, in_view, hidden = Renderer(scenario), 0, list[tuple[str, ...]]()
    for frame in frames:
        truth = renderer.scene(frame)[1].target(target.id)
        if truth is not None and truth.in_view is not False:
            in_view += 1
            if truth.hidden and truth.occluders:
                hidden.append(truth.occluders)
            elif in_view - len(hidden) >= enough_visible:
                return
    unplaced = sum(not placed.issuperset(by) for by in hidden)
    if hidden and (len(hidden) == in_view or unplaced > _MOST * in_view):
        by = " and ".join(dict.fromkeys(chain(*hidden)))
        yield Notice(
            ("targets", index, "path"),
            f"{target.id}, the target to follow, is more than half hidden by {by} in {len(hidden)} of the {in_view} "
            "frames checked; irsim info lists all of them",
        )


def _nearer(scenario: Scenario, name: str, frames: list[int]) -> set[str]:
    """Return the names of occluders and layers nearer than the target; without any, nothing needs to be rendered."""
    target = next(target for target in scenario.targets if target.id == name)
    if not frames:
        return set()
    places = target.path.positions(np.asarray(frames, dtype=np.float64), scenario.context, name)
    farthest_m = float(np.linalg.norm(places, axis=1).max())
    occluders = ((occluder.name, occluder.range_m) for occluder in scenario.occluders)
    shells = ((part, shell.range_m) for part, _, shell in scenario.background.parallax_surfaces())
    return {part for part, range_m in (*occluders, *shells) if range_m < farthest_m and scenario.is_on(part)}
