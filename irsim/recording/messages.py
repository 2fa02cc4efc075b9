"""Messages of a recording: times, bands, protobuf schemas, images, annotations, topics and the viewer layout."""

from __future__ import annotations

import json
import re
from math import isfinite
from typing import Any, get_args

import numpy as np
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations
from foxglove_schemas_protobuf.PointsAnnotation_pb2 import PointsAnnotation
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.timestamp_pb2 import Timestamp

from irsim.types import Band, BandName, Box, Image, TargetTruth, Truth

EPOCH_NS = 1_577_836_800 * 10**9
"""Time 0 of every source: 2020-01-01T00:00:00Z, ns since the Unix epoch. Viewers show dates; a fixed
one keeps files reproducible and lets a track be opened beside its source."""


def to_ns(time: float) -> int:
    """Log time of a frame time in s."""
    return EPOCH_NS + round(time * 1e9)


def from_ns(log_time: int, rate_hz: float) -> float:
    """Frame time in s of a log time.

    Log times are rounded to 1 ns; a time that rounds like a whole number of frame periods is one, so
    that index / rate comes back bit for bit.
    """
    seconds = (log_time - EPOCH_NS) / 1e9
    regular = round(seconds * rate_hz) / rate_hz
    return regular if to_ns(regular) == log_time else seconds


_NAMED: dict[str, Band] = {name: name for name in get_args(BandName)}
_LIMITS = re.compile(r"(\d+(?:\.\d+)?) to (\d+(?:\.\d+)?) um")


def words_of(band: Band) -> str:
    """'lwir', or '3.4 to 4.9 um': every digit of the limits, so that `band_of` gives the same band."""
    return band if isinstance(band, str) else "{} to {} um".format(*band)


def band_of(words: str) -> Band | None:
    """The band that was worded; None where the words say none that is known."""
    limits = _LIMITS.fullmatch(words)
    return _NAMED.get(words) if limits is None else (float(limits[1]), float(limits[2]))


# Message -> its fields in order of their numbers: (name, type); "*" marks a repeated field. Numbers
# are part of the file format: append, never reorder.
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
    "Truth": [("index", "uint32"), ("time", "double"), ("targets", "TargetTruth*")],
    "TrackState": [
        ("index", "uint32"),
        ("time", "double"),
        ("box", "Box"),
        ("status", "string"),
        ("score", "double"),
        ("velocity", "Point"),
        ("covariance", "double*"),
        ("neff", "double"),
    ],
}

_SCALARS = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "string": FieldDescriptorProto.TYPE_STRING,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "uint32": FieldDescriptorProto.TYPE_UINT32,
}


def _file() -> FileDescriptorProto:
    file = FileDescriptorProto(name="irsim/recording.proto", package="irsim", syntax="proto2")
    for name, fields in _MESSAGES.items():
        message = file.message_type.add(name=name)
        for number, (field, kind) in enumerate(fields, 1):
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
_POOL.Add(_file())
TRUTH_DESCRIPTOR: Descriptor = _POOL.FindMessageTypeByName("irsim.Truth")
TRACK_STATE: Descriptor = _POOL.FindMessageTypeByName("irsim.TrackState")
TruthMessage = GetMessageClass(TRUTH_DESCRIPTOR)
TrackStateMessage = GetMessageClass(TRACK_STATE)


def descriptor_set(descriptor: Descriptor) -> bytes:
    """A serialised FileDescriptorSet of a message's file and all that it imports, imports first."""
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
    return None if value is None else {"x": value[0], "y": value[1]}


def box(value: Box) -> dict[str, float]:
    return {"cx": value.cx, "cy": value.cy, "w": value.w, "h": value.h}


def optional(message: Any, field: str) -> Any:
    """A field's value, None where it is not set; a Point or an Attitude as a tuple. ValueError as `text`."""
    if not message.HasField(field):
        return None
    value = getattr(message, field)
    if isinstance(value, Message):
        return tuple(getattr(value, part.name) for part in value.DESCRIPTOR.fields)
    return text(value) if isinstance(value, bytes) else value


def text(value: str | bytes) -> str:
    """A text; ValueError where it is bytes, as protobuf gives one that is not UTF-8."""
    if isinstance(value, bytes):
        raise ValueError(f"{value!r} is no text")
    return value


def needed(message: Any, field: str) -> Any:
    """The numbers of a field that must be there, as a tuple; ValueError where it is not set or one is not finite."""
    values = optional(message, field)
    if values is None or not all(map(isfinite, values)):
        raise ValueError(f"{field} {values}")
    return values


def encode_truth(truth: Truth) -> bytes:
    """The bytes of an irsim.Truth."""
    targets = [
        {
            "id": target.id,
            "cls": target.cls,
            "center": point(target.center),
            "box": box(target.box),
            "signal_center": point(target.signal_center),
            "velocity": point(target.velocity),
            "attitude": target.attitude and dict(zip(("yaw", "pitch", "roll"), target.attitude, strict=True)),
            "range_m": target.range_m,
            "visible": target.visible,
            "occluders": target.occluders,
            "crossing": target.crossing,
            "in_view": target.in_view,
            "contrast_k": target.contrast_k,
            "accuracy_px": target.accuracy_px,
            "scr": target.scr,
        }
        for target in truth.targets
    ]
    return bytes(TruthMessage(index=truth.index, time=truth.time, targets=targets).SerializeToString())


def decode_truth(data: bytes | memoryview, index: int, time: float) -> Truth:
    """The Truth of frame `index` at `time` s from the bytes of an irsim.Truth; ValueError or protobuf's
    DecodeError where they are none."""
    message: Any = TruthMessage.FromString(data)  # type: ignore[arg-type]  # protobuf takes a memoryview, its stubs only bytes
    targets = [
        TargetTruth(
            id=text(target.id),
            center=needed(target, "center"),
            box=Box(*needed(target, "box")),
            cls=optional(target, "cls"),
            signal_center=optional(target, "signal_center"),
            velocity=optional(target, "velocity"),
            attitude=optional(target, "attitude"),
            range_m=optional(target, "range_m"),
            visible=optional(target, "visible"),
            occluders=tuple(map(text, target.occluders)),
            crossing=optional(target, "crossing"),
            in_view=optional(target, "in_view"),
            contrast_k=optional(target, "contrast_k"),
            accuracy_px=target.accuracy_px,
            scr=optional(target, "scr"),
        )
        for target in message.targets
    ]
    return Truth(index, time, tuple(targets))


OPTICAL_FRAME = "camera"
"""The frame of reference that images and calibration share."""

_DTYPES = {"mono16": "<u2", "mono8": "u1"}

_DATA = bytes([RawImage.DATA_FIELD_NUMBER << 3 | 2])
"""What stands before the length of a RawImage's data."""
_BEHIND = RawImage(frame_id=OPTICAL_FRAME).SerializeToString()
"""The field after the data, which is the same in all images."""


def encode_image(image: Image, log_time: int) -> bytes:
    """The bytes of a foxglove.RawImage: mono16 (little-endian) or mono8, as the image's type is."""
    encoding = "mono16" if image.dtype == np.uint16 else "mono8"
    before = RawImage(
        timestamp=stamp(log_time),
        width=image.shape[1],
        height=image.shape[0],
        encoding=encoding,
        step=image.shape[1] * image.itemsize,
    )
    counts = np.ascontiguousarray(image, _DTYPES[encoding])
    # Messages one behind the other are one (protobuf's encoding guide): copied once and not four times.
    length = _varint(counts.nbytes)
    return b"".join((before.SerializeToString(), _DATA, length, counts.data, _BEHIND))


def _varint(number: int) -> bytes:
    """A number as protobuf has it: seven bits a byte, the last ones first."""
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes((*found, number))


def decode_image(data: memoryview, size: tuple[int, int]) -> Image:
    """The read-only (rows, columns) counts of a foxglove.RawImage; ValueError or protobuf's DecodeError
    where they are not those of a picture of `size` (columns, rows)."""
    message = RawImage.FromString(data)  # type: ignore[arg-type]  # protobuf takes a memoryview, its stubs only bytes
    if message.encoding not in _DTYPES:
        raise ValueError(f"encoding {message.encoding!r}")
    dtype = np.dtype(_DTYPES[message.encoding])
    columns, rows = size
    if (message.width, message.height, message.step) != (columns, rows, columns * dtype.itemsize):
        raise ValueError(f"{message.width}x{message.height}, {message.step} bytes a row")
    return np.frombuffer(message.data, dtype).reshape(rows, columns)


CORNER_PX = 0.5
"""Annotations count from the top-left corner of the top-left pixel, irsim from its centre
(foxglove.PointsAnnotation: "the top-left corner of the top-left pixel of the image as the origin")."""

POINT_LIKE_PX = 5.0
"""A target smaller than this gets a circle around it: a box would cover it."""

_CIRCLE_PX = 3 * POINT_LIKE_PX
_TEXT_PX = 10.0
_LINE_PX = 1.0

Rgba = dict[str, float]

# Colours of Okabe & Ito (2008), told apart by colour-blind eyes too.
SEEN: Rgba = {"r": 0.0, "g": 0.62, "b": 0.45, "a": 1.0}
HIDDEN: Rgba = {"r": 0.90, "g": 0.62, "b": 0.0, "a": 1.0}
TRACK: Rgba = {"r": 0.34, "g": 0.71, "b": 0.91, "a": 1.0}
_CLEAR: Rgba = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}


def _time(log_time: int) -> dict[str, int]:
    return {"seconds": log_time // 10**9, "nanos": log_time % 10**9}


def stamp(log_time: int) -> Timestamp:
    """The protobuf timestamp of a log time in ns."""
    return Timestamp(**_time(log_time))


def _point(x: float, y: float) -> dict[str, float]:
    return {"x": x + CORNER_PX, "y": y + CORNER_PX}


def draw(annotations: ImageAnnotations, box: Box, label: str, color: Rgba, log_time: int) -> None:
    """Add a box, or a circle around a point-like target, and its label."""
    time = _time(log_time)
    left, top, right, bottom = box.edges
    if max(box.w, box.h) < POINT_LIKE_PX:
        annotations.circles.add(
            timestamp=time,
            position=_point(box.cx, box.cy),
            diameter=_CIRCLE_PX,
            thickness=_LINE_PX,
            fill_color=_CLEAR,
            outline_color=color,
        )
        top = box.cy - _CIRCLE_PX / 2
    else:
        annotations.points.add(
            timestamp=time,
            type=PointsAnnotation.LINE_LOOP,
            points=[_point(left, top), _point(right, top), _point(right, bottom), _point(left, bottom)],
            outline_color=color,
            fill_color=_CLEAR,
            thickness=_LINE_PX,
        )
    annotations.texts.add(
        timestamp=time,
        position=_point(left, top - 1),
        text=label,
        font_size=_TEXT_PX,
        text_color=color,
        background_color=_CLEAR,
    )


def annotate_truth(truth: Truth, log_time: int) -> bytes:
    """The bytes of foxglove.ImageAnnotations: every target, in another colour where mostly hidden."""
    annotations = ImageAnnotations()
    for target in truth.targets:
        label = target.id if target.scr is None else f"{target.id}  SCR {target.scr:.1f}"
        draw(annotations, target.box, label, HIDDEN if target.hidden else SEEN, log_time)
    return annotations.SerializeToString()


IMAGE, PREVIEW, CAMERA = "/ir/image", "/ir/preview", "/ir/camera_info"
TRUTH_BOXES, TRUTH = "/truth/annotations", "/truth/targets"
"""Topics."""

SCENARIO, LAYOUT = "scenario.yaml", "layout.json"
"""Attachments: the scenario as rendered, and the layout."""


def display_range(image: Image, bits: int) -> tuple[int, int]:
    """Counts to show as black and white: the middle 99 % of a frame and half as much again each side."""
    low, high = np.percentile(image, (0.5, 99.5))
    margin = max((high - low) / 2, 1.0)
    return max(int(low - margin), 0), min(int(high + margin), 2**bits - 1)


def viewer_layout(black: int, white: int, has_truth: bool) -> bytes:
    """JSON that Foxglove and Lichtblick import: counts beside the 8-bit preview, truth boxes on both."""
    annotations = {TRUTH_BOXES: {"visible": True}} if has_truth else {}
    counts = {"imageTopic": IMAGE, "annotations": annotations, "minValue": black, "maxValue": white}
    preview = {"imageTopic": PREVIEW, "annotations": annotations}
    layout = {
        "configById": {"Image!counts": {"imageMode": counts}, "Image!preview": {"imageMode": preview}},
        "globalVariables": {},
        "userNodes": {},
        "layout": {"first": "Image!counts", "second": "Image!preview", "direction": "row"},
    }
    return json.dumps(layout, indent=2).encode()
