"""Files that were meant as UTF-8 text and are none: UTF-16, or text with a zero byte in it."""

from __future__ import annotations

import codecs
from pathlib import Path

_LOOKED = 8192
"""Bytes at the beginning of a file that are looked at."""
_ODD = 0.1
"""What has a larger share of control characters is no text that somebody wrote."""


def is_utf16(raw: bytes) -> bool:
    """Whether bytes are text in UTF-16: by their byte order mark, or as every second byte of plain letters is zero."""
    head = raw[:_LOOKED]
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return _is_written(head, "utf-16")
    if head[1::2].count(0) > len(head) / 4:
        return _is_written(head, "utf-16-le")
    return head[::2].count(0) > len(head) / 4 and _is_written(head, "utf-16-be")


def is_meant_as_text(path: Path) -> bool:
    """Whether a file that holds zero bytes is for all that a text that somebody wrote; not where it cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(_LOOKED)
    except OSError:
        return False
    return is_utf16(head) or _is_written(head, "utf-8")


def _is_written(head: bytes, encoding: str) -> bool:
    """Whether the beginning of a file, which may end within a character, holds hardly anything but letters."""
    try:
        text = codecs.getincrementaldecoder(encoding)().decode(head)
    except UnicodeDecodeError:
        return False
    return sum(letter < " " and letter not in "\t\r\n" for letter in text) <= max(1, _ODD * len(text))
