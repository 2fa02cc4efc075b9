"""JSON protocol: a session with a program that tracks one target, or many; afterwards it waits for the next.

A request is a line of JSON and the frame's bytes after it, row by row, two little-endian bytes a pixel
where bits is above 8:

    {"do": "init" or "step", "frame": 7, "time": 0.28, "rows": 240, "columns": 320, "bits": 8,
     "box": [x, y, w, h], "seed": 5 (these two of init only)}

The answer is a line of JSON, with boxes as in label files (top-left pixel, width, height):

    {"box": [x, y, w, h], "status": "tracking", "occluded" or "lost", "score": a number or null}
    {"error": "what went wrong"}

A program of many targets gets no image and no box, but the frame's detections, each with its score, and answers with
its confirmed tracks; the tracks in its answer to `init` are not used. Score and status may be left out:

    {"do": "init" or "step", "frame": 7, "time": 0.28, "rows": 240, "columns": 320,
     "detections": [[x, y, w, h, score], ...], "seed": 5 (of init only)}
    {"tracks": [[id, x, y, w, h, a number or null, "tracking" or "occluded"], ...]}

The program ends at the end of its standard input. Its other output goes to standard error.
"""

from __future__ import annotations

import json
import math
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, get_args

import numpy as np

from irsim.types import Box, Frame
from irtrack.errors import TrackerError
from irtrack.external.process import Child, Piece, quoted
from irtrack.tracks import TrackFrame
from irtrack.types import Detections, Status

STATUSES: tuple[Status, ...] = get_args(Status)

_idle: dict[tuple[str, ...], list[Child]] = {}
"""Idle programs by command, kept for the next session since starting a program takes a second."""


@dataclass(frozen=True)
class Answer:
    """Answer of a program to one frame."""

    box: Box
    status: Status
    score: float | None


class _Session:
    """Session with a program; when it is deleted, the program is kept for another session."""

    def __init__(self, name: str, command: Sequence[str], timeout_s: float) -> None:
        self.name = name
        self._timeout_s = timeout_s
        key = tuple(command)
        idle = _idle.setdefault(key, [])
        while idle and not idle[-1].alive:
            idle.pop()
        self._child = idle.pop() if idle else Child(command)
        weakref.finalize(self, _release, key, self._child)

    def _ask(self, frame: Frame, request: dict[str, Any], pixels: Sequence[Piece] = ()) -> dict[str, Any]:
        """Return the answer to a request about a frame.

        TrackerError as in `Child.ask` or where the program answers with an error.
        """
        rows, columns = frame.image.shape
        request |= {"frame": frame.index, "time": frame.time, "rows": rows, "columns": columns}
        answer = self._read(self._child.ask([json.dumps(request).encode() + b"\n", *pixels], self._timeout_s))
        if "error" in answer:
            raise TrackerError(str(answer["error"]))
        return answer

    def _placed(self, error: TrackerError, frame: Frame) -> TrackerError:
        return TrackerError(f"{self.name}: frame {frame.index}: {error}")

    def _read(self, line: bytes) -> dict[str, Any]:
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise self._child.refuse(f"its program answered {quoted(line)}; allowed: a line with a JSON object")
        return answer


class Session(_Session):
    """Session with a program that tracks one target."""

    def init(self, frame: Frame, box: Box, seed: int) -> Answer:
        """Track the content of the box from this frame on. TrackerError as in `Child.ask` or for an error in the
        answer."""
        return self._boxed(frame, {"do": "init", "box": list(box.pixels), "seed": seed})

    def step(self, frame: Frame) -> Answer:
        """Return the answer for the next frame. TrackerError as in `init`."""
        return self._boxed(frame, {"do": "step"})

    def _boxed(self, frame: Frame, request: dict[str, Any]) -> Answer:
        dtype = "<u2" if frame.bits > 8 else "u1"
        try:
            image = frame.image.astype(dtype, copy=False)
            return _answer(self._ask(frame, request | {"bits": frame.bits}, [image]))
        except TrackerError as error:
            raise self._placed(error, frame) from None


class DetectionSession(_Session):
    """Session with a program that tracks many targets on detections."""

    def init(self, frame: Frame, found: Detections, seed: int) -> None:
        """Track from these detections on. TrackerError as in `Child.ask` or where the program answers with an error."""
        self._tracked(frame, found, {"do": "init", "seed": seed})

    def step(self, frame: Frame, found: Detections) -> TrackFrame:
        """Return the tracks after the detections of the next frame. TrackerError as in `init`."""
        return self._tracked(frame, found, {"do": "step"})

    def _tracked(self, frame: Frame, found: Detections, request: dict[str, Any]) -> TrackFrame:
        corners = found.centers - (found.sizes - 1) / 2
        rows = np.concatenate([corners, found.sizes, found.scores[:, None]], axis=1)
        try:
            return _tracks(self._ask(frame, request | {"detections": rows.tolist()}))
        except TrackerError as error:
            raise self._placed(error, frame) from None


def _tracks(answer: dict[str, Any]) -> TrackFrame:
    """Return the tracks of an answer; `irtrack.tracks.fault_of_tracks` judges their values."""
    numbers: list[int] = []
    table: list[list[float]] = []
    statuses: list[Status] = []
    try:
        for id, x, y, w, h, *rest in answer["tracks"]:
            score, status = (*rest, None, "tracking")[:2] if len(rest) != 1 else (*rest, "tracking")
            if isinstance(id, bool) or int(id) != id or status not in STATUSES or len(rest) > 2:
                raise ValueError
            numbers.append(int(id))
            table.append([float(x), float(y), float(w), float(h), math.nan if score is None else float(score)])
            statuses.append(status)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise TrackerError(
            f"its program answered {quoted(json.dumps(answer).encode())}; "
            f'allowed: {{"tracks": [[id, x, y, w, h, score, status], ...]}}, the status of {", ".join(STATUSES)}'
        ) from None
    values = np.array(table, dtype=np.float64).reshape(-1, 5)
    sizes = values[:, 2:4]
    centers = values[:, :2] + (sizes - 1) / 2
    confirmed = np.ones(len(numbers), bool)
    return TrackFrame(np.array(numbers, np.int64), centers, sizes, values[:, 4], tuple(statuses), confirmed)


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
