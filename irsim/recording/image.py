"""A frame's counts as foxglove.RawImage and back."""

from __future__ import annotations

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from irsim.recording.annotate import stamp
from irsim.types import Image

OPTICAL_FRAME = "camera"
"""The frame of reference that images and calibration share."""

_DTYPES = {"mono16": "<u2", "mono8": "u1"}


def encode_image(image: Image, log_time: int) -> bytes:
    """The bytes of a foxglove.RawImage: mono16 (little-endian) or mono8, as the image's type is."""
    encoding = "mono16" if image.dtype == np.uint16 else "mono8"
    return RawImage(
        timestamp=stamp(log_time),
        frame_id=OPTICAL_FRAME,
        width=image.shape[1],
        height=image.shape[0],
        encoding=encoding,
        step=image.shape[1] * image.itemsize,
        data=image.astype(_DTYPES[encoding], copy=False).tobytes(),
    ).SerializeToString()


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
