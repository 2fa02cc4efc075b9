"""JSON protocol: a session with a program that tracks one target; after the session the program waits for the next.

A request is a line of JSON and the frame's bytes after it, row by row, two little-endian bytes a pixel
where bits is above 8:

    {"do": "init" or "step", "frame": 7, "time": 0.28, "rows": 240, "columns": 320, "bits": 8,
     "box": [x, y, w, h], "seed": 5 (these two of init only)}

The answer is a line of JSON, with boxes as in label files (top-left pixel, width, height):

    {"box": [x, y, w, h], "status": "tracking", "occluded" or "lost", "score": a number or null}
    {"error": "what went wrong"}

The program ends at the end of its standard input. Its other output goes to standard error.
"""

from __future__ import annotations

import json
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, get_args

from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.external.process import Child, Piece, quoted
from irtrack.types import Status

STATUSES: tuple[Status, ...] = get_args(Status)

_idle: dict[tuple[str, ...], list[Child]] = {}
"""Idle programs by command, kept for the next session since starting a program takes a second."""


@dataclass(frozen=True)
class Answer:
    """Answer of a program to one frame."""

    box: Box
    status: Status
    score: float | None


class Session:
    """Session with a program that tracks one target; when it is deleted, the program is kept for another session."""

    def __init__(self, name: str, command: Sequence[str], timeout_s: float) -> None:
        self.name = name
        self._timeout_s = timeout_s
        key = tuple(command)
        idle = _idle.setdefault(key, [])
        while idle and not idle[-1].alive:
            idle.pop()
        self._child = idle.pop() if idle else Child(command)
        weakref.finalize(self, _release, key, self._child)

    def init(self, frame: Frame, box: Box, seed: int) -> Answer:
        """Track the content of the box from this frame on. TrackerError as in `Child.ask` or for an answered error."""
        return self._ask(frame, {"do": "init", "box": list(box.pixels), "seed": seed})

    def step(self, frame: Frame) -> Answer:
        """Return the answer for the next frame. TrackerError as in `init`."""
        return self._ask(frame, {"do": "step"})

    def _ask(self, frame: Frame, request: dict[str, Any]) -> Answer:
        rows, columns = frame.image.shape
        request |= {"frame": frame.index, "time": frame.time, "rows": rows, "columns": columns, "bits": frame.bits}
        dtype = "<u2" if frame.bits > 8 else "u1"
        try:
            pieces: list[Piece] = [json.dumps(request).encode() + b"\n", frame.image.astype(dtype, copy=False)]
            answer = self._read(self._child.ask(pieces, self._timeout_s))
            if "error" in answer:
                raise TrackerError(str(answer["error"]))
            return _answer(answer)
        except TrackerError as error:
            raise TrackerError(f"{self.name}: frame {frame.index}: {error}") from None

    def _read(self, line: bytes) -> dict[str, Any]:
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise self._child.refuse(f"its program answered {quoted(line)}; allowed: a line with a JSON object")
        return answer


def _answer(answer: dict[str, Any]) -> Answer:
    try:
        x, y, w, h = (float(side) for side in answer["box"])
        score = None if answer.get("score") is None else float(answer["score"])
    except (KeyError, TypeError, ValueError):
        raise TrackerError(
            f'its program answered {answer}; allowed: {{"box": [x, y, w, h], "status": ..., "score": ...}}'
        ) from None
    if not all(map(isfinite, (x, y, w, h))) or min(w, h) <= 0:
        raise TrackerError(f"its program answered the box {answer['box']}; allowed: finite numbers, a size above 0")
    status = answer.get("status", "tracking")
    if status not in STATUSES:
        raise TrackerError(f"its program says {status!r}; allowed: {', '.join(STATUSES)}")
    return Answer(Box.from_pixels(x, y, w, h), status, score)


def _release(key: tuple[str, ...], child: Child) -> None:
    if child.alive:
        _idle.setdefault(key, []).append(child)
