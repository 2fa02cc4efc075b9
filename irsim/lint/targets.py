"""Warnings about targets: implausible shapes, late events, and targets out of the picture or hidden."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from irsim.config.base import KeyPath
from irsim.errors import Notice
from irsim.lint.sampling import target_to_follow
from irsim.motion import CameraTrajectory
from irsim.render.frame import Renderer
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, frames_present, sampled_frames
from irsim.targets.target import Target
from irsim.types import Floats

_STILL = 0.05
"""Largest apparent rotation in all frames that counts as standstill, in units of the angle of rotational symmetry."""
_MOST = 0.5
"""Fraction of frames outside the picture, or more than half hidden, from which a target is reported."""
_RENDERED_FRAMES = 24
"""Number of evenly spread frames whose ground truth is rendered."""


def shape_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of implausible dimensions of a shape."""
    for index, target in enumerate(scenario.targets):
        if target.shape.warning is not None:
            key, reason = target.shape.warning
            yield Notice(("targets", index, "shape", key), reason)


def rotation_aliased(scenario: Scenario) -> Iterator[Notice]:
    """Warn of rotating parts that look alike in every frame, as the frame rate samples whole periods."""
    rate_hz = scenario.camera.rate_hz
    for index, target in enumerate(scenario.targets):
        for key, symmetry in target.shape.rotational_symmetry.items():
            hz = getattr(target.shape, key)
            periods = hz * symmetry / rate_hz
            whole, later = round(periods), scenario.frames - 1
            if whole >= 1 and later >= 1 and abs(periods - whole) * later < _STILL:
                same = f"{hz:g} turns a second look the same at {rate_hz:g} frames a second"
                message = f"the rotation seems to stand still: {same}; try {0.97 * hz:.3g}"
                yield Notice(("targets", index, "shape", key), message)


def event_after_last_frame(scenario: Scenario) -> Iterator[Notice]:
    """Warn of events of targets and of the camera that lie after the last frame."""
    last = scenario.frames - 1
    for at, frame in _beginnings(scenario):
        if frame > last:
            yield Notice(at, f"it begins at frame {frame}, after the last, {last}")
    for index, target in enumerate(scenario.targets):
        for number, (first, until) in enumerate(target.absent):
            if first <= last < until:
                at = ("targets", index, "absent", number)
                yield Notice(at, f"it lasts until frame {until}, after the last, {last}")


def _beginnings(scenario: Scenario) -> Iterator[tuple[KeyPath, int]]:
    """Yield the key path and the first frame of each absence of a target and of each camera event at a listed frame."""
    for index, target in enumerate(scenario.targets):
        for number, (first, _) in enumerate(target.absent):
            yield ("targets", index, "absent", number), first
    for index, fault in enumerate(scenario.camera.faults):
        for number, frame in enumerate(fault.frames):
            yield ("camera", "faults", index, "frames", number), frame
    if scenario.camera.correction is not None:
        for number, frame in enumerate(scenario.camera.correction.frames):
            yield ("camera", "correction", "frames", number), frame


def target_in_no_frame(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets that exist in no frame, as their path begins too late or they are always absent."""
    last = scenario.frames - 1
    for index, target in enumerate(scenario.targets):
        begins = target.path.begins
        if begins > last:
            reason = f"exists in no frame: its path begins at frame {begins:g}, after the last, {last}"
            yield Notice(("targets", index, "path"), f"{target.id} {reason}")
        if target.absent and not any(map(target.exists, range(scenario.frames))):
            yield Notice(("targets", index, "absent"), f"{target.id} exists in no frame")


def target_out_of_picture(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a target to follow whose center is outside the picture in most of up to MAX_FRAMES frames."""
    followed = target_to_follow(scenario)
    if followed is None:
        return
    (index, target), context = followed, scenario.context
    frames = frames_present(target, sampled_frames(scenario.frames, MAX_FRAMES))
    pixels = []
    if len(frames):
        camera = CameraTrajectory.of(scenario.motions, frames, context)
        pixels = camera.project(target.path.positions(frames, context, target.id)).tolist()
    inside = sum(scenario.camera.geometry.inside(x, y) for x, y in pixels)
    outside, at = len(pixels) - inside, ("targets", index, "path")
    if not inside:
        yield Notice(at, f"{target.id}, the target to follow, is never in the picture")
    elif outside > _MOST * len(pixels):
        which = "in which it exists" if scenario.frames <= MAX_FRAMES else "checked"
        message = f"is outside the picture in {outside} of the {len(pixels)} frames {which}; irsim info lists them"
        yield Notice(at, f"{target.id}, the target to follow, {message}")


def target_mostly_occluded(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a target to follow that is more than half hidden in most frames.

    Occluders that the scenario places to hide the target count only if the target is hidden in all frames.
    """
    placed = {occluder.name for occluder in scenario.occluders if occluder.hides is not None}
    followed = target_to_follow(scenario)
    if followed is None:
        return
    index, target = followed
    frames = frames_present(target, sampled_frames(scenario.frames, _RENDERED_FRAMES))
    nearer = _nearer(scenario, target, frames)
    if not nearer:
        return
    enough_visible = 1 if nearer <= placed else (1 - _MOST) * len(frames)
    renderer, in_view, hidden = Renderer(scenario), 0, list[tuple[str, ...]]()
    for frame in frames.astype(int).tolist():
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


def _nearer(scenario: Scenario, target: Target, frames: Floats) -> set[str]:
    """Return the names of occluders and layers nearer than the target; if there are none, no frame is rendered."""
    positions = target.path.positions(frames, scenario.context, target.id)
    farthest_m = float(np.linalg.norm(positions, axis=1).max(initial=0.0))
    occluders = ((occluder.name, occluder.range_m) for occluder in scenario.occluders)
    surfaces = ((part, surface.range_m) for part, _, surface in scenario.background.parallax_surfaces())
    return {part for part, range_m in (*occluders, *surfaces) if range_m < farthest_m and scenario.is_on(part)}
