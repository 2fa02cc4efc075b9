"""The target to follow, hidden for most of the time: by occluders, rows of trees or buildings, or clouds."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from irsim.errors import Notice
from irsim.lint.looked import watched
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario

LOOKED = 24
"""Frames, evenly spread, of which truth is asked: each is rendered for it."""
MOST = 0.5
"""It is warned of one that is more than half hidden in a larger share of the frames in which it is in view."""


def mostly_hidden(scenario: Scenario) -> Iterator[Notice]:
    """Whom trackers follow, where what hides it leaves less than half of it in most of the frames; in all of them,
    where that is asked for, by what is placed by whom it hides."""
    told = {occluder.name for occluder in scenario.occluders if occluder.hides is not None}
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = [int(frame) for frame in watched(scenario.frames, LOOKED) if target.exists(int(frame))]
    nearer = _nearer(scenario, target.id, frames)
    if not nearer:
        return
    enough = 1 if nearer <= told else (1 - MOST) * len(frames)
    renderer, looked, hidden = Renderer(scenario), 0, list[tuple[str, ...]]()
    for frame in frames:
        truth = renderer.scene(frame)[1].target(target.id)
        if truth is not None and truth.in_view is not False:
            looked += 1
            if truth.hidden and truth.occluders:
                hidden.append(truth.occluders)
            elif looked - len(hidden) >= enough:
                return
    unasked = sum(not told.issuperset(by) for by in hidden)
    if hidden and (len(hidden) == looked or unasked > MOST * looked):
        by = " and ".join(dict.fromkeys(chain(*hidden)))
        yield Notice(
            ("targets", index, "path"),
            f"{target.id}, whom trackers follow, is more than half hidden, by {by}, in {len(hidden)} of the {looked} "
            "frames that were looked at; irsim info tells all of them",
        )


def _nearer(scenario: Scenario, name: str, frames: list[int]) -> set[str]:
    """Names of what could be before the target. It is drawn for that only where there is any."""
    target = next(target for target in scenario.targets if target.id == name)
    if not frames:
        return set()
    places = target.path.positions(np.asarray(frames, dtype=np.float64), scenario.context, name)
    farthest_m = float(np.linalg.norm(places, axis=1).max())
    occluders = ((occluder.name, occluder.range_m) for occluder in scenario.occluders)
    shells = ((part, shell.range_m) for part, _, shell in scenario.background.parallax_surfaces())
    return {part for part, range_m in (*occluders, *shells) if range_m < farthest_m and scenario.is_on(part)}
