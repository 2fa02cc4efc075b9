"""Warnings about targets: their shape, when they exist, and whether they are in the picture."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import Notice
from irsim.motion import CameraTrajectory
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import MAX_FRAMES, frames_present, sampled_frames

_STILL = 0.05
"""Fraction of the period at which a rotating part looks the same that its apparent rotation covers in all frames."""
_MOST = 0.5
"""Fraction of frames outside the picture from which a target is reported."""


def shape_implausible(scenario: Scenario) -> Iterator[Notice]:
    """Warn of implausible dimensions of a shape."""
    for index, target in enumerate(scenario.targets):
        if target.shape.warning is not None:
            key, reason = target.shape.warning
            yield Notice(("targets", index, "shape", key), reason)


def rotation_aliased(scenario: Scenario) -> Iterator[Notice]:
    """Warn of rotating parts that look the same in every frame."""
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


def path_after_last_frame(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets whose path begins after the last frame."""
    for index, target in enumerate(scenario.targets):
        if target.path.begins > scenario.frames - 1:
            begins = f"its path begins at frame {target.path.begins:g}, after the last, {scenario.frames - 1}"
            yield Notice(("targets", index, "path"), f"{target.id} exists in no frame: {begins}")


def event_after_last_frame(scenario: Scenario) -> Iterator[Notice]:
    """Warn of events after the last frame."""
    last = scenario.frames - 1
    for at, frame in _beginnings(scenario):
        if frame > last:
            yield Notice(at, f"it begins at frame {frame}, after the last, {last}")
    for index, target in enumerate(scenario.targets):
        for number, (first, until) in enumerate(target.absent):
            if first <= last < until:
                at = ("targets", index, "absent", number)
                yield Notice(at, f"it lasts until frame {until}, after the last, {last}")


def _beginnings(scenario: Scenario) -> Iterator[tuple[tuple[str | int, ...], int]]:
    """Yield path and frame of absences, and of events of the camera at listed frames."""
    for index, target in enumerate(scenario.targets):
        for number, (first, _) in enumerate(target.absent):
            yield ("targets", index, "absent", number), first
    for index, fault in enumerate(scenario.camera.faults):
        for number, frame in enumerate(fault.frames):
            yield ("camera", "faults", index, "frames", number), frame
    if scenario.camera.correction is not None:
        for number, frame in enumerate(scenario.camera.correction.frames):
            yield ("camera", "correction", "frames", number), frame


def target_always_absent(scenario: Scenario) -> Iterator[Notice]:
    """Warn of targets that are absent in all frames."""
    for index, target in enumerate(scenario.targets):
        if target.absent and not any(map(target.exists, range(scenario.frames))):
            yield Notice(("targets", index, "absent"), f"{target.id} exists in no frame")


def target_out_of_picture(scenario: Scenario) -> Iterator[Notice]:
    """Warn of a target to follow whose center is outside the picture in most frames, of at most MAX_FRAMES."""
    scenario = scenario.shown
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = sampled_frames(scenario.frames, MAX_FRAMES)
    frames = frames_present(target, frames)
    context = scenario.context
    places = []
    if len(frames):
        mount = CameraTrajectory.of(scenario.motions, frames, context)
        places = mount.seen(target.path.positions(frames, context, target.id)).tolist()
    inside = sum(scenario.camera.geometry.inside(x, y) for x, y in places)
    outside = len(places) - inside
    at = ("targets", index, "path")
    if not inside:
        yield Notice(at, f"{target.id}, the target to follow, is never in the picture")
    elif outside > _MOST * len(places):
        which = "in which it exists" if scenario.frames <= MAX_FRAMES else "checked"
        message = f"is outside the picture in {outside} of the {len(places)} frames {which}; irsim info lists them"
        yield Notice(at, f"{target.id}, the target to follow, {message}")
