"""Opening what was measured, to show its pictures."""

from __future__ import annotations

from irsim import Rendering, loads, open_recording
from irsim.types import Source
from irtrack.bench import SourceRow


def opened(row: SourceRow) -> Source:
    """The source as it is now, whose hash may be another one; irsim's errors where it is gone.

    A scenario runs no code that it names: a results file may come from anywhere.
    """
    source: Source
    if row.kind == "recording":
        source = open_recording(row.text)
    else:
        source = Rendering(loads(row.text, row.name, trusted=False), row.name)
    return source
