"""The target to follow, hidden for most of the time: by occluders, rows of trees or buildings, or clouds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irsim.doubts.looked import watched
from irsim.errors import Notice
from irsim.render import Renderer
from irsim.scenario import Scenario

LOOKED = 24
"""Frames, evenly spread, of which truth is asked: each is rendered for it."""
MOST = 0.5
"""It is warned of one that is more than half hidden in a larger share of the frames in which it is in view."""


def mostly_hidden(scenario: Scenario) -> Iterator[Notice]:
    """Whom trackers follow, where what hides it leaves less than half of it in most of the frames. Of what is
    placed by whom it hides it is told in how many frames it does."""
    told = {occluder.name for occluder in scenario.occluders if occluder.hides is not None}
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = [int(frame) for frame in watched(scenario.frames, LOOKED) if target.exists(int(frame))]
    if not _something_nearer(scenario, target.id, frames):
        return
    renderer = Renderer(scenario)
    hidden, seen, by = 0, 0, dict[str, None]()
    for frame in frames:
        truth = renderer.scene(frame)[1].target(target.id)
        if truth is not None and truth.in_view is not False:
            if truth.hidden and not told.issuperset(truth.occluders):
                hidden += 1
                by |= dict.fromkeys(truth.occluders)
            else:
                seen += 1
                if seen >= (1 - MOST) * len(frames):
                    return
    if hidden > MOST * (hidden + seen):
        yield Notice(
            ("targets", index, "path"),
            f"{target.id}, whom trackers follow, is more than half hidden, by {' and '.join(by)}, in {hidden} of the "
            f"{hidden + seen} frames that were looked at; irsim info tells all of them",
        )


def _something_nearer(scenario: Scenario, name: str, frames: list[int]) -> bool:
    """Could anything be before the target? It is drawn for that only then."""
    target = next(target for target in scenario.targets if target.id == name)
    if not frames:
        return False
    places = target.path.positions(np.asarray(frames, dtype=np.float64), scenario.stage, name)
    farthest_m = float(np.linalg.norm(places, axis=1).max())
    occluders = (
        occluder.range_m for occluder in scenario.occluders if occluder.hides is None and scenario.is_on(occluder.name)
    )
    shells = (shell.range_m for part, _, shell in scenario.background.shells() if scenario.is_on(part))
    return any(range_m < farthest_m for range_m in (*occluders, *shells))
