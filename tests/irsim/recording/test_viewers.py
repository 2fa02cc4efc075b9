"""Recordings as other tools read them: topics, schemas, annotations, chunks."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, DataEnd, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from recording_fakes import FULL, Noise

from irsim.recording import open_recording, record
from irsim.recording.messages import EPOCH_NS, encode_image
from irsim.types import CameraFacts


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(Noise(), tmp_path_factory.mktemp("rec") / "noise.mcap")


def test_topics_and_schemas_by_the_mcap_library(recorded: Path) -> None:
    with recorded.open("rb") as file:
        reader = SeekingReader(file, validate_crcs=True)
        seen: dict[str, tuple[str, list[int]]] = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            assert message.log_time == message.publish_time == EPOCH_NS + round(message.sequence / 30 * 1e9)
            seen.setdefault(channel.topic, (schema.name, []))[1].append(message.sequence)
        header = reader.get_header()
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {record.name: record.data for record in reader.iter_attachments()}
    everything = list(range(7))
    assert header.profile == ""
    assert seen == {
        "/ir/image": ("foxglove.RawImage", everything),
        "/ir/preview": ("foxglove.CompressedImage", everything),
        "/truth/annotations": ("foxglove.ImageAnnotations", everything),
        "/truth/targets": ("irsim.Truth", everything),
    }
    assert metadata["irsim"]["name"] == "noise"
    assert json.loads(metadata["irsim"]["size"]) == [32, 24]
    assert json.loads(metadata["irsim"]["agc"])["kind"] == "linear"
    layout = json.loads(attachments["layout.json"])
    assert layout["configById"]["Image!counts"]["imageMode"]["imageTopic"] == "/ir/image"


def test_messages_are_decoded_by_the_embedded_schemas(recorded: Path) -> None:
    with recorded.open("rb") as file:
        first = {channel.topic: (schema, message) for schema, channel, message in SeekingReader(file).iter_messages()}
    decoded = {}
    for topic, (schema, message) in first.items():
        assert schema is not None
        pool = DescriptorPool()
        for proto in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(proto)  # raises where an import is missing
        decoded[topic] = GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(message.data)
    jet = decoded["/truth/targets"].targets[0]  # type: ignore[attr-defined]  # a message class made from its schema
    assert (jet.id, jet.center.x, jet.visible) == ("jet", FULL.center[0], 0.75)
    assert list(jet.occluders) == ["pole", "cloud"]


@pytest.mark.parametrize(("bits", "encoding", "dtype"), [(8, "mono8", "u1"), (14, "mono16", "<u2")])
def test_images_are_foxglove_raw_images(tmp_path: Path, bits: int, encoding: str, dtype: str) -> None:
    path = record(Noise(bits=bits), tmp_path / "r.mcap")
    with path.open("rb") as file:
        messages = list(SeekingReader(file).iter_messages(topics=["/ir/image", "/ir/preview"]))
    channel = next(channel for _, channel, _ in messages if channel.topic == "/ir/image")
    assert channel.metadata["bits"] == str(bits)
    assert int(channel.metadata["display_low"]) < int(channel.metadata["display_high"]) < 2**bits
    image = RawImage.FromString(next(m.data for _, c, m in messages if c.topic == "/ir/image"))
    itemsize = np.dtype(dtype).itemsize
    assert (image.width, image.height, image.encoding, image.step) == (32, 24, encoding, 32 * itemsize)
    assert np.array_equal(np.frombuffer(image.data, dtype).reshape(24, 32), Noise(bits=bits).frame(0).image)
    preview = CompressedImage.FromString(next(m.data for _, c, m in messages if c.topic == "/ir/preview"))
    assert preview.format == "jpeg"
    assert preview.data.startswith(b"\xff\xd8\xff")  # JPEG's start of image


@pytest.mark.parametrize(("size", "dtype"), [((1, 127), "u1"), ((1, 128), "<u2"), ((97, 131), "<u2")])
def test_images_are_encoded_as_protobuf_does(size: tuple[int, int], dtype: str) -> None:
    drawn = np.random.default_rng(1).integers(0, 200, size).astype(dtype)
    for counts in (drawn, drawn[:, ::-1]):
        written = encode_image(counts, 12_345_678_901)
        image = RawImage.FromString(written)
        assert image.data == counts.tobytes()
        assert (image.frame_id, image.timestamp.seconds, image.timestamp.nanos) == ("camera", 12, 345_678_901)
        assert image.SerializeToString() == written


def test_annotations_have_their_origin_at_a_pixel_corner(recorded: Path) -> None:
    with recorded.open("rb") as file:
        _, _, message = next(SeekingReader(file).iter_messages(topics=["/truth/annotations"]))
    annotations = ImageAnnotations.FromString(message.data)
    (loop,) = annotations.points
    assert loop.type == PointsAnnotation.LINE_LOOP
    # The box 10.25 +- 8.5/2, 7 +- 6/2 from pixel centres is half a pixel more from the corner.
    corners = [(point.x, point.y) for point in loop.points]
    assert corners == [(6.5, 4.5), (15.0, 4.5), (15.0, 10.5), (6.5, 10.5)]
    (circle,) = annotations.circles  # the 2 px target: a box would cover it
    assert (circle.position.x, circle.position.y) == (3.5, 4.5)
    assert [text.text for text in annotations.texts] == ["jet", "dot"]


def test_chunks_hold_one_kind_of_message(recorded: Path) -> None:
    data = recorded.read_bytes()
    topics: list[list[str]] = []
    names: dict[int, str] = {}
    for item in StreamReader(io.BytesIO(data), emit_chunks=True, validate_crcs=True).records:
        if isinstance(item, DataEnd):
            assert item.data_section_crc != 0
        if isinstance(item, Chunk):
            assert item.uncompressed_crc != 0
            inside = breakup_chunk(item, validate_crc=True)
            names |= {part.id: part.topic for part in inside if isinstance(part, Channel)}
            topics.append([names[part.channel_id] for part in inside if isinstance(part, Message)])
    images = [chunk for chunk in topics if "/ir/image" in chunk]
    assert [len(chunk) for chunk in images] == [2, 2, 2, 1]
    assert all(set(chunk) == {"/ir/image"} for chunk in images)


def test_a_calibrated_camera(tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Calibrated(Noise):
        camera = CameraFacts(0.0005, "mwir", (220.0, 400.0))
        scenario_text = "seed: 3\n"

    path = record(Calibrated(), tmp_path / "r.mcap")
    with path.open("rb") as file:
        ((_, _, message),) = SeekingReader(file).iter_messages(topics=["/ir/camera_info"])
    camera = CameraCalibration.FromString(message.data)
    assert list(camera.K) == [2000, 0, 15.5, 0, 2000, 11.5, 0, 0, 1]  # 1/IFOV; the middle of 32 x 24
    recording = open_recording(path)
    assert recording.scenario_text == "seed: 3\n"
    assert recording.header.range_k == (220.0, 400.0)
