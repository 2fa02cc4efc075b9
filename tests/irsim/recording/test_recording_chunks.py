"""McapWriter writes the bytes of the MCAP library's writer."""

from __future__ import annotations

from io import BytesIO

import pytest
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer

from irsim.recording.mcap_writer import LIBRARY, Compression, McapWriter, Message
from irsim.recording.messages import EPOCH_NS, descriptor_set

TOPICS = {"/ir/image": RawImage.DESCRIPTOR, "/a": RawImage.DESCRIPTOR, "/boxes": ImageAnnotations.DESCRIPTOR}
FACTS = {"bits": "14", "unité": "°C"}

messages = st.builds(
    Message,
    channel=st.integers(1, len(TOPICS)),
    sequence=st.integers(0, 2**32 - 1),
    log_time=st.integers(0, 2**62),
    data=st.binary(max_size=300),
)
chunks = st.lists(st.lists(messages, min_size=1, max_size=5), max_size=4)


def theirs(written: list[list[Message]], compression: Compression) -> bytes:
    file = BytesIO()
    kind = CompressionType[compression.upper()]
    writer = Writer(file, chunk_size=2**62, compression=kind, enable_crcs=True, enable_data_crcs=True)
    writer.start(profile="", library=LIBRARY)
    writer.add_metadata("irsim", FACTS)
    schemas: dict[str, int] = {}
    for topic, descriptor in TOPICS.items():
        name = descriptor.full_name
        if name not in schemas:
            schemas[name] = writer.register_schema(name, "protobuf", descriptor_set(descriptor))
        writer.register_channel(topic, "protobuf", schemas[name], FACTS if topic == "/a" else {})
    for number, chunk in enumerate(written):
        for each in chunk:
            writer.add_message(each.channel, each.log_time, each.data, each.log_time, each.sequence)
        writer.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
        writer.add_attachment(EPOCH_NS, EPOCH_NS, f"{number}.txt", "text/plain", b"\0text" * number)
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    return file.getvalue()


def ours(written: list[list[Message]], compression: Compression) -> bytes:
    file = BytesIO()
    writer = McapWriter(file, compression)
    writer.metadata("irsim", FACTS)
    for topic, descriptor in TOPICS.items():
        writer.topic(topic, descriptor, FACTS if topic == "/a" else None)
    for number, chunk in enumerate(written):
        writer.chunk(chunk)
        writer.attachment(f"{number}.txt", "text/plain", b"\0text" * number)
    writer.finish()
    return file.getvalue()


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@given(chunks)
def test_bytes_equal_those_of_the_mcap_library(compression: Compression, written: list[list[Message]]) -> None:
    assert ours(written, compression) == theirs(written, compression)
