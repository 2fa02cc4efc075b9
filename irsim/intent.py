"""What a scenario asks for by its effect: occluders that hide a target in given frames, crossings.

An occluder with an intent gets the place that does what it says, found from the target's path; what
cannot be done is told with its place in the scenario.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from irsim.errors import InputError, Notice
from irsim.motion import Crosses, Crossing
from irsim.occluders import Bar, Occluder
from irsim.scenario import Scenario
from irsim.sprite import Sprite
from irsim.types import Box, Floats
from irsim.watch import Watch

LEEWAY = 0.02
"""How far truth's visible fraction may be off what an intent says."""
_MARGIN_PX = 1.0
"""An occluder reaches this far past what it hides: pixels that both cover in part are not hidden by parts."""
_TRACE = 1e-3
"""Share of a target's area, on each side, that counts as nothing: a point's far skirts."""
_STILL_PX = 0.02
"""A target that moves less than this in a frame stands, as far as getting out from behind something goes."""
MUCH = 2
"""An occluder that hides for so many times as long as asked, and as the target takes to go by, is warned of."""
_ROUNDS = 12
_THIN_PX = 1.0
_BULGE = 4.0
"""How far, in windows, a crown may stick out above what it is placed over."""


class UnmetError(ValueError):
    """An intent that cannot be met: key, and why."""

    def __init__(self, key: str, why: str) -> None:
        super().__init__(why)
        self.key = key


def placed(scenario: Scenario) -> tuple[Occluder, ...]:
    """The occluders, each with its place. InputError for an intent that cannot be met.

    What --without switches off plays no part: an occluder stays where it is.
    """
    if all(occluder.hides is None for occluder in scenario.occluders):
        return scenario.occluders
    watch = Watch(scenario.whole)
    found = []
    for occluder in scenario.occluders:
        try:
            found.append(_place(watch, occluder) if occluder.hides is not None else occluder)
        except UnmetError as unmet:
            raise InputError(f"occluders.{occluder.name}.{unmet.key}: {unmet}") from None
    return tuple(found)


def unmet(scenario: Scenario) -> Iterator[Notice]:
    """What the scenario asks for that cannot be, with its place."""
    watch = Watch(scenario.whole)
    for index, target in enumerate(scenario.targets):
        if isinstance(target.path, Crossing):
            try:
                _check_crossing(watch, index)
            except UnmetError as fault:
                yield Notice(("targets", index, "path", fault.key), str(fault))
    for index, occluder in enumerate(scenario.occluders):
        if occluder.hides is not None:
            try:
                _place(watch, occluder)
            except UnmetError as fault:
                yield Notice(("occluders", index, fault.key), str(fault))


def overlong(scenario: Scenario) -> Iterator[Notice]:
    """Occluders that hide whom they shall hide for much longer than asked. Every intent of the scenario can be met.

    Where they stand does not depend on what is switched off; for how long they hide does.
    """
    watch, whole = Watch(scenario), Watch(scenario.whole)
    for index, occluder in enumerate(scenario.occluders):
        if occluder.hides is None or occluder.hides not in watch.courses:
            continue
        name, (first, last) = occluder.hides, occluder.frames or (0, 0)
        begin, end = _hidden(watch, _place(whole, occluder), occluder)
        asked, count = last - first + 1, end - begin + 1
        if count > MUCH * asked + _passing(watch, occluder, name):
            stands = "foot_px" in occluder.placing and _goes_up_or_down(whole, occluder, name)
            other = "a place" if isinstance(occluder, Bar) else "a bar, or a place"
            why = f"a {occluder.kind} stands on the ground; try a bar, or smoke" if stands else f"try {other}"
            yield Notice(
                ("occluders", index, "frames"),
                f"it hides {name} in frames {begin} to {end}, {count} of them where {asked} are asked: {why}",
            )


def _hidden(watch: Watch, screen: Occluder, occluder: Occluder) -> tuple[int, int]:
    """First and last of the frames, around those that were asked for, in which it hides as much as asked."""
    name, (first, last) = occluder.hides or "", occluder.frames or (0, 0)

    def until(frames: range, ends: int) -> int:
        for index in frames:
            if watch.hidden(screen, name, index) < occluder.fraction - LEEWAY:
                break
            ends = index
        return ends

    return until(range(first - 1, -1, -1), first), until(range(last + 1, watch.scenario.frames), last)


def _passing(watch: Watch, occluder: Occluder, name: str) -> int:
    """Frames in which the target goes by its own length."""
    own, speed = watch.sprite(name, (occluder.frames or (0, 0))[0]), _speed(watch, occluder, name)
    return math.ceil(own.box.diagonal / speed) if own is not None and speed > _STILL_PX else 0


def _speed(watch: Watch, occluder: Occluder, name: str) -> float:
    """Of the target in the frames that are asked for, px a frame at the occluder's range."""
    first, last = occluder.frames or (0, 0)
    pixels = watch.way(name, occluder.range_m)
    steps = np.hypot(*np.diff(pixels, axis=0).T) if len(pixels) > 1 else np.zeros(1)
    return float(np.median(steps[max(first - 1, 0) : last + 1]))


def _place(watch: Watch, occluder: Occluder) -> Occluder:
    """The occluder with the place that its intent asks for; UnmetError where there is none."""
    name, (first, last) = occluder.hides or "", occluder.frames or (0, 0)
    if last >= watch.scenario.frames:
        raise UnmetError("frames", _no_frame(last, watch.scenario.frames))
    window = _window(watch, occluder, name, range(first, last + 1))
    sideways = _goes_up_or_down(watch, occluder, name)
    try:
        screen = _dense_enough(watch, occluder, name, window, sideways)
    except ValueError as error:
        raise UnmetError("hides", str(error)) from None
    _clear_elsewhere(watch, screen, occluder, name, window)
    return screen


def _window(watch: Watch, occluder: Occluder, name: str, frames: range) -> Box:
    """What has to be covered, px of the unmoved camera at the occluder's range."""
    boxes = []
    for index in frames:
        target = watch.sprite(name, index)
        if target is None:
            raise UnmetError("frames", f"{name} is not there at frame {index}; allowed: frames in which it is")
        if not watch.scenario.camera.geometry.inside(*target.center):
            raise UnmetError(
                "frames", f"{name} is out of the picture at frame {index}; allowed: frames in which it is seen"
            )
        away = watch.first_m(name, index, target)
        if away <= occluder.range_m:
            raise UnmetError(
                "range_m",
                f"{name} is {away:.0f} m away at frame {index}, nearer than {occluder.range_m:.0f} m; "
                "allowed: less than its range",
            )
        corners = watch.at_first(_corners(target), occluder.range_m, index)
        if not np.isfinite(corners).all():
            raise UnmetError(
                "hides", f"the unmoved camera cannot see where {name} is at frame {index}; allowed: a place"
            )
        boxes.append((*corners.min(axis=0), *corners.max(axis=0)))
    edges = np.array(boxes)
    low, high = edges[:, :2].min(axis=0) - _MARGIN_PX, edges[:, 2:].max(axis=0) + _MARGIN_PX
    return Box.from_edges(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def _goes_up_or_down(watch: Watch, occluder: Occluder, name: str) -> bool:
    """Does the target move more up or down than across in those frames (and the frame before and after)?"""
    first, last = occluder.frames or (0, 0)
    around = [max(first - 1, 0), min(last + 1, watch.scenario.frames - 1)]
    across, down = np.abs(np.diff(watch.way(name, occluder.range_m)[around], axis=0)[0])
    return bool(down > across)


def _dense_enough(watch: Watch, occluder: Occluder, name: str, window: Box, sideways: bool) -> Occluder:
    """The occluder over the window, no denser or larger than it has to be."""
    first, last = occluder.frames or (0, 0)
    looked = np.unique(np.linspace(first, last, 5).round().astype(int)).tolist()
    stage = watch.stage

    def of(share: float) -> Occluder:
        part = window if occluder.thins else _part(window, share, sideways)
        screen = occluder.over(part, share, stage)
        return screen.rooted(max(window.bottom, _ground(watch))) if sideways else screen

    def least(share: float, frames: list[int]) -> float:
        screen = of(share)
        return min(watch.hidden(screen, name, index) for index in frames)

    low, high = 0.0 if occluder.thins else -_BULGE, 1.0
    wanted = min(occluder.fraction, 1 - LEEWAY / 4)
    if occluder.fraction < 1:
        for _ in range(_ROUNDS):
            middle = (low + high) / 2
            low, high = (low, middle) if least(middle, looked) >= wanted else (middle, high)
    reached = least(high, list(range(first, last + 1)))
    if reached < occluder.fraction - LEEWAY:
        raise UnmetError("fraction", f"it can hide {reached:.2f} of {name} at most; allowed: so much")
    return of(high)


def _ground(watch: Watch) -> float:
    """The least y, px of the unmoved camera, at which something can stand on the ground: not in the sky."""
    geometry = watch.stage.geometry
    if watch.scenario.background.clear(watch.stage) is None:
        return -math.inf
    return float(geometry.axis_px[1] + math.tan(geometry.elevation_rad) / geometry.ifov_rad)


def _clear_elsewhere(watch: Watch, screen: Occluder, occluder: Occluder, name: str, window: Box) -> None:
    """UnmetError where the target is hidden well outside of the frames that were asked for."""
    first, last = occluder.frames or (0, 0)
    speed = _speed(watch, occluder, name)
    own = watch.sprite(name, first)
    drawn = screen.draw(watch.sight(first))
    excess = 0.0 if drawn is None else max(drawn.box.w - window.w, drawn.box.h - window.h, 0.0)
    size = 0.0 if own is None else own.box.diagonal
    slack = math.ceil((size + excess + 6) / speed) if speed > _STILL_PX else 0
    slack += math.ceil(max(getattr(screen, "grow_frames", 0.0), getattr(screen, "fade_frames", 0.0)))
    for index in [*range(first - slack - 1, -1, -1), *range(last + slack + 1, watch.scenario.frames)]:
        share = watch.hidden(screen, name, index)
        if share > LEEWAY:
            raise UnmetError(
                "frames",
                f"what hides {name} in frames {first} to {last} hides {share:.2f} of it at frame {index} too; "
                "allowed: frames at whose ends it comes and goes, or smoke, or a place",
            )


def _check_crossing(watch: Watch, index: int) -> None:
    """UnmetError where a crossing cannot happen."""
    target = watch.scenario.targets[index]
    path, stage = target.path, watch.stage
    assert isinstance(path, Crossing)
    if path.at_frame > watch.scenario.frames - 1:
        raise UnmetError("at_frame", _no_frame(path.at_frame, watch.scenario.frames))
    frame = round(path.at_frame)
    for name in (path.target, target.id):
        if not watch.courses[name].target.exists(frame):
            raise UnmetError("at_frame", f"{name} is not there at frame {frame}; allowed: a frame in which it is")
    if isinstance(path, Crosses):
        _check_range(path, watch, frame)
    for name in (path.target, target.id):
        x, y = watch.mount.seen(watch.courses[name].positions)[frame]
        if not watch.scenario.camera.geometry.inside(x, y):
            raise UnmetError(
                "at_frame", f"{name} is out of the picture at frame {frame}; allowed: a frame in which it is seen"
            )
    if path.parting_px(stage) < _STILL_PX:
        raise UnmetError(
            "angle_deg", f"at this speed and angle it never parts from {path.target}; allowed: another one"
        )


def _check_range(path: Crosses, watch: Watch, frame: int) -> None:
    """UnmetError where the other is behind the camera at `frame`, or the crossing would be."""
    here, _, _, range_m = path.meeting(watch.stage)
    if not np.isfinite(here).all():
        raise UnmetError(
            "at_frame", f"{path.target} is not in the picture at frame {frame}; allowed: a frame in which it is"
        )
    if range_m + path.farther_m <= 0:
        away = round(range_m, 1)
        raise UnmetError("farther_m", f"{path.target} is {away:g} m away; allowed: more than {0 - away:g}")


def _no_frame(index: float, frames: int) -> str:
    """Why a frame is not there, and how to render fewer without doing away with it."""
    return (
        f"there is no frame {index:g}; allowed: 0 to {frames - 1}, or more frames, of which --frames {frames} "
        "renders the first"
    )


def _corners(sprite: Sprite) -> Floats:
    """(4, 2) px: corners of what holds all of a sprite's area but a trace."""
    ends = []
    for axis, origin in ((0, sprite.x0), (1, sprite.y0)):
        sums = np.cumsum(sprite.cover.sum(axis=axis))
        inside = np.flatnonzero(
            (sums > _TRACE * sums[-1]) & (sums - np.diff(sums, prepend=0.0) < (1 - _TRACE) * sums[-1])
        )
        ends.append((origin + inside[0] - 0.5, origin + inside[-1] + 0.5))
    (left, right), (top, bottom) = ends
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def _part(window: Box, share: float, sideways: bool) -> Box:
    """The lower or the right part of a window; with shares below 0 what lies below or right of it."""
    if sideways:
        left = window.right - share * window.w
        return Box.from_edges(left, window.top, max(window.right, left + _THIN_PX), window.bottom)
    top = window.bottom - share * window.h
    return Box.from_edges(window.left, top, window.right, max(window.bottom, top + _THIN_PX))
