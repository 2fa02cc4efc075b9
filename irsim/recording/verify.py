"""What of a recording is not what was written: every byte is looked at."""

from __future__ import annotations

from collections.abc import Iterator

from irsim.recording.container import Container, Lane
from irsim.recording.damage import DamageError
from irsim.recording.layout import IMAGE
from irsim.recording.read import Recording


def damages(recording: Recording) -> Iterator[str]:
    """What is damaged in an opened recording, such as 'frames 4 to 5'; nothing where all bytes match their CRCs."""
    container, found = recording.container, False
    for topic, lane in container.lanes.items():
        what = "frame" if topic == IMAGE else f"{topic} of frame"
        for first, last in _broken(container, lane):
            found = True
            yield f"{what} {first}" if first == last else f"{what}s {first} to {last}"
    for entry in container.attachment_index:
        try:
            container.attachment(entry.name)
        except DamageError:
            found = True
            yield f"the attachment {entry.name}"
    if not found and not container.data_matches():
        yield "bytes that no frame needs"


def _broken(container: Container, lane: Lane) -> Iterator[tuple[int, int]]:
    """(first, last) message of each row of chunks that do not match their CRCs."""
    begun: int | None = None
    first = 0
    with container.open() as file:
        for chunk, end in enumerate(lane.ends.tolist()):
            try:
                container.packets(file, lane, chunk)
            except DamageError:
                begun = first if begun is None else begun
            else:
                if begun is not None:
                    yield begun, first - 1
                begun = None
            first = end
    if begun is not None:
        yield begun, first - 1
