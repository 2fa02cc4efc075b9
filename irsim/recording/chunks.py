"""Writing MCAP with the chunks that we choose: a call, a chunk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import BinaryIO, Literal

from google.protobuf.descriptor import Descriptor
from mcap.writer import CompressionType, Writer

from irsim.recording.schema import descriptor_set
from irsim.recording.times import EPOCH_NS

Compression = Literal["none", "lz4", "zstd"]

_NEVER = 2**62  # bytes: a chunk ends when told, not when it is full


@dataclass(frozen=True, slots=True)
class Message:
    """A message on its way into a chunk: channel, sequence (frame index), log time in ns, bytes."""

    channel: int
    sequence: int
    log_time: int
    data: bytes


class ChunkWriter:
    """An MCAP file in the making, with chunk, attachment, data and summary CRCs."""

    def __init__(self, file: BinaryIO, compression: Compression = "none") -> None:
        self._writer = Writer(
            file,
            chunk_size=_NEVER,
            compression=CompressionType[compression.upper()],
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._schemas: dict[str, int] = {}
        self._writer.start(profile="")

    def topic(self, topic: str, descriptor: Descriptor, metadata: Mapping[str, str] | None = None) -> int:
        """The channel of a new topic of protobuf messages."""
        name = descriptor.full_name
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, "protobuf", descriptor_set(descriptor))
        return self._writer.register_channel(topic, "protobuf", self._schemas[name], dict(metadata or {}))

    def chunk(self, messages: Iterable[Message]) -> None:
        """Write the messages as one chunk."""
        for message in messages:
            self._writer.add_message(
                channel_id=message.channel,
                log_time=message.log_time,
                data=message.data,
                publish_time=message.log_time,
                sequence=message.sequence,
            )
        self._writer.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        self._writer.add_metadata(name, dict(values))

    def attachment(self, name: str, media_type: str, data: bytes) -> None:
        self._writer.add_attachment(EPOCH_NS, EPOCH_NS, name, media_type, data)

    def finish(self) -> None:
        """Write the summary. The file is the caller's to close."""
        self._writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
