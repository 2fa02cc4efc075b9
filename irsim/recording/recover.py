"""A damaged recording made whole again, less what is gone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from irsim.files import check_output
from irsim.recording.container import check_mcap
from irsim.recording.image import decode_image
from irsim.recording.salvage import Salvage
from irsim.recording.schema import decode_truth
from irsim.recording.times import from_ns
from irsim.recording.write import writing
from irsim.types import Frame


def recover(path: str | Path, out: str | Path, progress: Callable[[int], None] | None = None) -> Path:
    """Write every whole frame of a recording, damaged or not, to a new one and return its path.

    Frames are numbered anew and keep their times. InputError where nothing can be kept.
    """
    path, out = Path(path), Path(out)
    check_output(out)
    check_mcap(path)
    salvage = Salvage(path)
    header = salvage.header()
    with writing(out, header, salvage.scenario) as writer:
        kept = 0
        for kept, (image, truth) in enumerate(salvage.frames(), 1):
            time = from_ns(image.log_time, header.rate_hz)
            frame = Frame(decode_image(image.data, header.size), image.sequence, time, header.bits)
            writer.add(frame, None if truth is None else decode_truth(truth.data, truth.sequence, time))
            if progress is not None:
                progress(kept)
        writer.finish(notes=(f"{kept} frames recovered from {path.name}",))
    return out
