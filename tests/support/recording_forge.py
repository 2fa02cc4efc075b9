"""Recordings as somebody who means harm would write them: CRCs and digests right, the rest as told."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from recording_fakes import Noise

from irsim.recording.header import Contents, _digest
from irsim.recording.mcap_writer import Compression, McapWriter, Message
from irsim.recording.messages import IMAGE, SCENARIO, TRUTH, TRUTH_DESCRIPTOR, encode_image, encode_truth, to_ns
from irsim.recording.writer import header_of

SOURCE = Noise(count=1)


def honest_image() -> bytes:
    return encode_image(SOURCE.frame(0).image, to_ns(0.0))


def honest_truth() -> bytes:
    return encode_truth(next(SOURCE.truths()))


def forge(
    path: Path,
    header: Mapping[str, str] | None = None,
    contents: Mapping[str, str] | None = None,
    image: bytes | None = None,
    truth: bytes | None = None,
    scenario: bytes | None = None,
    compression: Compression = "none",
) -> Path:
    """A recording of one frame; `header` and `contents` change single texts of the metadata."""
    with path.open("wb") as file:
        writer = McapWriter(file, compression)
        writer.metadata("irsim", resealed(header_of(SOURCE).to_record(), header))
        if scenario is not None:
            writer.attachment(SCENARIO, "application/yaml", scenario)
        channel = writer.topic(TRUTH, TRUTH_DESCRIPTOR)
        writer.chunk([Message(channel, 0, to_ns(0.0), honest_truth() if truth is None else truth)])
        channel = writer.topic(IMAGE, RawImage.DESCRIPTOR)
        writer.chunk([Message(channel, 0, to_ns(0.0), honest_image() if image is None else image)])
        writer.metadata("irsim_contents", resealed(Contents(frames=1).to_record(), contents))
        writer.finish()
    return path


def resealed(record: dict[str, str], changes: Mapping[str, str] | None) -> dict[str, str]:
    texts = {key: text for key, text in record.items() if key != "digest"} | dict(changes or {})
    return {**texts, "digest": _digest(texts)}
