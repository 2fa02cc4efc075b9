"""Reader of MCAP files (mcap.dev/spec): the summary once, then any chunk by its offset, with every CRC checked."""

from __future__ import annotations

import io
import mmap
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt
from isal.isal_zlib import crc32
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Channel, ChunkIndex, Metadata, MetadataIndex, Schema, Statistics
from mcap.stream_reader import StreamReader

from irsim.config.paths import Stamp, check_input, stamp
from irsim.errors import InputError, counted
from irsim.recording.mcap_records import BROKEN, CHUNK_HEAD, CRC, MAGIC, RECORD, Packet, matches_crc, packets, unpack


class DamageError(InputError):
    """Error of a file whose bytes have changed since they were written."""


@dataclass(frozen=True, eq=False)
class NamedFile:
    """Path of a file, with methods that make the errors about damage to it.

    remedy   advice at the end of each error, or ''
    """

    path: Path
    remedy: str

    def damage_error(self, problem: str) -> DamageError:
        """Return the error for a problem such as 'its index cannot be read'."""
        return DamageError(f"{self.path}: damaged: {problem}" + (f"; {self.remedy}" if self.remedy else ""))

    @contextmanager
    def decoding(self, problem: str) -> Iterator[None]:
        """Turn any decoding error in the block into a DamageError."""
        try:
            yield
        except BROKEN:
            raise self.damage_error(problem) from None


_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, summary CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC of all before it
_INDEX_HEAD = struct.Struct("<BQHI")  # of a MessageIndex: opcode, length, channel, bytes of entries
_INDEX_ENTRY_BYTES = 16

_BLOCK = 1 << 20


@dataclass(frozen=True, eq=False)
class TopicIndex:
    """Chunks that contain messages of one topic."""

    channel: int
    chunks: tuple[ChunkIndex, ...]
    ends: npt.NDArray[np.int64]
    """Cumulative number of the topic's messages at the end of each chunk."""

    def __len__(self) -> int:
        return int(self.ends[-1]) if len(self.ends) else 0

    def chunk_of(self, message: int) -> int:
        """Return the index in `chunks` of the chunk that contains the topic's message number `message`."""
        return int(np.searchsorted(self.ends, message, side="right"))


@dataclass(frozen=True, eq=False)
class McapFile(NamedFile):
    """Summary of an MCAP file. The file itself is open only during reads, and `open` refuses a file changed since."""

    stamp: Stamp
    schemas: tuple[Schema, ...]
    channels: tuple[Channel, ...]
    message_counts: dict[int, int]
    """Number of messages of each channel, where the file states it."""
    chunks: tuple[ChunkIndex, ...]
    metadata_index: tuple[MetadataIndex, ...]
    attachment_index: tuple[AttachmentIndex, ...]

    @contextmanager
    def open(self) -> Iterator[BinaryIO]:
        """Open the file for a block. Raises InputError where it cannot be read or has changed."""
        try:
            with open(self.path, "rb", buffering=0) as file:
                if stamp(file.fileno()) != self.stamp:
                    raise InputError(f"{self.path}: was changed after it was opened; open it again")
                yield file
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read: {error.strerror}") from None

    @cached_property
    def topics(self) -> dict[str, TopicIndex]:
        """Index of each topic, by name, with chunks in file order."""
        with self.open() as file:
            return {channel.topic: self._topic_index(file, channel.id) for channel in self.channels}

    def _topic_index(self, file: BinaryIO, channel: int) -> TopicIndex:
        chunks = tuple(chunk for chunk in self.chunks if channel in chunk.message_index_offsets)
        counts = []
        for chunk in chunks:
            head = self._read(file, chunk.message_index_offsets[channel], _INDEX_HEAD.size)
            opcode, _, indexed, size = _INDEX_HEAD.unpack(head)
            if opcode != Opcode.MESSAGE_INDEX or indexed != channel:
                raise self.damage_error("the index of a chunk is not where it should be")
            counts.append(size // _INDEX_ENTRY_BYTES)
        return TopicIndex(channel, chunks, np.cumsum(counts, dtype=np.int64))

    def packets(self, file: BinaryIO, topic: TopicIndex, chunk: int) -> list[Packet]:
        """Return the messages of a topic in the chunk `topic.chunks[chunk]`, in order."""
        data = self.chunk_data(file, topic.chunks[chunk])
        with self.decoding("the messages of a chunk cannot be read"):
            return list(packets(data, topic.channel))

    def chunk_data(self, file: BinaryIO, chunk: ChunkIndex) -> memoryview:
        """Return the unpacked records of a chunk; DamageError where their CRC is wrong."""
        raw = memoryview(self._read(file, chunk.chunk_start_offset, chunk.chunk_length))
        if chunk.compressed_size > len(raw) - RECORD.size - CHUNK_HEAD.size:
            raise self.damage_error("a chunk is cut off")
        data = unpack(raw[len(raw) - chunk.compressed_size :], chunk.compression, chunk.uncompressed_size)
        if data is None or not matches_crc(data, CHUNK_HEAD.unpack_from(raw, RECORD.size)[3]):
            raise self.damage_error("a chunk does not match its CRC")
        return data

    def data_matches(self) -> bool:
        """Return True if the bytes before the summary match their CRC, or the file has no CRC of them."""
        with self.open() as file:
            file.seek(self.stamp[1] - _FOOTER.size - len(MAGIC))
            left = _FOOTER.unpack(file.read(_FOOTER.size))[2] - _DATA_END.size
            file.seek(0)
            crc = 0
            while left > 0 and (block := file.read(min(left, _BLOCK))):
                crc, left = crc32(block, crc), left - len(block)
            opcode, _, stated = _DATA_END.unpack(file.read(_DATA_END.size))
        return bool(opcode == Opcode.DATA_END and stated in (0, crc))

    def _read(self, file: BinaryIO, offset: int, length: int) -> bytes:
        """Return `length` bytes at an offset from the index. Raises DamageError where the file ends before them."""
        if length < 0 or offset + length > self.stamp[1]:
            raise self.damage_error("its index points past its end")
        file.seek(offset)
        return file.read(length)

    @cached_property
    def metadata(self) -> dict[str, dict[str, str]]:
        """Metadata records by name."""
        found = {}
        with self.open() as file:
            for entry in self.metadata_index:
                raw = self._read(file, entry.offset, entry.length)
                with self.decoding("its metadata cannot be read"):
                    record = Metadata.read(ReadDataStream(io.BytesIO(raw[RECORD.size :])))
                found[record.name] = record.metadata
        return found

    def attachment(self, name: str) -> bytes | None:
        """Return the bytes of an attachment; None where there is none of this name. DamageError for a wrong CRC."""
        for entry in self.attachment_index:
            if entry.name == name:
                with self.open() as file:
                    raw = self._read(file, entry.offset, entry.length)
                with self.decoding(f"the attachment {name} cannot be read"):
                    body, (crc,) = raw[RECORD.size : -CRC.size], CRC.unpack(raw[-CRC.size :])
                    if not matches_crc(body, crc):
                        raise self.damage_error(f"the attachment {name} does not match its CRC")
                    record: Attachment = Attachment.read(ReadDataStream(io.BytesIO(raw[RECORD.size :])))
                    return record.data
        return None


def open_mcap(path: Path, remedy: str = "") -> McapFile:
    """Read and check the summary of an MCAP file.

    Raises InputError where the file does not exist or is not MCAP, and DamageError where it is cut short or damaged.
    """
    check_mcap(path)
    named = NamedFile(path, remedy)
    with open(path, "rb") as file:
        found = stamp(file.fileno())
        size = found[1]
        file.seek(max(size - _FOOTER.size - len(MAGIC), 0))
        tail = file.read()
        if len(tail) < _FOOTER.size + len(MAGIC) or not tail.endswith(MAGIC):
            extra = _bytes_after_end(path)
            appended = f"{counted(extra or 0, 'byte')} of something else after its end"
            raise named.damage_error("it is cut short" if extra is None else appended)
        opcode, _, start, _, crc = _FOOTER.unpack_from(tail)
        if opcode != Opcode.FOOTER or not len(MAGIC) <= start <= size - len(tail):
            raise named.damage_error("it has no index")
        file.seek(start)
        summary = file.read()
    if not matches_crc(memoryview(summary)[: -len(MAGIC) - CRC.size], crc):
        raise named.damage_error("its index does not match its CRC")
    with named.decoding("its index cannot be read"):
        records = list(StreamReader(io.BytesIO(summary), skip_magic=True).records)
    return McapFile(
        path=path,
        remedy=remedy,
        stamp=found,
        schemas=tuple(r for r in records if isinstance(r, Schema)),
        channels=tuple(r for r in records if isinstance(r, Channel)),
        message_counts=next((r.channel_message_counts for r in records if isinstance(r, Statistics)), {}),
        chunks=tuple(sorted((r for r in records if isinstance(r, ChunkIndex)), key=lambda r: r.chunk_start_offset)),
        metadata_index=tuple(r for r in records if isinstance(r, MetadataIndex)),
        attachment_index=tuple(r for r in records if isinstance(r, AttachmentIndex)),
    )


def _bytes_after_end(path: Path) -> int | None:
    """Return the number of bytes after the footer; None where there is no footer."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        at = data.rfind(MAGIC)
        footer = data[max(at - _FOOTER.size, 0) : at]
        if len(footer) < _FOOTER.size or footer[0] != Opcode.FOOTER:
            return None
        return len(data) - at - len(MAGIC)


def check_mcap(path: Path) -> None:
    """Raise InputError where `path` is not a file that begins as an MCAP file does."""
    try:
        if path.is_dir():
            raise InputError(
                f"{path}: is a folder; allowed: a recording (irsim import makes one of a folder of PNG or TIFF)"
            )
        check_input(path, "a recording (.mcap)")
        with open(path, "rb") as file:
            head = file.read(len(MAGIC))
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise InputError(f"{path}: no file can have this name: {error}") from None
    if not head:
        raise InputError(f"{path}: is empty; allowed: a recording (.mcap)")
    if not MAGIC.startswith(head):
        raise InputError(f"{path}: is not an MCAP file; allowed: a recording (.mcap)")
