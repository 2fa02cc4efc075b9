"""Writing MCAP with the chunks that we choose: a call, a chunk.

The same bytes as mcap's own writer gives, which copies each message five times on its way: here a picture goes from
its message to the file, and is read once for both of its CRCs. The record layouts are those of the MCAP specification
(mcap.dev/spec).
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import BinaryIO, Literal

from google.protobuf.descriptor import Descriptor
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER

from irsim.recording.container import MAGIC, RECORD
from irsim.recording.crc import joined
from irsim.recording.schema import descriptor_set
from irsim.recording.times import EPOCH_NS

Compression = Literal["none", "lz4", "zstd"]

LARGE = 1 << 18
"""Bytes of a chunk above which two CRCs are joined sooner than it is read again."""

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time, then the data
_CHUNK = struct.Struct("<BQQQQII")  # opcode, length, first time, last time, size, CRC, length of the next
_SIZE = struct.Struct("<Q")  # of what is in the chunk as it is packed
_FOOTER = struct.Struct("<BQQQ")  # opcode, length, summary start, summary offset start, then the CRC of it all


@dataclass(frozen=True, slots=True)
class Message:
    """A message on its way into a chunk: channel, sequence (frame index), log time in ns, and its bytes, in parts: who
    has them apart need not copy them together."""

    channel: int
    sequence: int
    log_time: int
    parts: tuple[bytes, ...]


class ChunkWriter:
    """An MCAP file in the making, with chunk, attachment, data and summary CRCs."""

    def __init__(self, file: BinaryIO, compression: Compression = "none") -> None:
        self._file = file
        self._compression = "" if compression == "none" else compression
        self._at = 0
        self._crc = 0
        self._schemas: dict[str, Schema] = {}
        self._channels: list[Channel] = []
        self._new: list[McapRecord] = []  # schemas and channels, on their way into the next chunk
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._put(MAGIC)
        self._put(_bytes([Header("", LIBRARY_IDENTIFIER)]))

    def topic(self, topic: str, descriptor: Descriptor, metadata: Mapping[str, str] | None = None) -> int:
        """The channel of a new topic of protobuf messages."""
        name = descriptor.full_name
        if name not in self._schemas:
            self._schemas[name] = Schema(
                id=len(self._schemas) + 1, name=name, encoding="protobuf", data=descriptor_set(descriptor)
            )
            self._new.append(self._schemas[name])
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding="protobuf",
            schema_id=self._schemas[name].id,
            metadata=dict(metadata or {}),
        )
        self._channels.append(channel)
        self._new.append(channel)
        return channel.id

    def chunk(self, messages: Sequence[Message]) -> None:
        """Write the messages, one at least, as one chunk."""
        parts = [_bytes(self._new)]
        self._new.clear()
        size = len(parts[0])
        places: dict[int, list[tuple[int, int]]] = {}
        for message in messages:
            length = sum(map(len, message.parts))
            places.setdefault(message.channel, []).append((message.log_time, size))
            body = _MESSAGE.size - RECORD.size + length
            time = message.log_time
            parts.append(_MESSAGE.pack(Opcode.MESSAGE, body, message.channel, message.sequence, time, time))
            parts += message.parts
            size += _MESSAGE.size + length
            self._counts[message.channel] += 1
        times = [message.log_time for message in messages]
        self._put_chunk(parts, size, min(times), max(times))
        self._put_places(places)
        self._file.flush()

    def _put_chunk(self, parts: list[bytes], size: int, first: int, last: int) -> None:
        crc = _crc(parts)
        start, name, packed = self._at, self._compression.encode(), _packed(parts, self._compression)
        held = sum(map(len, packed))
        length = _CHUNK.size - RECORD.size + len(name) + _SIZE.size + held
        self._put(_CHUNK.pack(Opcode.CHUNK, length, first, last, size, crc, len(name)) + name + _SIZE.pack(held))
        if packed is parts and held >= LARGE:
            self._crc = joined(self._crc, crc, held)
        else:
            self._crc = _crc(packed, self._crc)
        self._file.writelines(packed)
        self._at += held
        self._chunks.append(
            ChunkIndex(
                message_start_time=first,
                message_end_time=last,
                chunk_start_offset=start,
                chunk_length=self._at - start,
                message_index_offsets={},
                message_index_length=0,
                compression=self._compression,
                compressed_size=held,
                uncompressed_size=size,
            )
        )

    def _put_places(self, places: Mapping[int, list[tuple[int, int]]]) -> None:
        """Of the messages of each channel in the last chunk: log time and place in it."""
        start, chunk = self._at, self._chunks[-1]
        for channel, entries in places.items():
            chunk.message_index_offsets[channel] = self._at
            self._put(_bytes([MessageIndex(channel, entries)]))
        chunk.message_index_length = self._at - start

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        data = _bytes([Metadata(name, dict(values))])
        self._metadata.append(MetadataIndex(self._at, len(data), name))
        self._put(data)

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        whole = _bytes([Attachment(EPOCH_NS, EPOCH_NS, name, media_type, data)])
        index = AttachmentIndex(
            offset=self._at,
            length=len(whole),
            log_time=EPOCH_NS,
            create_time=EPOCH_NS,
            data_size=len(data),
            name=name,
            media_type=media_type,
        )
        self._attachments.append(index)
        self._put(whole)

    def finish(self) -> None:
        """Write the summary. The file is the caller's to close."""
        self._put(_bytes([DataEnd(self._crc)]))
        start = self._at
        groups: tuple[tuple[Opcode, Iterable[McapRecord]], ...] = (
            (Opcode.SCHEMA, self._schemas.values()),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        )
        summary, offsets = b"", []
        for opcode, records in groups:
            group = _bytes(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        offsets_start = start + len(summary)
        summary += _bytes(offsets)
        body = struct.calcsize("<QQI")
        crc = zlib.crc32(summary + _FOOTER.pack(Opcode.FOOTER, body, start, offsets_start))
        self._put(summary)
        self._put(_bytes([Footer(start, offsets_start, crc)]))
        self._put(MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            message_count=self._counts.total(),
            schema_count=len(self._schemas),
            channel_count=len(self._channels),
            attachment_count=len(self._attachments),
            metadata_count=len(self._metadata),
            chunk_count=len(self._chunks),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            channel_message_counts=dict(self._counts),
        )

    def _put(self, data: bytes) -> None:
        self._crc = zlib.crc32(data, self._crc)
        self._file.write(data)
        self._at += len(data)


def _crc(parts: Iterable[bytes], crc: int = 0) -> int:
    for part in parts:
        crc = zlib.crc32(part, crc)
    return crc


def _bytes(records: Iterable[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _packed(parts: list[bytes], compression: str) -> list[bytes]:
    if not compression:
        return parts
    import lz4.frame  # type: ignore[import-untyped]
    import zstandard

    pack = lz4.frame.compress if compression == "lz4" else zstandard.compress
    return [pack(b"".join(parts))]
