"""Lossless images of archived recordings: JPEG XL (ISO/IEC 18181) in foxglove.CompressedImage, by imagecodecs.

Of JPEG-LS, JPEG 2000, JPEG XL, PNG and Zstandard with bytes sorted, JPEG XL at effort 3 is the smallest on 14-bit
frames of `sky`, `ground` and `stress/noise`: 2.9, 6.3 and 6.0 bits a pixel, where the entropy of Gaussian noise as
strong as theirs, log2(sigma sqrt(2 pi e)), is 2.1, 4.7 and 5.1. Zstandard alone takes 6.2, 10.5 and 9.2.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from irsim.errors import InputError
from irsim.types import Image

EFFORT = 3
"""Effort of the encoder, 1 to 9: a higher one takes ten times as long and saves a hundredth at most."""

_FORMAT = re.compile(r"jxl; ([0-9]{1,5})x([0-9]{1,5}) mono(8|16)")
_LARGEST = 1 << 28
"""Largest number of pixels of an image, 16384 x 16384."""


def codec(place: str = "compression archive") -> Any:
    """Return the module imagecodecs, an extra. InputError, with the place, where it is not installed."""
    if importlib.util.find_spec("imagecodecs") is None:
        raise InputError(f"{place}: needs imagecodecs: pip install 'irtrack[archive]'")
    return importlib.import_module("imagecodecs")


def encode_archived(image: Image, time: Any, frame_id: str) -> bytes:
    """Return the bytes of a foxglove.CompressedImage with counts (rows, columns) of uint8 or uint16."""
    data = codec().jpegxl_encode(np.ascontiguousarray(image), lossless=True, effort=EFFORT, numthreads=1)
    form = f"jxl; {image.shape[1]}x{image.shape[0]} mono{8 * image.itemsize}"
    message = CompressedImage(timestamp=time, frame_id=frame_id, format=form, data=data)
    return bytes(message.SerializeToString())


def is_archived(message: CompressedImage) -> bool:
    """Return True for a message of `encode_archived`."""
    return _FORMAT.fullmatch(message.format) is not None


def decode_archived(message: CompressedImage, size: tuple[int, int] | None = None) -> Image:
    """Return the counts (rows, columns). ValueError or RuntimeError for other data, or for another size than given."""
    found = _FORMAT.fullmatch(message.format)
    columns, rows = (int(found[1]), int(found[2])) if found else (0, 0)
    if found is None or not 0 < columns * rows <= _LARGEST or size not in (None, (columns, rows)):
        raise ValueError(f"format {message.format!r}")
    image: Any = np.empty((rows, columns), np.uint8 if found[3] == "8" else np.uint16)
    codec("this recording").jpegxl_decode(message.data, out=image, numthreads=1)  # refuses data of another size
    image.setflags(write=False)
    found_image: Image = image
    return found_image
