"""TraX, the exchange protocol of the VOT challenges: messages, regions, images, and a session with a program.

Source: Cehovin Zajc, "TraX: The visual tracking exchange protocol and library", Neurocomputing 260 (2017)
5-8, and the specification of the reference implementation (github.com/votchallenge/trax, docs/protocol.rst).
Where libtrax 4.0.2 differs from the specification, both forms are read and that of libtrax is written: ';' between
the items of a list, 'data:image/png;' before an encoded image.
"""

from __future__ import annotations

import base64
import os
import re
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import ceil
from pathlib import Path

import cv2
import numpy as np

from irsim.types import Box, Frame, Image
from irtrack.errors import TrackerError
from irtrack.external.json_protocol import Answer
from irtrack.external.process import Child, quoted

PREFIX = b"@@TRAX:"
REGIONS = ("rectangle", "polygon", "mask")
"""Kinds of regions in which a target can be sent, the preferred one first."""

PICTURES = ("path", "buffer", "data", "memory")
"""Forms in which images can be sent, the preferred one first: nearly every tracker of VOT reads files. 'data' is the
specification's word for the 'buffer' of libtrax."""
CHANNELS = ("color", "ir")
"""Names of channels under which the infrared image is sent; most trackers take only `color`."""
LAST_VERSION = 4

_TOKEN = re.compile(r'\s*(?:"((?:[^"\\]|\\.)*)"|([^\s"]+))')
_PROPERTY = re.compile(r"([\w.]{1,64})=(.*)", re.S | re.A)
_ESCAPED = re.compile(r"\\(.)")


@dataclass(frozen=True, slots=True)
class Message:
    """TraX message: `kind` (hello, state, ...), `arguments` in order, and `properties`, the KEY=VALUE after them."""

    kind: str
    arguments: tuple[str, ...]
    properties: dict[str, str]


def write(kind: str, arguments: Sequence[str] = (), properties: Mapping[str, object] | None = None) -> bytes:
    """Return a message as a line of bytes."""
    words = [*arguments, *(f"{key}={value}" for key, value in (properties or {}).items())]
    escaped = (word.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") for word in words)
    return PREFIX + " ".join([kind, *(f'"{word}"' for word in escaped)]).encode() + b"\n"


def read(line: bytes) -> Message:
    """Return the message in a line that begins with `PREFIX`; TrackerError where the line holds no message."""
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
    """Return the items of a list such as 'path;memory;'."""
    return [word for word in re.split("[;,]", text) if word]


def region(box: Box, kind: str, shape: tuple[int, int]) -> str:
    """Return a box as a region of a kind in `REGIONS`; a mask is cut to `shape`, the (rows, columns) of the frame."""
    x, y, w, h = box.pixels
    if kind == "mask":
        left, top = max(round(x), 0), max(round(y), 0)
        columns = max(min(ceil(x + w), shape[1]) - left, 1)
        rows = max(min(ceil(y + h), shape[0]) - top, 1)
        return f"mask:{left},{top},{columns},{rows},0,{columns * rows}"
    sides = (x, y, w, h) if kind == "rectangle" else (x, y, x + w, y, x + w, y + h, x, y + h)
    return ",".join(f"{side:.4f}" for side in sides)


def box_of(text: str) -> Box | None:
    """Return the box of a region, or the box around a polygon or mask.

    None for an empty mask and for a special region (a code in place of coordinates), by which the tracker reports no
    target. TrackerError for anything else.
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
    """Return an image in the form 'memory', its pixel values without compression."""
    depth = "gray16" if image.dtype == np.uint16 else "gray8"
    plain = image.astype(image.dtype.newbyteorder("<"), copy=False).tobytes()
    return f"image:{image.shape[1]};{image.shape[0]};{depth};{base64.b64encode(plain).decode()}"


def _around_mask(numbers: list[int]) -> Box | None:
    """Return the box around the ones of a mask: x, y, w, h, then runs of zeros and ones by turns, row by row."""
    x, y, w, h, *runs = numbers
    if min(w, h, *runs, 0) < 0 or sum(runs) > w * h:
        raise ValueError
    ends = list(accumulate(runs))
    ones = [(start, stop - 1) for start, stop in zip(ends[::2], ends[1::2], strict=False) if stop > start]
    if not ones:
        return None
    rows, columns = np.divmod(np.array(ones), w)
    left, right = columns[:, 0].min(), columns[:, 1].max()
    if (rows[:, 0] != rows[:, 1]).any():  # a run that continues in the next row touches both sides of the frame
        left, right = 0, w - 1
    top, bottom = rows[0, 0], rows[-1, 1]
    return Box.from_pixels(x + int(left), y + int(top), int(right - left) + 1, int(bottom - top) + 1)


class TraxSession:
    """Session with a program that tracks one target. The program ends when the session is deleted."""

    def __init__(self, name: str, command: Sequence[str], timeout_s: float) -> None:
        """Start the program; InputError where it cannot be started."""
        self.name = name
        self._timeout_s = timeout_s
        self._child = Child(command, PREFIX, farewell=write("quit"), greets=True)
        weakref.finalize(self, self._child.close)
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._last = Box(0.0, 0.0, 1.0, 1.0)

    def init(self, frame: Frame, box: Box, seed: int) -> Answer:
        """Track the content of the box from this frame on; return the first answer.

        TrackerError where the program dies, hangs, quits, wants a form of region or image that irtrack does not offer,
        or does not speak TraX.
        """
        try:
            hello = self._message(self._child.greeting(self._timeout_s), "hello").properties
            version = int(hello.get("trax.version", "1")) if hello.get("trax.version", "1").isdecimal() else 0
            if not 1 <= version <= LAST_VERSION:
                wrong = f"its program speaks TraX {hello['trax.version']!r}; allowed: versions 1 to {LAST_VERSION}"
                raise self._child.refuse(wrong)
            self._picture = self._chosen("pictures", hello.get("trax.image", ""), PICTURES, "path")
            kind = self._chosen("regions", hello.get("trax.region", ""), REGIONS, "rectangle")
            channels = listed(hello.get("trax.channels", "")) or ["color"]
            for channel in channels:
                self._chosen("the channel", channel, CHANNELS, "color")
            self._copies = len(channels)
            self._last = box
            shape = (frame.image.shape[0], frame.image.shape[1])
            target, pictures = region(box, kind, shape), self._pictures(frame)
            chance, when = {"irtrack.seed": seed}, {"irtrack.time": frame.time}
            if version < LAST_VERSION:
                return self._ask(write("initialize", [*pictures, target], {**chance, **when}), frame)
            messages = write("initialize", [target], chance) + write("frame", pictures, when)
            return self._ask(messages, frame)
        except TrackerError as error:
            raise self._placed(error, frame) from None

    def step(self, frame: Frame) -> Answer:
        """Return the answer for the next frame. TrackerError as in `init`."""
        try:
            return self._ask(write("frame", self._pictures(frame), {"irtrack.time": frame.time}), frame)
        except TrackerError as error:
            raise self._placed(error, frame) from None

    def _ask(self, request: bytes, frame: Frame) -> Answer:
        state = self._message(self._child.ask([request], self._timeout_s), "state")
        if len(state.arguments) != 1:
            raise self._child.refuse(f"its program answered a state of {len(state.arguments)} regions; allowed: one")
        box = box_of(state.arguments[0])
        self._last = box or self._last
        confidence = state.properties.get("confidence")
        try:
            score = None if confidence is None else float(confidence)
        except ValueError:
            raise TrackerError(f"its program says the confidence {confidence!r}; allowed: a number") from None
        return Answer(self._last, "tracking" if box else "lost", score)

    def _message(self, line: bytes, kind: str) -> Message:
        """Return the message in a line; TrackerError where it is not of this `kind`."""
        message = read(line)
        if message.kind == "quit":
            reason = " ".join(message.properties.get("trax.reason", "").split())
            raise self._child.refuse("its program quit" + (reason and f": {reason}"))
        if message.kind != kind:
            raise self._child.refuse(f"its program answered {quoted(line)}; allowed: @@TRAX:{kind}")
        return message

    def _chosen(self, what: str, offered: str, known: Sequence[str], default: str) -> str:
        """Return the first of the `known` words that the program offers."""
        words = listed(offered) or [default]
        for word in known:
            if word in words:
                return word
        raise self._child.refuse(f"its program wants {what} {', '.join(words)}; allowed: {', '.join(known)}")

    def _pictures(self, frame: Frame) -> list[str]:
        """Return the frame once for every channel, in the form that the program wants."""
        if self._picture == "memory":
            return [memory(frame.image)] * self._copies
        png = cv2.imencode(".png", np.ascontiguousarray(frame.image), [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
        if self._picture != "path":
            return [f"data:image/png;{base64.b64encode(png).decode()}"] * self._copies
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="irtrack-", ignore_cleanup_errors=True)
        for old in os.scandir(self._folder.name):
            os.unlink(old)
        path = Path(self._folder.name, f"{frame.index:08}.png")
        path.write_bytes(png)
        return [f"file://{path}"] * self._copies

    def _placed(self, error: TrackerError, frame: Frame) -> TrackerError:
        return TrackerError(f"{self.name}: frame {frame.index}: {error}")
