"""Import of images in MCAP files of other programs and in ROS 2 bags: counts, times and topics."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from mcap.writer import CompressionType, Writer

from irsim.errors import InputError
from irsim.recording import Recording, importers, open_recording
from irsim.recording.formats import ros2
from irsim.recording.importers import import_frames
from irsim.recording.messages import descriptor_set, timestamp
from irsim.types import Box, Image

COUNTS = np.random.default_rng(4).integers(0, 1 << 14, (5, 12, 16)).astype(np.uint16)
STEP_NS = 40_000_000


def raw(counts: Image, time: int, encoding: str = "mono16", pad: int = 0) -> bytes:
    data = np.pad(counts.reshape(len(counts), -1).view(np.uint8), ((0, 0), (0, pad)))
    rows, step = data.shape
    size: dict[str, Any] = {"width": counts.shape[1], "height": rows, "step": step}
    return RawImage(timestamp=timestamp(time), encoding=encoding, data=data.tobytes(), **size).SerializeToString()


def packed(counts: Image, time: int, form: str) -> bytes:
    data = cv2.imencode(f".{form}", counts)[1].tobytes()
    return CompressedImage(timestamp=timestamp(time), format=form, data=data).SerializeToString()


def mcap(path: Path, topics: dict[str, list[bytes]], first: int = 10**9, **options: Any) -> Path:
    """Write messages as another program does: with the mcap library, all topics in the same chunks."""
    writer = Writer(str(path), **options)
    writer.start()
    schemas = {
        kind: writer.register_schema(kind.DESCRIPTOR.full_name, "protobuf", descriptor_set(kind.DESCRIPTOR))
        for kind in (RawImage, CompressedImage)
    }
    text = writer.register_channel("/log", "json", writer.register_schema("Log", "jsonschema", b"{}"))
    kinds = {topic: CompressedImage if "compressed" in topic else RawImage for topic in topics}
    channels = {topic: writer.register_channel(topic, "protobuf", schemas[kind]) for topic, kind in kinds.items()}
    for index in range(max(map(len, topics.values()), default=1)):
        time = first + index * STEP_NS
        writer.add_message(text, time, b"{}", time)
        for topic, messages in topics.items():
            if index < len(messages):
                writer.add_message(channels[topic], time, messages[index], time)
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it untyped
    return path


def series(*args: Any, of: Any = raw) -> list[bytes]:
    return [of(counts, 10**9 + index * STEP_NS, *args) for index, counts in enumerate(COUNTS)]


def images(recording: Recording) -> Any:
    return np.stack([frame.image for frame in recording.frames()])


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4, "chunk_size": 1000},
        {"compression": CompressionType.ZSTD},
        {"use_chunking": False},
        {"use_statistics": False},
    ],
)
def test_raw_images_of_any_mcap_file(tmp_path: Path, options: dict[str, Any]) -> None:
    path = mcap(tmp_path / "other.mcap", {"/cam": series("mono16", 6)}, **options)
    recording = open_recording(import_frames(path, tmp_path / "r.mcap", bits=14))
    assert np.array_equal(images(recording), COUNTS)
    assert (recording.rate_hz, recording.bits) == (25.0, 14)
    assert [frame.time for frame in recording.frames()] == [index / 25 for index in range(5)]
    assert recording.contents.notes == ("no rate was given: 25 Hz, from the times of the messages, which are kept",)


def test_compressed_images_keep_16_bits(tmp_path: Path) -> None:
    path = mcap(tmp_path / "other.mcap", {"/compressed": series("png", of=packed)})
    assert np.array_equal(images(open_recording(import_frames(path, tmp_path / "r.mcap"))), COUNTS)
    grey = [np.full((12, 16), 40 * index, np.uint8) for index in range(3)]
    path = mcap(tmp_path / "jpeg.mcap", {"/compressed": [packed(each, 10**9, "jpeg") for each in grey]})
    found = images(open_recording(import_frames(path, tmp_path / "j.mcap", rate_hz=5)))
    assert np.array_equal(found, grey)


def test_colours_are_made_grey_as_in_pictures(tmp_path: Path) -> None:
    colours = np.random.default_rng(1).integers(0, 256, (12, 16, 3)).astype(np.uint8)
    (tmp_path / "png").mkdir()
    cv2.imwrite(str(tmp_path / "png" / "0.png"), colours)
    wanted = images(open_recording(import_frames(tmp_path / "png", tmp_path / "p.mcap")))
    for encoding, pixels in (("bgr8", colours), ("rgb8", colours[..., ::-1].copy())):
        path = mcap(tmp_path / f"{encoding}.mcap", {"/cam": [raw(pixels, 10**9, encoding)]})
        assert np.array_equal(images(open_recording(import_frames(path, tmp_path / "r.mcap"))), wanted)


def test_gaps_between_messages_are_kept(tmp_path: Path) -> None:
    times = [10**9 + index * STEP_NS for index in (0, 1, 2, 5, 6)]
    messages = [raw(counts, time) for counts, time in zip(COUNTS, times, strict=True)]
    path = mcap(tmp_path / "other.mcap", {"/cam": messages})
    recording = open_recording(import_frames(path, tmp_path / "r.mcap"))
    assert [round(25 * frame.time) for frame in recording.frames()] == [0, 1, 2, 5, 6]
    path = mcap(tmp_path / "back.mcap", {"/cam": messages[::-1]})
    with pytest.raises(InputError, match=r"/cam: message 1: is not later .* allowed: a frame rate \(rate_hz=HZ\)"):
        import_frames(path, tmp_path / "s.mcap")
    assert not (tmp_path / "s.mcap").exists()
    recording = open_recording(import_frames(path, tmp_path / "s.mcap", rate_hz=10))
    assert [frame.time for frame in recording.frames()] == [index / 10 for index in range(5)]


def test_topic_must_be_named_among_several(tmp_path: Path) -> None:
    topics = {"/left": series(), "/right": series()[:3], "/none": []}
    path = mcap(tmp_path / "two.mcap", topics)
    left, right = r"/left \(foxglove.RawImage, 5 messages\)", r"/right \(foxglove.RawImage, 3 messages\)"
    wrong: dict[str | None, str] = {
        None: rf"holds 2 topics of images: {left}, {right}; allowed: one of them \(topic=NAME\)$"
    }
    wrong |= {"/lift": rf"topic '/lift': allowed: {left}, {right}; did you mean '/left'\?$"}
    for topic, message in wrong.items():
        with pytest.raises(InputError, match=message):
            import_frames(path, tmp_path / "r.mcap", topic=topic)
    assert len(open_recording(import_frames(path, tmp_path / "r.mcap", topic="/right"))) == 3
    with pytest.raises(InputError, match=r"holds no images .*; its topics: /log \(Log, 1 message\)$"):
        import_frames(mcap(tmp_path / "text.mcap", {}), tmp_path / "s.mcap")
    with pytest.raises(InputError, match=r"is a recording and is kept as it is; allowed: no topic$"):
        import_frames(tmp_path / "r.mcap", tmp_path / "s.mcap", topic="/left")
    with pytest.raises(InputError, match="topic /left: allowed for a ROS 2 bag or an MCAP file only"):
        import_frames(tmp_path, tmp_path / "s.mcap", topic="/left")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"encoding": "32FC1"}, "message 1: has the encoding '32FC1'; allowed: mono8, "),
        ({"step": 31}, "message 1: has 384 bytes for 16x12 mono16 in rows of 31 bytes"),
        ({"height": 4_000_000_000}, "message 1: has 384 bytes for 16x4000000000 mono16 in rows of 32 bytes"),
        ({"data": b""}, "message 1: has 0 bytes for 16x12"),
        ({"width": 8, "step": 16}, "message 1: is 8x12, 16 bit but /cam: message 0 is 16x12, 16 bit"),
    ],
)
def test_wrong_images_are_one_line(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    wrong = RawImage.FromString(series()[1])
    for field, value in change.items():
        setattr(wrong, field, value)
    path = mcap(tmp_path / "other.mcap", {"/cam": [series()[0], wrong.SerializeToString()]})
    with pytest.raises(InputError, match=message):
        import_frames(path, tmp_path / "r.mcap")
    assert not (tmp_path / "r.mcap").exists()


def test_damaged_mcap_of_others_is_one_line(tmp_path: Path) -> None:
    path = mcap(tmp_path / "other.mcap", {"/cam": series()}, compression=CompressionType.NONE)
    whole = path.read_bytes()
    cuts = [whole[:at] for at in range(20, len(whole), len(whole) // 40)]
    at = whole.index(COUNTS[2].tobytes())
    flipped = whole[: at + 9] + bytes([whole[at + 9] ^ 4]) + whole[at + 10 :]
    for damaged in (*cuts, flipped):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"other\.mcap: damaged: .*; mcap recover writes a whole file"):
            import_frames(path, tmp_path / "r.mcap")
        assert not (tmp_path / "r.mcap").exists()


def ros_bag(folder: Path, messages: Iterable[Any], kind: str, **options: Any) -> Path:
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with BagWriter(folder, version=8, **options) as writer:
        topic = writer.add_connection("/cam", kind, typestore=store)
        for index, message in enumerate(messages):
            writer.write(topic, index * STEP_NS, store.serialize_cdr(message(store), kind))
    return folder


@pytest.mark.parametrize("order", ["<", ">"])
def test_sqlite_bag_of_both_byte_orders(tmp_path: Path, order: str) -> None:
    pytest.importorskip("rosbags")

    def message(index: int) -> Any:
        def of(store: Any) -> Any:
            types, counts = store.types, COUNTS[index].astype(f"{order}u2")
            stamp = types["builtin_interfaces/msg/Time"](sec=5, nanosec=index * STEP_NS)
            data = np.pad(counts.view(np.uint8), ((0, 0), (0, 3))).reshape(-1)
            size = {"height": 12, "width": 16, "step": 35, "is_bigendian": int(order == ">")}
            header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="cam")
            return types["sensor_msgs/msg/Image"](header=header, encoding="16UC1", data=data, **size)

        return of

    bag = ros_bag(tmp_path / "bag", [message(index) for index in range(5)], "sensor_msgs/msg/Image")
    for path in (bag, next(bag.glob("*.db3"))):
        assert np.array_equal(images(open_recording(import_frames(path, tmp_path / "r.mcap"))), COUNTS)
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: 3\n")
    with pytest.raises(InputError, match="bag: is not a whole ROS 2 bag: "):
        import_frames(bag, tmp_path / "s.mcap")


def test_compressed_images_of_a_bag(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")

    def message(index: int, form: str) -> Any:
        def of(store: Any) -> Any:
            stamp = store.types["builtin_interfaces/msg/Time"](sec=5, nanosec=index * STEP_NS)
            header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="cam")
            data = cv2.imencode(".png", COUNTS[index])[1].reshape(-1)
            return store.types["sensor_msgs/msg/CompressedImage"](header=header, format=form, data=data)

        return of

    kind = "sensor_msgs/msg/CompressedImage"
    bag = ros_bag(tmp_path / "bag", [message(index, "16UC1; png compressed ") for index in range(5)], kind)
    recording = open_recording(import_frames(bag, tmp_path / "r.mcap"))
    assert np.array_equal(images(recording), COUNTS)
    assert recording.rate_hz == 25
    depth = ros_bag(tmp_path / "depth", [message(0, "16UC1; compressedDepth png")], kind)
    with pytest.raises(InputError, match=r"/cam: message 0: is a depth image \(.*\); allowed: png, jpeg"):
        import_frames(depth, tmp_path / "s.mcap")


def test_bag_without_rosbags_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text("")
    monkeypatch.setitem(sys.modules, "rosbags", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"bag: needs rosbags: pip install 'irtrack\[ros2\]'"):
        importers.import_frames(tmp_path / "bag", tmp_path / "r.mcap")


def boxes_bag(folder: Path, frames: list[list[tuple[float, float, float, float, str, str]]]) -> Path:
    """Write a Detection2DArray a frame of (x, y, w, h, id, class)."""
    from rosbags.rosbag2 import Writer as BagWriter

    store, kind = ros2._types(), "vision_msgs/msg/Detection2DArray"
    types = {name: store.types[f"vision_msgs/msg/{name}"] for name in ros2.VISION_MSGS}
    point, turn, pose = (store.types[f"geometry_msgs/msg/{name}"] for name in ("Point", "Quaternion", "Pose"))
    anywhere = store.types["geometry_msgs/msg/PoseWithCovariance"](pose(point(0, 0, 0), turn(0, 0, 0, 1)), np.zeros(36))
    header = store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](0, 0), "")
    with BagWriter(folder, version=8) as writer:
        topic = writer.add_connection("/boxes", kind, typestore=store)
        for index, boxes in enumerate(frames):
            found = []
            for x, y, w, h, name, cls in boxes:
                center = types["Pose2D"](types["Point2D"](x, y), 0.0)
                results = [types["ObjectHypothesisWithPose"](types["ObjectHypothesis"](cls, 1.0), anywhere)] * bool(cls)
                found.append(types["Detection2D"](header, results, types["BoundingBox2D"](center, w, h), name))
            writer.write(topic, index, store.serialize_cdr(types["Detection2DArray"](header, found), kind))
    return folder


def test_boxes_of_a_bag_by_hand(tmp_path: Path) -> None:
    """The centre of the first pixel is (.5, .5): a box at 10.5, 5.5 of 4 x 3 px has its centre at pixel (10, 5)."""
    pytest.importorskip("rosbags")
    np.save(tmp_path / "c.npy", COUNTS[:2])
    bag = boxes_bag(tmp_path / "bag", [[(10.5, 5.5, 4, 3, "7", "jet"), (3, 3, 2, 2, "", "")], []])
    recording = open_recording(import_frames(tmp_path / "c.npy", tmp_path / "r.mcap", truth=bag))
    first, second = recording.truths()
    assert [(each.id, each.cls, each.box) for each in first.targets] == [
        ("target-7", "jet", Box(10, 5, 4, 3)),
        ("target-1", None, Box(2.5, 2.5, 2, 2)),
    ]
    assert second.targets == ()
    wrong: list[tuple[list[list[tuple[float, float, float, float, str, str]]], str]] = [
        ([[]], "bag1: holds 1 Detection2DArray for 2 pictures; allowed: one for each"),
        ([[(1, 1, 0, 3, "a", "")], []], "message 0: a box of 0 x 3 px at 1, 1; allowed: more than 0 px"),
        ([[(1, 1, 2, 3, "a", ""), (5, 5, 2, 3, "a", "")], []], "frame 0 has 'a' in message 0 already"),
        ([[(np.nan, 1, 2, 3, "a", "")], []], "message 0: a box of 2 x 3 px at nan, 1"),
    ]
    for number, (frames, message) in enumerate(wrong, 1):
        bag = boxes_bag(tmp_path / f"bag{number}", frames)
        with pytest.raises(InputError, match=message):
            import_frames(tmp_path / "c.npy", tmp_path / "s.mcap", truth=bag)
