"""irsim's own protobuf messages, and the conversion between them and frozen values.

The descriptors are built here, so no generated code and no protoc is needed; recordings carry them,
so any MCAP reader can decode the messages. Syntax proto2: a field that is not set is None.
"""

from __future__ import annotations

from math import isfinite
from typing import Any

from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import Message
from google.protobuf.message_factory import GetMessageClass

from irsim.types import Box, TargetTruth, Truth

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
TRUTH: Descriptor = _POOL.FindMessageTypeByName("irsim.Truth")
TRACK_STATE: Descriptor = _POOL.FindMessageTypeByName("irsim.TrackState")
TruthMessage = GetMessageClass(TRUTH)
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
