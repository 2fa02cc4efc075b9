"""Start of a track: its target, its first frame and the box there."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Iterable
from dataclasses import dataclass

from irsim.config.base import suggestion
from irsim.types import Box, Source, TargetTruth, Truth
from irtrack.errors import InputError, whole_number
from irtrack.types import LEAST_PX


@dataclass(frozen=True, slots=True)
class Start:
    """Start of the track of `target` (None where only a box is given): its first frame, and the box there."""

    target: str | None
    frame: int
    box: Box


def find_start(
    source: Source, truths: Iterable[Truth], target: str | None = None, init: tuple[Box, int] | None = None
) -> Start:
    """Return the start: the first frame in which at least half of the target is visible, and its true box.

    truths  truths of the source, read only as far as needed
    target  id; by default the target that the source names, else the first in its truth
    init    (box, frame) given by the user, in place of the truth

    InputError where the target is unknown or never visible, where there is neither truth nor `init`, or where `init` is
    not a (box, frame), or its box lies outside the frame or is larger than it.
    """
    if init is not None:
        box, frame = _given(init)
        if target is not None:
            _check_target(source, truths, target)
        if frame >= len(source):
            raise InputError(f"start frame {frame}: {source.name} has no such frame; allowed: 0 to {len(source) - 1}")
        return Start(target, frame, _checked(source, box))
    if not source.has_truth:
        raise InputError(f"{source.name} has no truth; say where the target is with init=BOX")
    wanted = target if target is not None else source.follow
    ids: dict[str, None] = {}
    for truth in truths:
        ids.update(dict.fromkeys(seen.id for seen in truth.targets))
        if wanted is None and ids:
            wanted = next(iter(ids))
        seen = None if wanted is None else truth.target(wanted)
        if seen is not None and shows(seen):
            return Start(seen.id, truth.index, _checked(source, seen.box))
    if wanted is None:
        raise InputError(f"{source.name} has no target in any frame; say where it is with init=BOX")
    if wanted not in ids:
        raise _unknown(source, wanted, ids)
    raise InputError(f"target '{wanted}' of {source.name} never shows at least half of itself; allowed: one that does")


def _given(init: object) -> tuple[Box, int]:
    """Return the box and the frame that the user gave; InputError for anything else."""
    if not (isinstance(init, tuple | list) and len(init) == 2 and isinstance(init[0], Box)):
        raise InputError(f"init {reprlib.repr(init)}: allowed: (irsim.Box(cx, cy, w, h), frame)")
    box, frame = init
    return box, whole_number("start frame", frame)


def shows(target: TargetTruth) -> bool:
    """Return whether the target is visible and its centre in the frame; unknown counts as visible."""
    return not target.hidden and target.in_view is not False


def _check_target(source: Source, truths: Iterable[Truth], target: str) -> None:
    ids = list(dict.fromkeys(seen.id for truth in truths for seen in truth.targets))
    if target not in ids:
        raise _unknown(source, target, ids)


def _unknown(source: Source, target: str, ids: Iterable[str]) -> InputError:
    known = list(ids)
    allowed = ", ".join(known) or "none, there is no truth"
    ending = [id for id in known if id.endswith(f"-{target}")]  # label files number their targets
    hint = f"; did you mean '{ending[0]}'?" if len(ending) == 1 else suggestion(target, known)
    return InputError(f"{source.name} has no target '{target}'; allowed: {allowed}{hint}")


def _checked(source: Source, box: Box) -> Box:
    """Return the box, sides at least LEAST_PX; InputError where it contains no pixel of the frame or exceeds it."""
    columns, rows = source.size
    text = f"start box of {box.w:g}x{box.h:g} px around ({box.cx:g}, {box.cy:g})"
    if not (all(map(math.isfinite, (box.cx, box.cy, box.w, box.h))) and box.w > 0 and box.h > 0):
        raise InputError(f"{text}: allowed: finite numbers, width and height above 0")
    if box.w > columns or box.h > rows:
        raise InputError(f"{text}: is larger than the frame; allowed: at most {columns}x{rows} px")
    box = box.at_least(LEAST_PX)
    across = math.floor(min(box.right, columns - 1)) - math.ceil(max(box.left, 0)) + 1
    down = math.floor(min(box.bottom, rows - 1)) - math.ceil(max(box.top, 0)) + 1
    if across < 1 or down < 1:
        raise InputError(f"{text}: lies outside the frame of {columns}x{rows} px; allowed: a box with a pixel inside")
    return box
