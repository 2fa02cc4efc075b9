"""A damaged recording made whole again, less what is gone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path

from irsim.config.paths import path_of
from irsim.errors import counted
from irsim.recording.container import check_mcap
from irsim.recording.damage import BROKEN
from irsim.recording.header import Header
from irsim.recording.image import decode_image
from irsim.recording.output import check_output
from irsim.recording.salvage import Salvage, nothing_left
from irsim.recording.schema import decode_truth
from irsim.recording.times import from_ns
from irsim.recording.write import writing
from irsim.types import Frame, Truth


def recover(path: str | Path, out: str | Path, progress: Callable[[int], None] | None = None) -> Path:
    """Write every whole frame of a recording, damaged or not, to a new one and return its path.

    Frames are numbered anew and keep their times; what was lost before the first is counted in `first_frame`.
    InputError where nothing can be kept.
    """
    path, out = path_of(path), path_of(out)
    check_output(out, path)
    check_mcap(path)
    salvage = Salvage(path)
    header = salvage.header()
    found = _decodable(salvage, header)
    first = next(found, None)
    if first is None:
        raise nothing_left(path)
    header = header.model_copy(update={"first_frame": header.first_frame + first[0].index})
    with writing(out, header, salvage.scenario) as writer:
        for kept, (frame, truth) in enumerate(chain([first], found), 1):
            writer.add(frame, truth)
            if progress is not None:
                progress(kept)
        writer.finish(notes=(*salvage.notes, _told(kept, salvage.stated_frames, path.name)))
    return out


def _told(kept: int, stated: int | None, name: str) -> str:
    if stated is None:
        return f"{counted(kept, 'frame')} recovered from {name}"
    return f"{kept} of {counted(stated, 'frame')} recovered from {name}"


def _decodable(salvage: Salvage, header: Header) -> Iterator[tuple[Frame, Truth | None]]:
    """The frames that mean something, with their truths."""
    for image, truth in salvage.frames():
        time = from_ns(image.log_time, header.rate_hz)
        try:
            frame = Frame(decode_image(image.data, header.size), image.sequence, time, header.bits)
            known = None if truth is None else decode_truth(truth.data, truth.sequence, time)
        except BROKEN:
            continue
        yield frame, known
