"""Warnings about occluders that hide no target, and placed ones that hide too long, too much, or other targets."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from irsim.errors import Notice
from irsim.motion import Crossing, RelativePath
from irsim.scenario.model import Scenario
from irsim.scenario.occlusion_window import (
    FEW_FRAMES,
    MAX_EXCESS,
    TOLERANCE,
    Occlusion,
    target_and_frames,
)
from irsim.scenario.placement import Placed, placements, with_placements
from irsim.scenario.visibility import MAX_FRAMES, TargetVisibility

Occlusions = Mapping[int, Occlusion]
"""Occlusions by those occluders that are switched on and placed to hide a target, by index of the occluder."""


def occluder_without_effect(scenario: Scenario) -> Iterator[Notice]:
    """Warn of occluders at a given place that hide no target in any frame."""
    visibility = TargetVisibility(scenario)
    names = visibility.trajectories
    for index, occluder in enumerate(visibility.shown.occluders):
        at_place = occluder.hides is None
        if at_place and names and not any(visibility.ever_occludes(occluder, name) for name in names):
            yield Notice(("occluders", index), "it hides no target in any frame")


def placed_occluder_excessive(scenario: Scenario) -> Iterator[Notice]:
    """Warn of placed occluders that hide their target much longer or more than required, or that hide other targets.

    Fractions count for each occluder alone and for several together. Every placement must be feasible. An occluder is
    placed as if nothing were switched off; how long it hides its target depends on the parts that are switched off.
    """
    visibility = TargetVisibility(scenario)
    # Fractions from the placement search hold only while nothing is switched off.
    results = () if scenario.without else placements(scenario)
    known = {index: each.fractions for index, each in enumerate(results) if isinstance(each, Placed)}
    occlusions = {
        index: Occlusion(visibility, screen, occluder, known.get(index))
        for index, (occluder, screen) in enumerate(
            zip(scenario.occluders, with_placements(scenario).occluders, strict=True)
        )
        if occluder.hides in visibility.trajectories and scenario.is_on(occluder.name)
    }
    for index, occlusion in occlusions.items():
        for key, reason in (("frames", occlusion.too_long()), ("fraction", occlusion.too_much())):
            if reason is not None:
                yield Notice(("occluders", index, key), reason)
        lack = scenario.occluders[index].shortfall(occlusion.screen)
        if lack is not None:
            yield Notice(("occluders", index, lack[0]), lack[1])
    yield from _joint_excess(visibility, occlusions)
    yield from _other_targets(visibility, occlusions)


def _joint_excess(visibility: TargetVisibility, occlusions: Occlusions) -> Iterator[Notice]:
    """Warn of occluders that, together with other occluders of their target, exceed the required fraction by
    MAX_EXCESS.

    Only frames in which an occluder must hide the target count. Of several occluders with a common frame, the one with
    the largest required fraction is reported, and each pair once.
    """
    reported: set[tuple[int, int]] = set()
    for number, occlusion in occlusions.items():
        name, (first, last) = target_and_frames(occlusion.occluder)
        same = {key: other for key, other in occlusions.items() if target_and_frames(other.occluder)[0] == name}
        over: dict[int, float] = {}
        helpers: set[int] = set()
        for frame in range(first, last + 1):
            required = [other for other in same.values() if _requires(other, frame)]
            most = max(other.occluder.fraction for other in required)
            alone = any(other.fractions[frame] > other.occluder.fraction + MAX_EXCESS for other in required)
            others = [key for key, other in same.items() if key != number and other.fractions[frame] > TOLERANCE]
            if alone or occlusion.occluder.fraction < most or most + MAX_EXCESS >= 1 or not others:
                continue
            fraction = visibility.occluded([same[key].screen for key in (number, *others)], name, frame)
            if fraction > most + MAX_EXCESS:
                over[frame] = fraction
                helpers.update(others)
        if not helpers <= {other for other, helped in reported if helped == number}:
            reported |= {(number, helper) for helper in helpers}
            yield Notice(
                ("occluders", number, "fraction"),
                f"with {' and '.join(same[key].occluder.name for key in sorted(helpers))} it hides up to "
                f"{max(over.values()):.2f} of {name} in frames {min(over)} to {max(over)} instead of "
                f"{occlusion.occluder.fraction:g}: try frames farther apart, or less of each",
            )


def _requires(occlusion: Occlusion, frame: int) -> bool:
    first, last = target_and_frames(occlusion.occluder)[1]
    return first <= frame <= last


class _Run(NamedTuple):
    """Run of frames in which an occluder hides up to the fraction `most` of target `name` without need."""

    name: str
    first: int
    last: int
    most: float


def _other_targets(visibility: TargetVisibility, occlusions: Occlusions) -> Iterator[Notice]:
    """Warn of occluders that hide more than MAX_EXCESS of another target in more than FEW_FRAMES consecutive frames.

    If `follow` names a target, other targets count only if some occluder is placed to hide them. A target that moves
    relative to the hidden one, or that crosses it while it is hidden, is exempt.
    """
    if not occlusions:
        return
    wanted = {target_and_frames(occlusion.occluder)[0] for occlusion in occlusions.values()}
    followed = visibility.scenario.follow
    names = [name for name in visibility.trajectories if followed is None or name == followed or name in wanted]
    for number, occlusion in occlusions.items():
        own, _ = target_and_frames(occlusion.occluder)
        others = (name for name in names if name != own and not _intended(visibility, occlusion, name))
        found = [run for name in others if (run := _longest(visibility, occlusions, occlusion, name)) is not None]
        if found:
            run = max(found, key=lambda run: run.last - run.first)
            more = ", ".join(other.name for other in found if other is not run)
            yield Notice(
                ("occluders", number, "hides"),
                f"it also hides up to {run.most:.2f} of {run.name} in frames {run.first} to {run.last}"
                f"{f' (and {more})' if more else ''}, which is not required: "
                f"try {_remedy(visibility, occlusion, run, run.name in wanted)}",
            )


def _remedy(visibility: TargetVisibility, occlusion: Occlusion, run: _Run, wanted: bool) -> str:
    """Return the proposed change; for a target not `wanted` to be hidden, also the key that silences the warning."""
    own, (first, last) = target_and_frames(occlusion.occluder)
    beyond = math.ceil(max(_ranges_m(visibility, run.name, range(run.first, run.last + 1))))
    remedy = "other frames"
    if beyond < min(_ranges_m(visibility, own, range(first, last + 1))):
        remedy += f", or a range_m from {beyond} on"
    followed = visibility.scenario.targets[0].id
    if visibility.scenario.follow is None and not wanted and run.name != followed:
        remedy += f"; to ignore it, write 'follow: {followed}'"
    return remedy


def _ranges_m(visibility: TargetVisibility, name: str, frames: range) -> list[float]:
    """Return the distances of a target from the camera's first position, m, in those `frames` in which it is drawn."""
    drawn = ((frame, visibility.sprite(name, frame)) for frame in frames)
    return [visibility.range_from_origin_m(name, frame, sprite) for frame, sprite in drawn if sprite is not None]


def _intended(visibility: TargetVisibility, occlusion: Occlusion, name: str) -> bool:
    """Return True if the scenario couples two targets so that the occluder of one is bound to hide the other too."""
    own, (first, last) = target_and_frames(occlusion.occluder)
    for one, other in ((name, own), (own, name)):
        path = visibility.trajectories[one].target.path
        if isinstance(path, RelativePath) and path.target == other:
            return not isinstance(path, Crossing) or first <= path.at_frame <= last
    return False


def _longest(visibility: TargetVisibility, occlusions: Occlusions, occlusion: Occlusion, name: str) -> _Run | None:
    """Return the longest run, above FEW_FRAMES frames, in which an occluder hides more than MAX_EXCESS of a target.

    Up to MAX_FRAMES frames are sampled, densely enough to find every run of this length.
    """
    frames = visibility.scenario.frames
    own = [other for other in occlusions.values() if target_and_frames(other.occluder)[0] == name]
    found: _Run | None = None
    end = -1
    for frame in range(0, frames, max(FEW_FRAMES + 1, math.ceil(frames / MAX_FRAMES))):
        if frame <= end or _excess(visibility, own, occlusion, name, frame) <= MAX_EXCESS:
            continue
        fractions = {frame: _excess(visibility, own, occlusion, name, frame)}
        for step in (-1, 1):
            at = frame + step
            while 0 <= at < frames and (fraction := _excess(visibility, own, occlusion, name, at)) > MAX_EXCESS:
                fractions[at] = fraction
                at += step
        end, longest = max(fractions), FEW_FRAMES if found is None else found.last - found.first + 1
        if len(fractions) > longest:
            found = _Run(name, min(fractions), end, max(fractions.values()))
    return found


def _excess(visibility: TargetVisibility, own: list[Occlusion], occlusion: Occlusion, name: str, frame: int) -> float:
    """Return the fraction 0..1 of target `name` that an occluder hides beyond the target's `own` placed occluders.

    0 in frames in which those occluders must hide the target, and where the target is outside the picture.
    """
    if any(_requires(other, frame) for other in own):
        return 0.0
    fraction = visibility.occluded([occlusion.screen], name, frame)
    target = visibility.sprite(name, frame)
    if fraction <= MAX_EXCESS or target is None or not visibility.scenario.camera.geometry.inside(*target.center):
        return 0.0
    others = [other.screen for other in own if other.fractions[frame] > TOLERANCE]
    if not others:
        return fraction
    return visibility.occluded([occlusion.screen, *others], name, frame) - visibility.occluded(others, name, frame)
