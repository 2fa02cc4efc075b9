"""Topics, times, protobuf schemas, truths and images in recordings."""

from __future__ import annotations

import re
from dataclasses import fields
from math import isfinite
from typing import Any, get_args

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import Timestamp

from irsim.errors import one_line
from irsim.recording.archive import decode_archived, encode_archived, is_archived
from irsim.types import Band, BandName, Box, Image, Pose, TargetTruth, Truth

EPOCH_NS = 1_577_836_800 * 10**9
"""Log time of frame time 0: 2020-01-01T00:00:00Z, ns since the Unix epoch. The date is fixed, so that files are
reproducible and viewers align a track with its source."""

IMAGE, PREVIEW, CAMERA = "/ir/image", "/ir/preview", "/ir/camera_info"
TRUTH_BOXES, TRUTH, BOUNDS = "/truth/annotations", "/truth/targets", "/truth/bounds"
"""Topics of a recording."""

SCENARIO, LAYOUT = "scenario.yaml", "layout.json"
"""Names of attachments: the rendered scenario, and the viewer layout."""


def to_ns(time: float) -> int:
    """Return the log time, ns, of a frame time in s."""
    return EPOCH_NS + round(time * 1e9)


def time_fields(log_time: int) -> dict[str, int]:
    """Return the fields of the protobuf timestamp for a log time in ns."""
    return {"seconds": log_time // 10**9, "nanos": log_time % 10**9}


def timestamp(log_time: int) -> Timestamp:
    """Return the protobuf timestamp for a log time in ns."""
    return Timestamp(**time_fields(log_time))


def from_ns(log_time: int, rate_hz: float) -> float:
    """Return the frame time in s for a log time in ns.

    Where the log time is a whole number of frame periods, rounded to 1 ns, the frame time is exactly index / rate.
    """
    seconds = (log_time - EPOCH_NS) / 1e9
    regular = round(seconds * rate_hz) / rate_hz
    return regular if to_ns(regular) == log_time else seconds


_NAMED: dict[str, Band] = {name: name for name in get_args(BandName)}
_LIMITS = re.compile(r"(\d+(?:\.\d+)?) to (\d+(?:\.\d+)?) um")


def band_text(band: Band) -> str:
    """Return the text of a band: 'lwir', or '3.4 to 4.9 um' with every digit, for `parse_band` to read."""
    return band if isinstance(band, str) else "{} to {} um".format(*band)


def parse_band(words: str) -> Band | None:
    """Return the band of a text that `band_text` wrote; None for any other text."""
    limits = _LIMITS.fullmatch(words)
    return _NAMED.get(words) if limits is None else (float(limits[1]), float(limits[2]))


# The numbers of fields are part of the file format: append, never reorder.
_MESSAGES: dict[str, list[tuple[str, str]]] = {
    "Point": [("x", "double"), ("y", "double")],
    "Box": [("cx", "double"), ("cy", "double"), ("w", "double"), ("h", "double")],
    "Attitude": [("yaw", "double"), ("pitch", "double"), ("roll", "double")],
    "TargetTruth": [
        ("id", "string"),
        ("cls", "string"),
        ("center", "Point"),
        ("box", "Box"),
        ("signal_center", "Point"),
        ("velocity", "Point"),
        ("attitude", "Attitude"),
        ("range_m", "double"),
        ("visible", "double"),
        ("occluders", "string*"),
        ("crossing", "bool"),
        ("in_view", "bool"),
        ("contrast_k", "double"),
        ("accuracy_px", "double"),
        ("scr", "double"),
    ],
    "Place": [("east", "double"), ("north", "double"), ("up", "double")],
    "Pose": [
        ("azimuth_deg", "double"),
        ("elevation_deg", "double"),
        ("roll_deg", "double"),
        ("ifov_rad", "double"),
        ("place_m", "Place"),
    ],
    "Truth": [("index", "uint32"), ("time", "double"), ("targets", "TargetTruth*"), ("pose", "Pose")],
    "TrackState": [
        ("index", "uint32"),
        ("time", "double"),
        ("box", "Box"),
        ("status", "string"),
        ("score", "double"),
        ("velocity", "Point"),
        ("covariance", "double*"),
        ("neff", "double"),
        ("id", "int64"),
        ("cls", "string"),
        ("confirmed", "bool"),
    ],
}

_SCALARS = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "string": FieldDescriptorProto.TYPE_STRING,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "uint32": FieldDescriptorProto.TYPE_UINT32,
    "int64": FieldDescriptorProto.TYPE_INT64,
}


Messages = dict[str, list[tuple[str, str]]]
"""Message -> fields (name, type) in the order of their numbers; "*" marks a repeated field."""


def descriptor_file(path: str, messages: Messages) -> FileDescriptorProto:
    """Return the description of a proto file with these messages."""
    file = FileDescriptorProto(name=path, package="irsim", syntax="proto2")
    for name, members in messages.items():
        message = file.message_type.add(name=name)
        for number, (field, kind) in enumerate(members, 1):
            repeated, kind = kind.endswith("*"), kind.rstrip("*")
            added = message.field.add(name=field, number=number)
            added.label = FieldDescriptorProto.LABEL_REPEATED if repeated else FieldDescriptorProto.LABEL_OPTIONAL
            if kind in _SCALARS:
                added.type = _SCALARS[kind]
            else:
                added.type = FieldDescriptorProto.TYPE_MESSAGE
                added.type_name = f".irsim.{kind}"
    return file


_POOL = DescriptorPool()
_POOL.Add(descriptor_file("irsim/recording.proto", _MESSAGES))
TRUTH_DESCRIPTOR: Descriptor = _POOL.FindMessageTypeByName("irsim.Truth")
TRACK_STATE: Descriptor = _POOL.FindMessageTypeByName("irsim.TrackState")
TruthMessage = GetMessageClass(TRUTH_DESCRIPTOR)
TrackStateMessage = GetMessageClass(TRACK_STATE)


def descriptor_set(descriptor: Descriptor) -> bytes:
    """Return the serialised FileDescriptorSet of the file that defines a message, after the files that it imports."""
    files: dict[str, FileDescriptor] = {}

    def collect(file: FileDescriptor) -> None:
        for imported in file.dependencies:
            collect(imported)
        files[file.name] = file

    collect(descriptor.file)
    found = FileDescriptorSet()
    for file in files.values():
        file.CopyToProto(found.file.add())
    return found.SerializeToString()


def point(value: tuple[float, float] | None) -> dict[str, float] | None:
    """Return the fields of a Point message."""
    return None if value is None else {"x": value[0], "y": value[1]}


def box(value: Box) -> dict[str, float]:
    """Return the fields of a Box message."""
    return {"cx": value.cx, "cy": value.cy, "w": value.w, "h": value.h}


def optional_field(message: Any, field: str) -> Any:
    """Return the value of a field, or None; a Point or an Attitude as a tuple. Raises ValueError as in
    `checked_text`."""
    if not message.HasField(field):
        return None
    value = getattr(message, field)
    if isinstance(value, Message):
        return tuple(getattr(value, part.name) for part in value.DESCRIPTOR.fields)
    return checked_text(value) if isinstance(value, bytes | str) else value


FARTHEST = 1e12
"""Largest magnitude of a coordinate or size, px or m: beyond it, squares and products could overflow."""


def checked_text(value: str | bytes) -> str:
    """Return a text, with characters escaped that control a terminal. Raises ValueError for bytes, by which protobuf
    returns text that is not UTF-8."""
    if isinstance(value, bytes):
        raise ValueError(f"{value!r} is not text")
    return one_line(value)


def required_numbers(message: Any, field: str) -> Any:
    """Return the numbers of a field as a tuple. Raises ValueError where one is missing or beyond `FARTHEST`."""
    values = optional_field(message, field)
    if values is None or not all(abs(value) <= FARTHEST for value in values):
        raise ValueError(f"{field} {values}")
    return values


_PLAIN = tuple(name for name, kind in _MESSAGES["TargetTruth"] if kind.rstrip("*") in _SCALARS)
_OPTIONAL = {field.name for field in fields(TargetTruth)} - {"id", "center", "box", "occluders", "accuracy_px"}
"""Names of the target's scalar fields (`_PLAIN`) and of its optional fields."""


def encode_truth(truth: Truth) -> bytes:
    """Return a truth as the bytes of an irsim.Truth message."""
    targets = [
        {name: getattr(target, name) for name in _PLAIN}
        | {name: point(getattr(target, name)) for name in ("center", "signal_center", "velocity")}
        | {"attitude": target.attitude and dict(zip(("yaw", "pitch", "roll"), target.attitude, strict=True))}
        | {"box": box(target.box)}
        for target in truth.targets
    ]
    pose = None if truth.pose is None else _pose_fields(truth.pose)
    return bytes(TruthMessage(index=truth.index, time=truth.time, targets=targets, pose=pose).SerializeToString())


def _pose_fields(pose: Pose) -> dict[str, Any]:
    """Return the fields of a Pose message."""
    place = dict(zip(("east", "north", "up"), pose.place_m, strict=True))
    return {name: getattr(pose, name) for name in Pose.__slots__} | {"place_m": place}


def decode_truth(data: bytes | memoryview, index: int, time: float) -> Truth:
    """Return the Truth of frame `index` at `time` s from the bytes of an irsim.Truth message.

    Raises ValueError or protobuf's DecodeError for other bytes.
    """
    message: Any = TruthMessage.FromString(data)  # type: ignore[arg-type]  # protobuf takes a memoryview, its stubs only bytes
    targets = [
        TargetTruth(
            id=checked_text(target.id),
            center=required_numbers(target, "center"),
            box=Box(*required_numbers(target, "box")),
            occluders=tuple(map(checked_text, target.occluders)),
            accuracy_px=target.accuracy_px,
            **{name: optional_field(target, name) for name in _OPTIONAL},
        )
        for target in message.targets
    ]
    return Truth(index, time, tuple(targets), _decode_pose(message.pose) if message.HasField("pose") else None)


def _decode_pose(message: Any) -> Pose:
    """Return the pose of a Pose message. Raises ValueError where a number is missing or not finite."""
    place = required_numbers(message, "place_m")
    angles = {name: optional_field(message, name) for name in Pose.__slots__ if name != "place_m"}
    if not all(value is not None and isfinite(value) for value in angles.values()) or angles["ifov_rad"] <= 0:
        raise ValueError(f"pose {angles}")
    return Pose(**angles, place_m=place)


OPTICAL_FRAME = "camera"
"""Name of the coordinate frame of images and calibration."""

_DTYPES = {"mono16": "<u2", "mono8": "u1"}

_DATA = bytes([RawImage.DATA_FIELD_NUMBER << 3 | 2])
"""Tag of the field `data` of a RawImage, which precedes its length."""
_LAST_FIELD = RawImage(frame_id=OPTICAL_FRAME).SerializeToString()
"""Serialised field after the data, the same in all images."""


def encode_image(image: Image, log_time: int) -> bytes:
    """Return an image as the bytes of a foxglove.RawImage: mono16 (little-endian) for uint16, mono8 for uint8."""
    encoding = "mono16" if image.dtype == np.uint16 else "mono8"
    before = RawImage(
        timestamp=timestamp(log_time),
        width=image.shape[1],
        height=image.shape[0],
        encoding=encoding,
        step=image.shape[1] * image.itemsize,
    )
    counts = np.ascontiguousarray(image, _DTYPES[encoding])
    # Concatenated messages are one message (protobuf's encoding guide): the counts are copied once, not four times.
    length = _varint(counts.nbytes)
    return b"".join((before.SerializeToString(), _DATA, length, counts.data, _LAST_FIELD))


def encode_archived_image(image: Image, log_time: int) -> bytes:
    """Return an image as the bytes of a foxglove.CompressedImage, see `archive`."""
    return encode_archived(image, timestamp(log_time), OPTICAL_FRAME)


def _varint(number: int) -> bytes:
    """Return a number as a protobuf varint: seven bits in each byte, lowest first."""
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes((*found, number))


def decode_image(data: memoryview, size: tuple[int, int] | None = None) -> Image:
    """Return the read-only counts (rows, columns) of a foxglove.RawImage, or of an archived image.

    Raises InputError where the package for archived images is missing. Raises ValueError or protobuf's DecodeError for
    other bytes, or a size other than `size` (columns, rows), if given.
    """
    message = RawImage.FromString(data)  # type: ignore[arg-type]  # protobuf takes a memoryview, its stubs only bytes
    if message.encoding not in _DTYPES:
        packed = CompressedImage.FromString(data)  # type: ignore[arg-type]
        if is_archived(packed):
            return decode_archived(packed, size)
        raise ValueError(f"encoding {message.encoding!r}")
    dtype = np.dtype(_DTYPES[message.encoding])
    columns, rows = size or (message.width, message.height)
    if (message.width, message.height, message.step) != (columns, rows, columns * dtype.itemsize):
        raise ValueError(f"{message.width}x{message.height}, {message.step} bytes a row")
    return np.frombuffer(message.data, dtype).reshape(rows, columns)
