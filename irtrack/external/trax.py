"""One target followed by a program that speaks TraX, versions 1 to 4, over its standard input and output."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.external import trax_text as text
from irtrack.external.child import Child, quoted
from irtrack.external.session import Answer

PICTURES = ("path", "buffer", "data", "memory")
"""How pictures can be handed over, the preferred one first: nearly every tracker of VOT reads files. 'data' is the
specification's word for what libtrax calls 'buffer'."""
CHANNELS = ("color", "ir")
"""Channels that the infrared picture can be given as; most trackers know no other than color."""
LAST_VERSION = 4


class TraxSession:
    """A program that follows one target from the first frame on. It is ended when nobody holds the session."""

    def __init__(self, name: str, command: Sequence[str], timeout_s: float) -> None:
        """Start it; InputError where that cannot be done."""
        self.name = name
        self._timeout_s = timeout_s
        self._child = Child(command, text.PREFIX, farewell=text.write("quit"), greets=True)
        weakref.finalize(self, self._child.close)
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._last = Box(0.0, 0.0, 1.0, 1.0)

    def init(self, frame: Frame, box: Box, seed: int) -> Answer:
        """Follow what is in the box from this frame on.

        TrackerError where the program dies, hangs, quits, asks for what there is none of, or says what is
        not TraX.
        """
        try:
            hello = self._told(self._child.hear(self._timeout_s), "hello").properties
            version = int(hello.get("trax.version", "1")) if hello.get("trax.version", "1").isdecimal() else 0
            if not 1 <= version <= LAST_VERSION:
                wrong = f"its program speaks TraX {hello['trax.version']!r}; allowed: versions 1 to {LAST_VERSION}"
                raise self._child.refuse(wrong)
            self._picture = self._chosen("pictures", hello.get("trax.image", ""), PICTURES, "path")
            region = self._chosen("regions", hello.get("trax.region", ""), text.REGIONS, "rectangle")
            channels = text.listed(hello.get("trax.channels", "")) or ["color"]
            for channel in channels:
                self._chosen("the channel", channel, CHANNELS, "color")
            self._copies = len(channels)
            self._last = box
            shape = (frame.image.shape[0], frame.image.shape[1])
            target, pictures = text.region(box, region, shape), self._pictures(frame)
            chance, when = {"irtrack.seed": seed}, {"irtrack.time": frame.time}
            if version < LAST_VERSION:
                return self._ask(text.write("initialize", [*pictures, target], {**chance, **when}), frame)
            messages = text.write("initialize", [target], chance) + text.write("frame", pictures, when)
            return self._ask(messages, frame)
        except TrackerError as error:
            raise self._placed(error, frame) from None

    def step(self, frame: Frame) -> Answer:
        """Where it is in the next frame. TrackerError as `init`."""
        try:
            return self._ask(text.write("frame", self._pictures(frame), {"irtrack.time": frame.time}), frame)
        except TrackerError as error:
            raise self._placed(error, frame) from None

    def _ask(self, request: bytes, frame: Frame) -> Answer:
        state = self._told(self._child.ask([request], self._timeout_s), "state")
        if len(state.arguments) != 1:
            raise self._child.refuse(f"its program answered a state of {len(state.arguments)} regions; allowed: one")
        box = text.box_of(state.arguments[0])
        self._last = box or self._last
        confidence = state.properties.get("confidence")
        try:
            score = None if confidence is None else float(confidence)
        except ValueError:
            raise TrackerError(f"its program says the confidence {confidence!r}; allowed: a number") from None
        return Answer(self._last, "tracking" if box else "lost", score)

    def _told(self, line: bytes, kind: str) -> text.Message:
        """The message of a line, which must be of a kind."""
        message = text.read(line)
        if message.kind == "quit":
            reason = " ".join(message.properties.get("trax.reason", "").split())
            raise self._child.refuse("its program quit" + (reason and f": {reason}"))
        if message.kind != kind:
            raise self._child.refuse(f"its program answered {quoted(line)}; allowed: @@TRAX:{kind}")
        return message

    def _chosen(self, what: str, offered: str, known: Sequence[str], default: str) -> str:
        """The first known word of those that the program offers."""
        words = text.listed(offered) or [default]
        for word in known:
            if word in words:
                return word
        raise self._child.refuse(f"its program wants {what} {', '.join(words)}; allowed: {', '.join(known)}")

    def _pictures(self, frame: Frame) -> list[str]:
        """The frame once for every channel, as the program wants it."""
        if self._picture == "memory":
            return [text.memory(frame.image)] * self._copies
        png = cv2.imencode(".png", np.ascontiguousarray(frame.image), [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
        if self._picture != "path":
            return [text.encoded(png)] * self._copies
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="irtrack-", ignore_cleanup_errors=True)
        for old in os.scandir(self._folder.name):
            os.unlink(old)
        path = Path(self._folder.name, f"{frame.index:08}.png")
        path.write_bytes(png)
        return [f"file://{path}"] * self._copies

    def _placed(self, error: TrackerError, frame: Frame) -> TrackerError:
        return TrackerError(f"{self.name}: frame {frame.index}: {error}")
