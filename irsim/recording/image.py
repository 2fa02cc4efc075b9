"""A frame's counts as foxglove.RawImage and back."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.recording.annotate import stamp
from irsim.types import Image

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
