"""What broken bytes raise, turned into one error."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from google.protobuf.message import DecodeError
from mcap.exceptions import McapError

from irsim.errors import InputError

BROKEN = (
    McapError,
    DecodeError,
    struct.error,
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    OverflowError,
    MemoryError,
    RuntimeError,
)
"""What mcap, protobuf, lz4, zstandard and struct raise on bytes that are not what they should be."""


class DamageError(InputError):
    """A file's bytes are not what was written."""


@contextmanager
def decoded(path: Path, what: str, remedy: str = "") -> Iterator[None]:
    """Around the decoding of what stands in a file: anything that broken bytes raise is one DamageError.

    what     what is wrong then: 'its index cannot be read'
    remedy   what the user may do, or nothing
    """
    try:
        yield
    except BROKEN:
        raise damage(path, what, remedy) from None


def damage(path: Path, what: str, remedy: str = "") -> DamageError:
    """The error to raise where a check of our own fails."""
    return DamageError(f"{path}: damaged: {what}" + (f"; {remedy}" if remedy else ""))
