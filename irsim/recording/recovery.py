"""Damaged recordings: find the damage, read the intact frames, and write them to a new recording."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain, groupby, islice, pairwise
from pathlib import Path
from statistics import median
from typing import BinaryIO, cast

import numpy as np
from isal.isal_zlib import crc32
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Metadata

from irsim import __version__
from irsim.camera import AGCS
from irsim.camera.agc import Agc
from irsim.config.paths import path_of
from irsim.errors import InputError, counted
from irsim.recording.bounds_messages import decode_bounds
from irsim.recording.header import Contents, DigestError, Header
from irsim.recording.mcap_reader import DamageError, McapFile, TopicIndex, check_mcap, open_mcap
from irsim.recording.mcap_records import BROKEN, CRC, MAGIC, RECORD, Packet, packets, records, unpack
from irsim.recording.messages import BOUNDS, IMAGE, SCENARIO, TRUTH, decode_image, decode_truth, from_ns
from irsim.recording.output import check_output
from irsim.recording.reader import Recording
from irsim.recording.writer import writing
from irsim.types import Frame, TargetBounds, Truth


def damages(recording: Recording) -> Iterator[str]:
    """Yield the damaged parts of a recording, such as 'frames 4 to 5'; none if all bytes match their CRCs."""
    mcap, found = recording.mcap, False
    for topic, topic_index in mcap.topics.items():
        name = "frame" if topic == IMAGE else f"{topic} of frame"
        for damaged, chunks in groupby(_checked_chunks(mcap, topic_index), key=lambda chunk: chunk[0]):
            if damaged:
                found, spans = True, list(chunks)
                first, last = spans[0][1], spans[-1][2]
                yield f"{name} {first}" if first == last else f"{name}s {first} to {last}"
    for entry in mcap.attachment_index:
        try:
            mcap.attachment(entry.name)
        except DamageError:
            found = True
            yield f"the attachment {entry.name}"
    if not found and not mcap.data_matches():
        yield "bytes that no frame needs"


def _checked_chunks(mcap: McapFile, topic_index: TopicIndex) -> Iterator[tuple[bool, int, int]]:
    """Yield (is damaged, first message, last message) of each chunk of a topic."""
    first = 0
    with mcap.open() as file:
        for chunk, end in enumerate(topic_index.ends.tolist()):
            damaged = False
            try:
                mcap.packets(file, topic_index, chunk)
            except DamageError:
                damaged = True
            yield damaged, first, end - 1
            first = end


_FITTED_FRAMES = 100
"""Number of frames to which a lost header is fitted."""

Part = Metadata | Attachment | Channel | memoryview
"""Intact part of a damaged file; a memoryview contains the records of a chunk."""


@dataclass
class Salvage:
    """Intact parts of a damaged recording. They are collected while `frames` is iterated."""

    path: Path
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    scenario: str | None = None
    topics: dict[str, int] = field(default_factory=dict)
    truths: dict[int, Packet] = field(default_factory=dict)
    bounds: dict[int, Packet] = field(default_factory=dict)

    @property
    def stated(self) -> Header | None:
        """Header that was written; None where it is lost. InputError where it cannot be used."""
        with suppress(DigestError):
            return Header.from_record(self.metadata.get("irsim", {}))
        return None

    @property
    def has_truth(self) -> bool:
        """True if the recording has a truth for each frame."""
        stated = self.stated
        return TRUTH in self.topics if stated is None else stated.has_truth

    @property
    def contents(self) -> Contents | None:
        """Table of contents, written before the damage; None where it is lost."""
        with suppress(InputError):
            return Contents.from_record(self.metadata.get("irsim_contents", {}))
        return None

    def frames(self) -> Iterator[tuple[Packet, Packet | None, Packet | None]]:
        """Yield each intact image with its truth and its bounds, except frames whose truth is lost."""
        for part in _parts(self.path):
            if isinstance(part, Metadata):
                self.metadata[part.name] = part.metadata
            elif isinstance(part, Attachment):
                if part.name == SCENARIO:
                    with suppress(UnicodeDecodeError):
                        self.scenario = part.data.decode()
            elif isinstance(part, Channel):
                self.topics[part.topic] = part.id
            else:
                yield from self._frames_in(part)

    def header(self) -> Header:
        """Return the header, which precedes the first frame; where it is lost, one that fits the frames. Raises
        InputError where there is neither."""
        try:
            any_frame = next(self.frames(), None) is not None
        except InputError as error:
            raise InputError(f"{self.path}: {error}") from None
        if not any_frame or "irsim" not in self.metadata:
            if _is_foreign(self.path):
                raise InputError(
                    f"{self.path}: is MCAP but not a recording of irsim; allowed: a folder of PNG or TIFF, a TIFF, "
                    "a .npy, a video, or a recording of irsim"
                )
            if not any_frame:
                raise _nothing_left(self.path)
        return self.stated or self._fitted()

    def _fitted(self) -> Header:
        """Return a header with the size, depth and rate of the intact frames, and defaults."""
        times, images = [], []
        for packet, _, _ in islice(self.frames(), _FITTED_FRAMES):
            with suppress(*BROKEN):
                images.append(decode_image(packet.data))
                times.append(packet.log_time)
        if not images:
            raise _nothing_left(self.path)
        steps = [later - before for before, later in pairwise(times) if later > before]
        is_8_bit = images[0].dtype == np.uint8
        bits = 8 if is_8_bit else max(14, *(int(image.max()).bit_length() for image in images))
        return Header(
            version=__version__,
            name=self.path.stem,
            input="imported",
            size=(images[0].shape[1], images[0].shape[0]),
            bits=bits,
            rate_hz=float(f"{1e9 / median(steps):.6g}") if steps else 30.0,
            has_truth=self.has_truth,
            agc=cast(Agc, AGCS.parse({"kind": "none" if is_8_bit else "linear"})),
        )

    def _frames_in(self, chunk: memoryview) -> list[tuple[Packet, Packet | None, Packet | None]]:
        """Return the images in a chunk that can be read, with their truths and bounds."""
        images: list[Packet] = []
        with suppress(*BROKEN):
            for opcode, body in records(chunk):
                if opcode == Opcode.CHANNEL:
                    channel = Channel.read(ReadDataStream(io.BytesIO(body)))
                    self.topics[channel.topic] = channel.id
            for truth in packets(chunk, self.topics.get(TRUTH, 0)):
                self.truths[truth.sequence] = truth
            for bound in packets(chunk, self.topics.get(BOUNDS, 0)):
                self.bounds[bound.sequence] = bound
            images.extend(packets(chunk, self.topics.get(IMAGE, 0)))
        found = [(each, self.truths.pop(each.sequence, None), self.bounds.pop(each.sequence, None)) for each in images]
        return [each for each in found if each[1] is not None or not self.has_truth]


def _is_foreign(path: Path) -> bool:
    """Return True for an intact file that is not a recording of irsim."""
    try:
        return all(entry.name != "irsim" for entry in open_mcap(path).metadata_index)
    except DamageError:
        return False


def _nothing_left(path: Path) -> InputError:
    return InputError(f"{path}: it holds no intact frame of a recording of irsim")


def _parts(path: Path) -> Iterator[Part]:
    """Yield the intact parts of a file, by its index if that is intact, else record by record from the start."""
    try:
        mcap = open_mcap(path)
    except DamageError:
        with open(path, "rb") as file:
            yield from _walk(file)
        return
    with suppress(DamageError):
        yield from (Metadata(name, values) for name, values in mcap.metadata.items())
    yield from mcap.channels
    for entry in mcap.attachment_index:
        try:
            data = mcap.attachment(entry.name) or b""
        except DamageError:
            continue
        yield Attachment(entry.create_time, entry.log_time, entry.name, entry.media_type, data)
    with mcap.open() as file:
        for chunk in mcap.chunks:
            try:
                yield mcap.chunk_data(file, chunk)
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
            if data is not None and crc32(data) == chunk.uncompressed_crc:
                return data
    return None


_LOST = (
    "its metadata was lost (band, range_k, AGC, target to follow and others); assumed from its frames: {bits} bits, "
    "{rate:g} Hz, AGC {agc}"
)


def recover(path: str | Path, out: str | Path, progress: Callable[[int], None] | None = None) -> Path:
    """Write every intact frame of a recording, damaged or not, to a new recording and return its path.

    Frames are renumbered and keep their times. `first_frame` also counts frames that are lost before the first intact
    one. Raises InputError where no frame is intact.
    """
    path, out = path_of(path), path_of(out)
    check_output(out, path)
    check_mcap(path)
    salvage = Salvage(path)
    header = salvage.header()
    frames = _decoded_frames(salvage, header)
    first = next(frames, None)
    if first is None:
        raise _nothing_left(path)
    header = header.model_copy(update={"first_frame": header.first_frame + first[0].index})
    with writing(out, header, salvage.scenario) as writer:
        for kept, (frame, truth, bounds) in enumerate(chain([first], frames), 1):
            writer.add(frame, truth, None if first[2] is None else bounds or ())
            if progress is not None:
                progress(kept)
        contents = salvage.contents
        count = counted(kept, "frame") if contents is None else f"{kept} of {counted(contents.frames, 'frame')}"
        notes = () if contents is None else contents.notes
        lost = () if salvage.stated else (_LOST.format(bits=header.bits, rate=header.rate_hz, agc=header.agc.kind),)
        writer.finish(notes=(*notes, f"{count} recovered from {path.name}", *lost))
    return out


def _decoded_frames(
    salvage: Salvage, header: Header
) -> Iterator[tuple[Frame, Truth | None, tuple[TargetBounds, ...] | None]]:
    """Yield the frames that can be decoded, with their truths and bounds."""
    for image, truth, bounds in salvage.frames():
        time = from_ns(image.log_time, header.rate_hz)
        try:
            frame = Frame(decode_image(image.data, header.size), image.sequence, time, header.bits)
            frame_truth = None if truth is None else decode_truth(truth.data, truth.sequence, time)
            found = None if bounds is None else decode_bounds(bounds.data, bounds.sequence)
        except BROKEN:
            continue
        yield frame, frame_truth, found
