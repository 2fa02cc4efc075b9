"""Whom occluders that are placed by whom they hide do hide besides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from irsim.errors import Notice
from irsim.motion import Crossing, RelativePath
from irsim.scenario.placement_hold import FEW, LEEWAY, MUCH, Hold
from irsim.scenario.placement_together import Holds
from irsim.scenario.placement_window import asked
from irsim.scenario.visibility import LOOKED, Watch


@dataclass(frozen=True)
class _Run:
    """Frames in a row in which an occluder hides some of target `name`, up to `most`, that nobody asks it to."""

    name: str
    first: int
    last: int
    most: float

    @property
    def length(self) -> int:
        return self.last - self.first + 1


def besides(watch: Watch, holds: Holds) -> Iterator[Notice]:
    """Occluders that hide more than MUCH of another target in more than FEW frames in a row that nobody asks for.

    Where `follow` names a target, others count only if something shall hide them. Those that go where they do because
    whom the occluder hides does (companions) count as meant, and one that it crosses while it is hidden.
    """
    if not holds:
        return
    wanted = {asked(hold.occluder)[0] for hold in holds.values()}
    followed = watch.scenario.follow
    names = [name for name in watch.courses if followed is None or name == followed or name in wanted]
    for number, hold in holds.items():
        whom, _ = asked(hold.occluder)
        others = (name for name in names if name != whom and not _meant(watch, hold, name))
        found = [run for name in others if (run := _longest(watch, holds, hold, name)) is not None]
        if found:
            run = max(found, key=lambda run: run.length)
            more = [other.name for other in found if other is not run]
            yield Notice(
                ("occluders", number, "hides"),
                f"it hides {run.name} too, up to {run.most:.2f} of it in frames {run.first} to {run.last}"
                f"{_and(more)}, where nobody asks that: try {_help(watch, hold, run, run.name in wanted)}",
            )


def _and(names: list[str]) -> str:
    """What to say of further targets."""
    if not names:
        return ""
    return f" (and {names[0]} as well)" if len(names) == 1 else f" (and {len(names)} more, such as {names[0]})"


def _help(watch: Watch, hold: Hold, run: _Run, wanted: bool) -> str:
    """What keeps it from hiding them, or from being told so of one that nothing is `wanted` to hide."""
    whom, (first, last) = asked(hold.occluder)
    beyond = math.ceil(max(_ranges_m(watch, run.name, range(run.first, run.last + 1))))
    range_m = f", or a range_m from {beyond} on" if beyond < min(_ranges_m(watch, whom, range(first, last + 1))) else ""
    followed = watch.scenario.targets[0].id
    free = watch.scenario.follow is None and not wanted and run.name != followed
    return f"other frames{range_m}" + (f"; if it does not matter, say so by 'follow: {followed}'" if free else "")


def _ranges_m(watch: Watch, name: str, frames: range) -> list[float]:
    """How far a target is from the camera's first place, m, in those of the frames in which it is drawn."""
    drawn = ((index, watch.sprite(name, index)) for index in frames)
    return [watch.first_m(name, index, sprite) for index, sprite in drawn if sprite is not None]


def _meant(watch: Watch, hold: Hold, name: str) -> bool:
    """Does whoever hides one of two see from their paths that it hides the other?"""
    whom, (first, last) = asked(hold.occluder)
    for one, other in ((name, whom), (whom, name)):
        path = watch.courses[one].target.path
        if isinstance(path, RelativePath) and path.target == other:
            return not isinstance(path, Crossing) or first <= path.at_frame <= last
    return False


def _longest(watch: Watch, holds: Holds, hold: Hold, name: str) -> _Run | None:
    """The longest run of more than FEW frames in which it hides more than MUCH of the target unasked.

    Frames are looked at so often that no such run is missed (of long scenarios LOOKED, evenly spread).
    """
    frames = watch.scenario.frames
    own = [other for other in holds.values() if asked(other.occluder)[0] == name]
    found: _Run | None = None
    end = -1
    for index in range(0, frames, max(FEW + 1, math.ceil(frames / LOOKED))):
        if index <= end or _unasked(watch, own, hold, name, index) <= MUCH:
            continue
        shares = {index: _unasked(watch, own, hold, name, index)}
        for step in (-1, 1):
            at = index + step
            while 0 <= at < frames and (share := _unasked(watch, own, hold, name, at)) > MUCH:
                shares[at] = share
                at += step
        run = _Run(name, min(shares), max(shares), max(shares.values()))
        end = run.last
        if run.length > max(FEW, 0 if found is None else found.length):
            found = run
    return found


def _unasked(watch: Watch, own: list[Hold], hold: Hold, name: str, index: int) -> float:
    """Share 0..1 of target `name` that it hides at frame `index`, besides what those do that shall hide it; none where
    they shall, and out of the picture."""
    if any(first <= index <= last for _, (first, last) in (asked(other.occluder) for other in own)):
        return 0.0
    share = watch.hidden(hold.screen, name, index)
    target = watch.sprite(name, index)
    if share <= MUCH or target is None or not watch.scenario.camera.geometry.inside(*target.center):
        return 0.0
    before = [other.screen for other in own if other.shares[index] > LEEWAY]
    if not before:
        return share
    return watch.hidden_by([hold.screen, *before], name, index) - watch.hidden_by(before, name, index)
