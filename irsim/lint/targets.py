"""Targets and what hides them."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.errors import Notice
from irsim.lint.looked import existing, watched
from irsim.motion import CameraTrajectory
from irsim.scenario.model import Scenario
from irsim.scenario.visibility import LOOKED, Watch

STILL = 0.05
"""Of the way to the next place at which they look the same, that turning parts go in all frames: less is not seen."""
MOST = 0.5
"""It is warned of a target that is outside the picture in a larger share of the frames in which it is there."""


def odd_shapes(scenario: Scenario) -> Iterator[Notice]:
    for index, target in enumerate(scenario.targets):
        if target.shape.warning is not None:
            key, why = target.shape.warning
            yield Notice(("targets", index, "shape", key), why)


def standing_still(scenario: Scenario) -> Iterator[Notice]:
    """Parts that turn so fast that each frame finds them where they look the same, as a real camera would."""
    rate_hz = scenario.camera.rate_hz
    for index, target in enumerate(scenario.targets):
        for key, places in target.shape.rotational_symmetry.items():
            hz = getattr(target.shape, key)
            passed = hz * places / rate_hz
            whole, later = round(passed), scenario.frames - 1
            if whole >= 1 and later >= 1 and abs(passed - whole) * later < STILL:
                alike = f"{hz:g} turns a second look alike in each of {rate_hz:g} frames a second"
                what = f"what turns seems to stand still: {alike}; try {0.97 * hz:.3g}"
                yield Notice(("targets", index, "shape", key), what)


def too_late(scenario: Scenario) -> Iterator[Notice]:
    for index, target in enumerate(scenario.targets):
        if target.path.begins > scenario.frames - 1:
            begins = f"its way begins at frame {target.path.begins:g}, after the last, {scenario.frames - 1}"
            yield Notice(("targets", index, "path"), f"{target.id} is there in no frame: {begins}")


def past_the_end(scenario: Scenario) -> Iterator[Notice]:
    """What is to happen at frames after the last."""
    last = scenario.frames - 1
    for place, frame in _beginnings(scenario):
        if frame > last:
            yield Notice(place, f"it begins at frame {frame}, after the last, {last}")
    for index, target in enumerate(scenario.targets):
        for number, (first, until) in enumerate(target.absent):
            if first <= last < until:
                at = ("targets", index, "absent", number)
                yield Notice(at, f"it goes on until frame {until}, after the last, {last}")


def _beginnings(scenario: Scenario) -> Iterator[tuple[tuple[str | int, ...], int]]:
    """Place and frame of absences, and of what happens to the camera at listed frames."""
    for index, target in enumerate(scenario.targets):
        for number, (first, _) in enumerate(target.absent):
            yield ("targets", index, "absent", number), first
    for index, fault in enumerate(scenario.camera.faults):
        for number, frame in enumerate(fault.frames):
            yield ("camera", "faults", index, "frames", number), frame
    if scenario.camera.correction is not None:
        for number, frame in enumerate(scenario.camera.correction.frames):
            yield ("camera", "correction", "frames", number), frame


def nowhere(scenario: Scenario) -> Iterator[Notice]:
    """Targets that are absent in all frames."""
    for index, target in enumerate(scenario.targets):
        if target.absent and not any(map(target.exists, range(scenario.frames))):
            yield Notice(("targets", index, "absent"), f"{target.id} is there in no frame")


def hardly_seen(scenario: Scenario) -> Iterator[Notice]:
    """The target to follow, where its middle is outside the picture in most frames in which it is there (of long
    scenarios: in LOOKED evenly spread ones)."""
    scenario = scenario.shown
    index, target = next(
        ((index, target) for index, target in enumerate(scenario.targets) if scenario.follow in (None, target.id)),
        (0, None),
    )
    if target is None or not scenario.is_on(target.id):
        return
    frames = watched(scenario.frames, LOOKED)
    frames = existing(target, frames)
    context = scenario.context
    places = []
    if len(frames):
        mount = CameraTrajectory.of(scenario.motions, frames, context)
        places = mount.seen(target.path.positions(frames, context, target.id)).tolist()
    inside = sum(scenario.camera.geometry.inside(x, y) for x, y in places)
    outside = len(places) - inside
    whom, at = f"{target.id}, whom trackers follow,", ("targets", index, "path")
    if not inside:
        yield Notice(at, f"{whom} is never in the picture")
    elif outside > MOST * len(places):
        looked = "in which it is there" if scenario.frames <= LOOKED else "that were looked at"
        what = f"{whom} is out of the picture in {outside} of the {len(places)} frames {looked}; irsim info tells which"
        yield Notice(at, what)


def idle(scenario: Scenario) -> Iterator[Notice]:
    """Occluders with a place that hide no target in any frame, where there are targets."""
    watch = Watch(scenario)
    for index, occluder in enumerate(watch.shown.occluders):
        with_place = occluder.hides is None
        if with_place and watch.courses and not any(watch.meets(occluder, name) for name in watch.courses):
            yield Notice(("occluders", index), "it hides no target in any frame")
