"""Bounds of targets in recordings: topic `/truth/bounds`, one message a frame.

Their messages have a proto file of their own, so that recordings without bounds have the same schemas as before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from google.protobuf.descriptor import Descriptor
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from irsim.recording.messages import Messages, checked_text, descriptor_file, optional_field
from irsim.types import TargetBounds

_NUMBERS = tuple(field.name for field in fields(TargetBounds) if field.name not in ("index", "target", "region"))
_REQUIRED = ("sd_x", "sd_y", "sd_xy", "d")

# The numbers of fields are part of the file format: append, never reorder.
_MESSAGES: Messages = {
    "Region": [("x", "uint32"), ("y", "uint32"), ("columns", "uint32"), ("rows", "uint32")],
    "TargetBounds": [("target", "string"), ("region", "Region"), *((name, "double") for name in _NUMBERS)],
    "FrameBounds": [("index", "uint32"), ("time", "double"), ("targets", "TargetBounds*")],
}
_POOL = DescriptorPool()
_POOL.Add(descriptor_file("irsim/bounds.proto", _MESSAGES))
BOUNDS_DESCRIPTOR: Descriptor = _POOL.FindMessageTypeByName("irsim.FrameBounds")
_Message = GetMessageClass(BOUNDS_DESCRIPTOR)


def encode_bounds(bounds: Sequence[TargetBounds], index: int, time: float) -> bytes:
    """Return the bounds of frame `index` at `time` s as the bytes of an irsim.FrameBounds message."""
    message: Any = _Message(index=index, time=time)
    for row in bounds:
        region = dict(zip(("x", "y", "columns", "rows"), row.region, strict=True))
        numbers = {name: getattr(row, name) for name in _NUMBERS}
        message.targets.add(target=row.target, region=region, **numbers)
    encoded: bytes = message.SerializeToString()
    return encoded


def decode_bounds(data: bytes | memoryview, index: int) -> tuple[TargetBounds, ...]:
    """Return the bounds of frame `index` from the bytes of an irsim.FrameBounds message.

    Raises ValueError or protobuf's DecodeError for other bytes.
    """
    message: Any = _Message.FromString(bytes(data))
    return tuple(_decoded(target, index) for target in message.targets)


def _decoded(message: Any, index: int) -> TargetBounds:
    numbers = {name: optional_field(message, name) for name in _NUMBERS}
    region = optional_field(message, "region")
    if region is None or any(numbers[name] is None for name in _REQUIRED):
        raise ValueError(f"bounds {numbers}")
    return TargetBounds(index=index, target=checked_text(message.target), region=region, **numbers)
