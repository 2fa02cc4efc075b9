"""What is written as MCAP, held against mcap's own writer, and CRCs that are joined."""

from __future__ import annotations

import io
import zlib

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer

from irsim.recording.chunks import LARGE, ChunkWriter, Compression, Message
from irsim.recording.crc import joined
from irsim.recording.image import encode_image
from irsim.recording.schema import descriptor_set
from irsim.recording.times import EPOCH_NS
from irsim.types import Image

CHUNKS = [
    [Message(1, 0, 7, (b"first", b"", b"of three")), Message(2, 0, 5, (bytes(range(256)) * 4,))],
    [Message(2, 1, 9, (b"",)), Message(1, 1, 8, (b"ab", b"c")), Message(2, 2, 8, (b"\0",))],
    [Message(3, 3, 2**63, (b"head", b"\x5a" * LARGE, b"tail"))],
]
"""Sequences and times in no order; one chunk with a CRC that is joined."""


def written(compression: Compression, chunks: list[list[Message]]) -> bytes:
    file = io.BytesIO()
    writer = ChunkWriter(file, compression)
    writer.metadata("some", {"key": "välue", "empty": ""})
    writer.attachment("a.txt", "text/plain", b"attached")
    writer.topic("/one", RawImage.DESCRIPTOR, {"bits": "14"})
    writer.topic("/two", RawImage.DESCRIPTOR)
    for chunk in chunks[:2]:
        writer.chunk(chunk)
    writer.topic("/three", ImageAnnotations.DESCRIPTOR)
    for chunk in chunks[2:]:
        writer.chunk(chunk)
    writer.topic("/nothing", CompressedImage.DESCRIPTOR)
    writer.metadata("last", {})
    writer.finish()
    return file.getvalue()


def expected(compression: Compression, chunks: list[list[Message]]) -> bytes:
    file = io.BytesIO()
    writer = Writer(
        file,
        chunk_size=2**62,
        compression=CompressionType[compression.upper()],
        enable_crcs=True,
        enable_data_crcs=True,
    )
    writer.start(profile="")
    writer.add_metadata("some", {"key": "välue", "empty": ""})
    writer.add_attachment(EPOCH_NS, EPOCH_NS, "a.txt", "text/plain", b"attached")
    raw = writer.register_schema("foxglove.RawImage", "protobuf", descriptor_set(RawImage.DESCRIPTOR))
    writer.register_channel("/one", "protobuf", raw, {"bits": "14"})
    writer.register_channel("/two", "protobuf", raw)
    write_all(writer, chunks[:2])
    boxes = writer.register_schema("foxglove.ImageAnnotations", "protobuf", descriptor_set(ImageAnnotations.DESCRIPTOR))
    writer.register_channel("/three", "protobuf", boxes)
    write_all(writer, chunks[2:])
    nothing = writer.register_schema("foxglove.CompressedImage", "protobuf", descriptor_set(CompressedImage.DESCRIPTOR))
    writer.register_channel("/nothing", "protobuf", nothing)
    writer.add_metadata("last", {})
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def write_all(writer: Writer, chunks: list[list[Message]]) -> None:
    for chunk in chunks:
        for message in chunk:
            writer.add_message(
                message.channel, message.log_time, b"".join(message.parts), message.log_time, message.sequence
            )
        writer.flush()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@pytest.mark.parametrize("count", range(len(CHUNKS) + 1))
def test_a_file_is_that_of_mcaps_own_writer(compression: Compression, count: int) -> None:
    assert written(compression, CHUNKS[:count]) == expected(compression, CHUNKS[:count])


@pytest.mark.parametrize("length", [0, 1, 2, 3, 255, 256, 1000, 65_537, 2**20])
def test_crcs_joined_are_that_of_the_whole(length: int) -> None:
    data = np.random.default_rng(length).bytes(length + 99)
    assert joined(zlib.crc32(data[:99]), zlib.crc32(data[99:]), length) == zlib.crc32(data)
    assert joined(0, zlib.crc32(data), len(data)) == zlib.crc32(data)


@pytest.mark.parametrize(
    ("image", "encoding"),
    [
        (np.arange(6, dtype=np.uint16).reshape(2, 3) * 257, "mono16"),
        (np.zeros((0, 0), np.uint8), "mono8"),
        (np.ones((1, 127), np.uint8), "mono8"),
        (np.ones((1, 128), np.uint8), "mono8"),
        (np.ones((129, 127), np.uint8), "mono8"),
        (np.arange(200, dtype=np.uint16).reshape(10, 20)[::2, ::3], "mono16"),
    ],
)
def test_a_picture_is_encoded_as_protobuf_would(image: Image, encoding: str) -> None:
    """Lengths of one, two and three bytes among them."""
    message = RawImage(
        timestamp=Timestamp(seconds=3, nanos=7),
        frame_id="camera",
        width=image.shape[1],
        height=image.shape[0],
        encoding=encoding,
        step=image.shape[1] * image.itemsize,
        data=image.tobytes(),
    )
    assert RawImage.FromString(b"".join(encode_image(image, 3_000_000_007))) == message
    if image.size:
        assert b"".join(encode_image(image, 3_000_000_007)) == message.SerializeToString()
