"""Tracks: recordings of a tracker's estimates, which viewers show beside the recording of the source."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from pydantic import Field

from irsim.config.paths import path_of
from irsim.config.quantities import AboveZero
from irsim.errors import InputError, counted
from irsim.recording.header import DigestRecord
from irsim.recording.mcap_reader import open_mcap
from irsim.recording.mcap_writer import McapWriter, Message
from irsim.recording.messages import (
    TRACK_STATE,
    TrackStateMessage,
    box,
    checked_text,
    from_ns,
    optional_field,
    point,
    required_numbers,
    to_ns,
)
from irsim.recording.output import atomic_file
from irsim.recording.viewer import TRACK, add_box
from irsim.types import Box

_MESSAGES_PER_CHUNK = 1024


@dataclass(frozen=True, slots=True)
class TrackState:
    """Estimate of a tracker for one frame, of one of many targets where it has an id.

    index, time   of the frame; time in s
    box           centre and size, px
    status        tracking | occluded | lost
    score         score of the tracker, on any scale
    velocity      (vx, vy) px per frame
    covariance    ((xx, xy), (yx, yy)) of the centre, px^2
    neff          effective number of particles
    id, cls       number and class of a track of many;  confirmed  whether it counts as a target
    """

    index: int
    time: float
    box: Box
    status: str
    score: float | None = None
    velocity: tuple[float, float] | None = None
    covariance: tuple[tuple[float, float], tuple[float, float]] | None = None
    neff: float | None = None
    id: int | None = None
    cls: str | None = None
    confirmed: bool | None = None


class TrackHeader(DigestRecord):
    """Metadata of a track: label of the tracker, name and hash of the source, id of the target."""

    tracker: str
    source: str
    source_hash: str
    rate_hz: AboveZero
    target: str | None = None
    states: int = Field(default=0, ge=0)
    """Number of states, set by `write_tracks`."""


@dataclass(frozen=True, eq=False)
class TrackRecording:
    """Track, or tracks of many targets, read from a file; `frames`: (index, time s) of each frame seen."""

    header: TrackHeader
    states: tuple[TrackState, ...]
    frames: tuple[tuple[int, float], ...] = ()

    def __repr__(self) -> str:
        return f"TrackRecording({counted(len(self.states), 'state')} of {self.header.tracker} on {self.header.source})"


def write_tracks(
    path: str | Path,
    header: TrackHeader,
    states: Iterable[TrackState],
    frames: Iterable[tuple[int, float]] | None = None,
) -> Path:
    """Write a track recording and return its path. Raises InputError where the file cannot be written.

    states   in order of frames, at most one for each frame and id
    frames   (index, time s) of each frame seen, in order; by default those of the states
    """
    path = path_of(path)
    states = tuple(states)
    seen = dict(frames if frames is not None else ((state.index, state.time) for state in states))
    by_frame: dict[int, list[TrackState]] = {index: [] for index in seen}
    for state in states:
        by_frame[state.index].append(state)
    with atomic_file(path) as file:
        writer = McapWriter(file)
        writer.metadata("irsim_track", header.model_copy(update={"states": len(states)}).to_record())
        boxes, track = track_topics(header.tracker)
        boxes_channel = writer.topic(boxes, ImageAnnotations.DESCRIPTOR)
        track_channel = writer.topic(track, TRACK_STATE)
        chunk: list[Message] = []
        for index, time in seen.items():
            log_time = to_ns(time)
            boxes_of_frame = annotate_tracks(header.tracker, by_frame[index], log_time)
            chunk.append(Message(boxes_channel, index, log_time, boxes_of_frame))
            chunk += [Message(track_channel, index, log_time, encode_state(state)) for state in by_frame[index]]
            if len(chunk) >= _MESSAGES_PER_CHUNK:
                writer.chunk(chunk)
                chunk = []
        if chunk:
            writer.chunk(chunk)
        writer.finish()
    return path


def read_tracks(path: str | Path) -> TrackRecording:
    """Read a track recording. Raises InputError where it is missing, damaged, or not a track recording."""
    path = path_of(path)
    mcap = open_mcap(path)
    if "irsim_track" not in mcap.metadata:
        raise InputError(f"{path}: is not a track recording of irsim; allowed: a file that irtrack run -o wrote")
    try:
        header = TrackHeader.from_record(mcap.metadata["irsim_track"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    states: list[TrackState] = []
    frames: list[tuple[int, float]] = []
    boxes, track = (mcap.topics.get(topic) for topic in track_topics(header.tracker))
    with mcap.open() as file:
        for chunk in range(len(boxes.chunks) if boxes else 0):
            for packet in mcap.packets(file, boxes, chunk):  # type: ignore[arg-type]  # without a topic there are no chunks
                frames.append((packet.sequence, from_ns(packet.log_time, header.rate_hz)))
        for chunk in range(len(track.chunks) if track else 0):
            for packet in mcap.packets(file, track, chunk):  # type: ignore[arg-type]
                with mcap.decoding(f"state {len(states)} cannot be read"):
                    states.append(_decode(packet.data, packet.sequence, from_ns(packet.log_time, header.rate_hz)))
    if len(states) != header.states:
        raise mcap.damage_error(f"it holds {len(states)} of {header.states} states")
    return TrackRecording(header, tuple(states), tuple(frames))


def annotate_tracks(tracker: str, states: Iterable[TrackState], log_time: int) -> bytes:
    """Return the bytes of foxglove.ImageAnnotations: a box for each state, except for tracks not confirmed."""
    annotations = ImageAnnotations()
    for state in states:
        if state.confirmed is not False:
            name = tracker if state.id is None else f"{state.id}"
            add_box(annotations, state.box, f"{name} {state.status}", TRACK, log_time)
    return annotations.SerializeToString()


def track_topics(tracker: str) -> tuple[str, str]:
    """Return the topics of boxes and of states, spelt with characters that Foxglove allows in message paths."""
    plain = re.sub(r"[^A-Za-z0-9_-]", "_", tracker)
    return f"/tracks/{plain}/annotations", f"/tracks/{plain}/states"


def encode_state(state: TrackState) -> bytes:
    """Return a state as the bytes of an irsim.TrackState message."""
    values = {
        name: getattr(state, name) for name in ("index", "time", "status", "score", "neff", "id", "cls", "confirmed")
    }
    covariance = [value for row in state.covariance or () for value in row]
    message: Any = TrackStateMessage(
        box=box(state.box), velocity=point(state.velocity), covariance=covariance, **values
    )
    return bytes(message.SerializeToString())


def _decode(data: memoryview, index: int, time: float) -> TrackState:
    message: Any = TrackStateMessage.FromString(data)  # type: ignore[arg-type]  # protobuf takes a memoryview, its stubs only bytes
    covariance = None
    if message.covariance:
        xx, xy, yx, yy = message.covariance
        covariance = ((xx, xy), (yx, yy))
    return TrackState(
        index=index,
        time=time,
        box=Box(*required_numbers(message, "box")),
        status=checked_text(message.status),
        covariance=covariance,
        **{name: optional_field(message, name) for name in ("score", "velocity", "neff", "id", "cls", "confirmed")},
    )
