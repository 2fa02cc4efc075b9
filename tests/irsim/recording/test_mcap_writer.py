"""McapWriter writes the bytes of the MCAP library's writer."""

from __future__ import annotations

from io import BytesIO

import pytest
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from hypothesis import given, settings
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


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
@settings(max_examples=25)
@given(chunks)
def test_bytes_equal_those_of_the_mcap_library(compression: Compression, written: list[list[Message]]) -> None:
    theirs, ours = BytesIO(), BytesIO()
    kind = CompressionType[compression.upper()]
    library = Writer(theirs, chunk_size=2**62, compression=kind, enable_crcs=True, enable_data_crcs=True)
    library.start(profile="", library=LIBRARY)
    writer = McapWriter(ours, compression)
    library.add_metadata("irsim", FACTS)
    writer.metadata("irsim", FACTS)
    schemas: dict[str, int] = {}
    for topic, descriptor in TOPICS.items():
        name = descriptor.full_name
        if name not in schemas:
            schemas[name] = library.register_schema(name, "protobuf", descriptor_set(descriptor))
        library.register_channel(topic, "protobuf", schemas[name], FACTS if topic == "/a" else {})
        writer.topic(topic, descriptor, FACTS if topic == "/a" else None)
    for number, chunk in enumerate(written):
        for each in chunk:
            library.add_message(each.channel, each.log_time, each.data, each.log_time, each.sequence)
        library.flush()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
        writer.chunk(chunk)
        library.add_attachment(EPOCH_NS, EPOCH_NS, f"{number}.txt", "text/plain", b"\0text" * number)
        writer.attachment(f"{number}.txt", "text/plain", b"\0text" * number)
    library.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    writer.finish()
    assert ours.getvalue() == theirs.getvalue()
