"""Images in messages of other programs: foxglove.RawImage and CompressedImage, and ROS's sensor_msgs."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.errors import InputError
from irsim.recording.images import CODEC_ROUNDING, Picture, as_grey, decoded

Decoder = Callable[[Any], Any]
"""Function that turns the bytes of a message into an object with the fields of its schema."""

KINDS = ("foxglove.RawImage", "foxglove.CompressedImage", "sensor_msgs/Image", "sensor_msgs/CompressedImage")
"""Schemas of images that are read: protobuf of Foxglove, and ROS 2 (CDR)."""

_CHANNELS = {
    **dict.fromkeys(("mono8", "8UC1"), ("u1", 1)),
    **dict.fromkeys(("mono16", "16UC1"), ("u2", 1)),
    **dict.fromkeys(("bgr8", "rgb8", "8UC3"), ("u1", 3)),
    **dict.fromkeys(("bgra8", "rgba8", "8UC4"), ("u1", 4)),
}
"""Encodings (foxglove.RawImage, sensor_msgs/image_encodings.hpp): type of a number and numbers a pixel."""


def kind_of(schema: str, encoding: str) -> str | None:
    """Return the member of KINDS of a schema's name and its messages' encoding; None for other messages."""
    name = schema.replace("/msg/", "/")
    fits = {"foxglove": "protobuf", "sensor_msgs": "cdr"}.get(name.replace(".", "/").split("/")[0])
    return name if name in KINDS and fits == encoding else None


def decoder(kind: str, place: str) -> Decoder:
    """Return the decoder of messages of a kind. InputError, with the place, where rosbags is needed and missing."""
    if kind.startswith("foxglove"):
        return (RawImage if kind == KINDS[0] else CompressedImage).FromString
    check_rosbags(place)
    store, name = _ros_types(), kind.replace("/", "/msg/")
    return lambda data: store.deserialize_cdr(bytes(data), name)


def check_rosbags(place: str) -> None:
    """Raise InputError where the package rosbags, an extra, is not installed."""
    if importlib.util.find_spec("rosbags") is None:
        raise InputError(f"{place}: needs rosbags: pip install 'irtrack[ros2]'")


@lru_cache
def _ros_types() -> Any:
    """Return the message types of ROS 2; definitions in a bag, which may come from a stranger, are not read."""
    typesys: Any = importlib.import_module("rosbags.typesys")  # an extra
    return typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def time_of(message: Any) -> int:
    """Return the time stamp of an image message, ns; 0 where it has none."""
    stamp = message.header.stamp if hasattr(message, "header") else message.timestamp
    if hasattr(stamp, "nanosec"):
        return int(stamp.sec) * 10**9 + int(stamp.nanosec)
    return int(stamp.seconds) * 10**9 + int(stamp.nanos)


def picture_of(message: Any, place: str, time: float | None) -> Picture:
    """Return the image of a message as a grey picture. InputError, with the place, where it cannot be read."""
    if hasattr(message, "encoding"):
        return as_grey(_raw(message, place), place, time=time)
    form = message.format.lower()
    if "compresseddepth" in form:
        raise InputError(f"{place}: is a depth image ({message.format}); allowed: png, jpeg")
    kind = "PNG" if "png" in form else "JPEG"
    image = decoded(bytes(message.data), place, kind)
    return as_grey(image, place, CODEC_ROUNDING if kind == "JPEG" else 0, time)


def _raw(message: Any, place: str) -> Any:
    """Return the pixels of an uncompressed image: (rows, columns), or (rows, columns, 3 or 4) in the order BGR."""
    encoding, columns, rows = message.encoding, int(message.width), int(message.height)
    if encoding not in _CHANNELS:
        raise InputError(f"{place}: has the encoding {encoding!r}; allowed: {', '.join(_CHANNELS)}")
    number, channels = _CHANNELS[encoding]
    dtype = np.dtype(number).newbyteorder(">" if getattr(message, "is_bigendian", 0) else "<")
    data, step, used = np.frombuffer(message.data, np.uint8), int(message.step), columns * channels * dtype.itemsize
    if min(columns, rows) < 1 or step < used or len(data) < (rows - 1) * step + used:
        raise InputError(f"{place}: has {len(data)} bytes for {columns}x{rows} {encoding} in rows of {step} bytes")
    lines = np.lib.stride_tricks.as_strided(data, (rows, used), (step, 1))  # the last row may lack its padding
    image = np.ascontiguousarray(lines).view(dtype).astype(dtype.newbyteorder("="), copy=False)
    if channels == 1:
        return image
    image = image.reshape(rows, columns, channels)
    return cv2.cvtColor(image[..., :3], cv2.COLOR_RGB2BGR) if encoding.startswith("rgb") else image
