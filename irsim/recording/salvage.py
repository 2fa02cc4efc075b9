"""What is still whole in a damaged recording."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from isal.isal_zlib import crc32
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata

from irsim.errors import InputError
from irsim.recording.binary import CRC, MAGIC, RECORD
from irsim.recording.container import Packet, open_container, packets, records, unpack
from irsim.recording.damage import BROKEN, DamageError
from irsim.recording.header import Contents, Header
from irsim.recording.layout import IMAGE, SCENARIO, TRUTH

Part = Metadata | Attachment | Channel | memoryview
"""A whole piece of a file; a memoryview is a chunk's records."""


@dataclass
class Salvage:
    """What was found so far: it grows while `frames` runs."""

    path: Path
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    scenario: str | None = None
    topics: dict[str, int] = field(default_factory=dict)
    truths: dict[int, Packet] = field(default_factory=dict)

    @property
    def has_truth(self) -> bool:
        """Does the recording say that every frame has a truth?"""
        return self.metadata.get("irsim", {}).get("has_truth") == "true"

    @property
    def stated_frames(self) -> int | None:
        """How many frames there were, where the table of contents is left."""
        contents = self._contents
        return None if contents is None else contents.frames

    @property
    def notes(self) -> tuple[str, ...]:
        """What was known of the recording before it was damaged."""
        contents = self._contents
        return () if contents is None else contents.notes

    @property
    def _contents(self) -> Contents | None:
        with suppress(InputError):
            return Contents.unseal(self.metadata.get("irsim_contents", {}))
        return None

    def frames(self) -> Iterator[tuple[Packet, Packet | None]]:
        """Each whole image message with its truth's; frames whose truth is gone are left out."""
        for part in _parts(self.path):
            if isinstance(part, Metadata):
                self.metadata[part.name] = part.metadata
            elif isinstance(part, Attachment):
                if part.name == SCENARIO:
                    self._note_scenario(part.data)
            elif isinstance(part, Channel):
                self.topics[part.topic] = part.id
            else:
                yield from self._frames_in(part)

    def header(self) -> Header:
        """The recording's header, which stands before its first frame; InputError where it is gone."""
        begun = next(self.frames(), None) is not None
        if not begun or "irsim" not in self.metadata:
            raise _foreign(self.path) if _is_foreign(self.path) else nothing_left(self.path)
        try:
            return Header.unseal(self.metadata["irsim"])
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from None

    def _note_scenario(self, data: bytes) -> None:
        with suppress(UnicodeDecodeError):
            self.scenario = data.decode()

    def _frames_in(self, chunk: memoryview) -> list[tuple[Packet, Packet | None]]:
        """What can be read of a chunk's frames."""
        images: list[Packet] = []
        with suppress(*BROKEN):
            for opcode, body in records(chunk):
                if opcode == Opcode.CHANNEL:
                    channel = Channel.read(ReadDataStream(io.BytesIO(body)))
                    self.topics[channel.topic] = channel.id
            for truth in packets(chunk, self.topics.get(TRUTH, 0)):
                self.truths[truth.sequence] = truth
            images.extend(packets(chunk, self.topics.get(IMAGE, 0)))
        paired = [(image, self.truths.pop(image.sequence, None)) for image in images]
        return [(image, truth) for image, truth in paired if truth is not None or not self.has_truth]


def _is_foreign(path: Path) -> bool:
    """Is it whole, and nothing that irsim wrote?"""
    try:
        return all(entry.name != "irsim" for entry in open_container(path).metadata_index)
    except DamageError:
        return False


def _foreign(path: Path) -> InputError:
    return InputError(
        f"{path}: is MCAP but not a recording of irsim; allowed: a folder of PNG or TIFF, a TIFF, a .npy, a video, or "
        "a recording of irsim"
    )


def nothing_left(path: Path) -> InputError:
    return InputError(f"{path}: not one whole frame of a recording of irsim is left in it")


def _parts(path: Path) -> Iterator[Part]:
    """By the index where it is whole, else record after record from the start."""
    try:
        container = open_container(path)
        metadata = container.metadata
    except DamageError:
        with open(path, "rb") as file:
            yield from _walk(file)
        return
    yield from (Metadata(name, values) for name, values in metadata.items())
    yield from container.channels
    for entry in container.attachment_index:
        try:
            data = container.attachment(entry.name) or b""
        except DamageError:
            continue
        yield Attachment(entry.create_time, entry.log_time, entry.name, entry.media_type, data)
    with container.open() as file:
        for chunk in container.chunks:
            try:
                yield container.chunk_data(file, chunk)
            except DamageError:
                continue


def _walk(file: BinaryIO) -> Iterator[Part]:
    left = os.fstat(file.fileno()).st_size - len(MAGIC)
    file.seek(len(MAGIC))
    while left >= RECORD.size:
        opcode, length = RECORD.unpack(file.read(RECORD.size))
        left -= RECORD.size + length
        if left < 0 or opcode == Opcode.DATA_END:
            return
        part = _part(opcode, file.read(length))
        if part is not None:
            yield part


def _part(opcode: int, body: bytes) -> Part | None:
    stream = ReadDataStream(io.BytesIO(body))
    with suppress(*BROKEN):
        if opcode == Opcode.METADATA:
            metadata: Metadata = Metadata.read(stream)
            return metadata
        if opcode == Opcode.ATTACHMENT and crc32(body[: -CRC.size]) == CRC.unpack(body[-CRC.size :])[0]:
            attachment: Attachment = Attachment.read(stream)
            return attachment
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(stream)
            data = unpack(memoryview(chunk.data), chunk.compression, chunk.uncompressed_size)
            # Without an index nothing but its CRC says that this is a chunk at all.
            if data is not None and crc32(data) == chunk.uncompressed_crc:
                return data
    return None
