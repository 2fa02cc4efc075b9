"""A frame's counts as foxglove.RawImage and back."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.recording.annotate import stamp
from irsim.types import Image

OPTICAL_FRAME = "camera"
"""The frame of reference that images and calibration share."""

_DATA = bytes([RawImage.DESCRIPTOR.fields_by_name["data"].number << 3 | 2])
"""What stands before a field's length: its number, and that it has one (protobuf.dev, Encoding)."""

_DTYPES = {"mono16": "<u2", "mono8": "u1"}


def encode_image(image: Image, log_time: int) -> tuple[bytes, ...]:
    """The bytes of a foxglove.RawImage, in parts: mono16 (little-endian) or mono8, as the image's type is.

    protobuf would copy the counts twice more.
    """
    encoding = "mono16" if image.dtype == np.uint16 else "mono8"
    before = RawImage(
        timestamp=stamp(log_time),
        width=image.shape[1],
        height=image.shape[0],
        encoding=encoding,
        step=image.shape[1] * image.itemsize,
    )
    counts = image.astype(_DTYPES[encoding], copy=False).tobytes()
    after = RawImage(frame_id=OPTICAL_FRAME)
    return before.SerializeToString(), _DATA + _varint(len(counts)), counts, after.SerializeToString()


def _varint(number: int) -> bytes:
    """A whole number from 0 on in groups of seven bits, lowest first (protobuf.dev, Encoding)."""
    groups = bytearray()
    while number > 0x7F:
        groups.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(groups) + bytes([number])


def decode_image(data: memoryview, size: tuple[int, int]) -> Image:
    """The read-only (rows, columns) counts of a foxglove.RawImage; ValueError or protobuf's DecodeError
    where they are not those of a picture of `size` (columns, rows)."""
    message = RawImage.FromString(data)  # type: ignore[arg-type]
    if message.encoding not in _DTYPES:
        raise ValueError(f"encoding {message.encoding!r}")
    dtype = np.dtype(_DTYPES[message.encoding])
    columns, rows = size
    if (message.width, message.height, message.step) != (columns, rows, columns * dtype.itemsize):
        raise ValueError(f"{message.width}x{message.height}, {message.step} bytes a row")
    return np.frombuffer(message.data, dtype).reshape(rows, columns)
