"""The text of TraX, the exchange protocol of the VOT challenges: messages, regions and pictures.

Source: Cehovin Zajc, "TraX: The visual tracking exchange protocol and library", Neurocomputing 260 (2017)
5-8, and the specification of the reference implementation (github.com/votchallenge/trax, docs/protocol.rst).
Where libtrax 4.0.2 writes otherwise than the specification says, both are read and libtrax's is written:
lists are parted by ';', the header of an encoded picture is 'data:image/png;'.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import ceil

import numpy as np

from irsim.types import Box, Image
from irtrack.errors import TrackerError
from irtrack.external.child import quoted

PREFIX = b"@@TRAX:"
REGIONS = ("rectangle", "polygon", "mask")
"""Kinds of regions that a target can be given as, the preferred one first."""

_TOKEN = re.compile(r'\s*(?:"((?:[^"\\]|\\.)*)"|([^\s"]+))')
_PROPERTY = re.compile(r"([\w.]{1,64})=(.*)", re.S | re.A)
_ESCAPED = re.compile(r"\\(.)")


@dataclass(frozen=True, slots=True)
class Message:
    """kind: hello, state, quit, ...;  arguments in their order;  properties: what follows as KEY=VALUE."""

    kind: str
    arguments: tuple[str, ...]
    properties: dict[str, str]


def write(kind: str, arguments: Sequence[str] = (), properties: Mapping[str, object] | None = None) -> bytes:
    """A message as a line."""
    words = [*arguments, *(f"{key}={value}" for key, value in (properties or {}).items())]
    return PREFIX + " ".join([kind, *map(_quote, words)]).encode() + b"\n"


def read(line: bytes) -> Message:
    """The message of a line that begins with the prefix; TrackerError where it is none."""
    kind, _, rest = line.removeprefix(PREFIX).decode(errors="replace").strip().partition(" ")
    arguments: list[str] = []
    properties: dict[str, str] = {}
    at = 0
    while at < len(rest):
        token = _TOKEN.match(rest, at)
        if token is None:
            raise TrackerError(f"its program answered {quoted(line)}; allowed: a TraX message")
        at = token.end()
        word = token[2] if token[1] is None else _ESCAPED.sub(lambda each: {"n": "\n"}.get(each[1], each[1]), token[1])
        named = _PROPERTY.fullmatch(word)
        if named:
            properties[named[1]] = named[2]
        else:
            arguments.append(word)
    return Message(kind, tuple(arguments), properties)


def listed(text: str) -> list[str]:
    """The words of a list such as 'path;memory;'."""
    return [word for word in re.split("[;,]", text) if word]


def region(box: Box, kind: str, shape: tuple[int, int]) -> str:
    """A box as a region of a kind of REGIONS; as a mask it is cut to the (rows, columns) of the frame."""
    x, y, w, h = box.pixels
    if kind == "mask":
        left, top = max(round(x), 0), max(round(y), 0)
        columns = max(min(ceil(x + w), shape[1]) - left, 1)
        rows = max(min(ceil(y + h), shape[0]) - top, 1)
        return f"mask:{left},{top},{columns},{rows},0,{columns * rows}"
    sides = (x, y, w, h) if kind == "rectangle" else (x, y, x + w, y, x + w, y + h, x, y + h)
    return ",".join(f"{side:.4f}" for side in sides)


def box_of(text: str) -> Box | None:
    """The box of a region, of a polygon or mask the one around it.

    None for an empty mask and for a special region (a code instead of a place): the tracker says that it
    has no target. TrackerError for anything else.
    """
    fault = TrackerError(
        f"its program answered the region {text[:100]!r}; allowed: a rectangle X,Y,W,H, a polygon X,Y,X,Y,X,Y,..., "
        "or mask:X,Y,W,H,RUN,... with finite numbers and a size above 0"
    )
    try:
        if text.startswith("mask:"):
            return _around_mask([int(each) for each in text.removeprefix("mask:").split(",")])
        numbers = np.array([float(each) for each in text.split(",")])
    except (ValueError, OverflowError):
        raise fault from None
    if len(numbers) == 1 and numbers[0].is_integer():
        return None
    if not np.isfinite(numbers).all():
        raise fault
    if len(numbers) == 4:
        x, y, w, h = numbers.tolist()
    elif len(numbers) >= 6 and len(numbers) % 2 == 0:
        points = numbers.reshape(-1, 2)
        (x, y), (w, h) = points.min(axis=0).tolist(), np.ptp(points, axis=0).tolist()
    else:
        raise fault
    if min(w, h) <= 0:
        raise fault
    return Box.from_pixels(x, y, w, h)


def memory(image: Image) -> str:
    """A picture as its plain values."""
    depth = "gray16" if image.dtype == np.uint16 else "gray8"
    plain = image.astype(image.dtype.newbyteorder("<"), copy=False).tobytes()
    return f"image:{image.shape[1]};{image.shape[0]};{depth};{base64.b64encode(plain).decode()}"


def encoded(png: bytes) -> str:
    """A picture as the bytes of a PNG file."""
    return f"data:image/png;{base64.b64encode(png).decode()}"


def _around_mask(numbers: list[int]) -> Box | None:
    """The box around the ones of x, y, w, h and runs of zeros and ones by turns, row by row; ValueError where wrong."""
    x, y, w, h, *runs = numbers
    if min(w, h, *runs, 0) < 0 or sum(runs) > w * h:
        raise ValueError
    ends = list(accumulate(runs))
    ones = [(start, stop - 1) for start, stop in zip(ends[::2], ends[1::2], strict=False) if stop > start]
    if not ones:
        return None
    rows, columns = np.divmod(np.array(ones), w)
    left, right = columns[:, 0].min(), columns[:, 1].max()
    if (rows[:, 0] != rows[:, 1]).any():  # a run that goes on over the end of a row touches both sides
        left, right = 0, w - 1
    top, bottom = rows[0, 0], rows[-1, 1]
    return Box.from_pixels(x + int(left), y + int(top), int(right - left) + 1, int(bottom - top) + 1)


def _quote(word: str) -> str:
    escaped = word.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
