"""Whether counts of few bits are a detector's own."""

from __future__ import annotations

from irsim.stated import stated
from irsim.types import Source

EIGHT_BITS = (
    "8 bits: unless these are a detector's own counts, figures are those of a picture after gain control, not of a "
    "sensor"
)
"""What is to be said of recordings of no more, of which nothing else is known."""


def perhaps_pictures(source: Source) -> bool:
    """Whether a source's frames may be pictures after gain control: of 8 bits, and not the counts of a detector that
    irsim rendered, which no gain control touches. Footage that stands behind a rendered scene may be pictures."""
    if source.bits > 8:
        return False
    known = stated(source)
    if not known:
        return True
    background = known.get("background")
    return isinstance(background, dict) and background.get("kind") == "recording"
