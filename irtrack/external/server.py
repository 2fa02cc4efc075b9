"""Program that runs the peers, the trackers of OpenCV and dlib, behind the JSON protocol.

It runs in an environment of its own (`make peers`) and imports nothing of irtrack: most peers exist only in OpenCV's
contrib wheel, which cannot be installed beside the plain wheel of irtrack. The protocol is that of
`irtrack.external.json_protocol`. Run as `python server.py NAME`, or without a name to list this environment's peers.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
from collections.abc import Callable
from typing import Any, BinaryIO

PEERS = ("cv_mil", "cv_kcf", "cv_csrt", "cv_mosse", "dlib")

Box = tuple[float, float, float, float]
Follow = Callable[[Any], tuple[Box, bool, float | None]]
"""Function from an image (rows, cols) uint8 to (box, True where the peer reports the target, score)."""
Start = Callable[[Any, Box, int], Follow]
"""Function from the first image, the box in it and a seed to the `Follow` function for the next images."""


def serve(start: Start, requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until the input ends; an exception of the peer is answered as an error."""
    import numpy as np

    follow: Follow | None = None
    while line := requests.readline():
        request = json.loads(line)
        rows, columns, bits = request["rows"], request["columns"], request["bits"]
        wide = bits > 8
        image = np.frombuffer(requests.read(rows * columns * (1 + wide)), "<u2" if wide else "u1")
        # Peers take images of 8 bits only.
        picture = (image >> (bits - 8) if wide else image).astype(np.uint8).reshape(rows, columns)
        try:
            if request["do"] == "init":
                follow = start(picture, tuple(request["box"]), request["seed"])
                answer: dict[str, Any] = {"box": request["box"], "status": "tracking", "score": None}
            else:
                assert follow is not None, "a step before any init"
                box, has, score = follow(picture)
                answer = {"box": box, "status": "tracking" if has else "lost", "score": score}
        except Exception as error:  # the parent reports any error of a peer
            answer = {"error": " ".join(f"{type(error).__name__}: {error}".split())}
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()


def opencv(make: Callable[[], Any], whole: bool) -> Start:
    """Return the start function of a tracker of OpenCV; `whole`: the tracker takes boxes of whole px only."""
    import cv2

    cv2.setNumThreads(1)

    def start(picture: Any, box: Box, seed: int) -> Follow:
        cv2.setRNGSeed(seed)  # MIL takes no generator; no other tracker runs in this process
        tracker = make()
        given = tuple(round(side) for side in box) if whole else box
        if tracker.init(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), given) is False:
            raise ValueError(f"it refuses the box {given}")
        last: Box = box

        def follow(picture: Any) -> tuple[Box, bool, float | None]:
            nonlocal last
            has, found = tracker.update(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
            if has:
                x, y, w, h = (float(side) for side in found)
                last = (x, y, w, h)
            return last, bool(has), None

        return follow

    return start


def correlation(library: Any) -> Start:
    """Return the start function of dlib's tracker; its score is its correlation peak, and it never reports a loss."""

    def start(picture: Any, box: Box, seed: int) -> Follow:
        tracker = library.correlation_tracker()
        x, y, w, h = box
        tracker.start_track(picture, library.drectangle(x, y, x + w - 1, y + h - 1))

        def follow(picture: Any) -> tuple[Box, bool, float | None]:
            score = float(tracker.update(picture))
            found = tracker.get_position()
            sides = found.left(), found.top(), found.right() - found.left() + 1, found.bottom() - found.top() + 1
            return sides, True, score

        return follow

    return start


def starter(name: str) -> Start:
    """Return the start function of a peer; raise an exception where this environment lacks the peer."""
    if name == "dlib":
        return correlation(importlib.import_module("dlib"))
    cv2 = importlib.import_module("cv2")
    if name == "cv_mosse":
        return opencv(cv2.legacy.TrackerMOSSE_create, whole=False)
    return opencv(getattr(cv2, f"Tracker{name.removeprefix('cv_').upper()}_create"), whole=True)


def has(name: str) -> bool:
    try:
        starter(name)
    except Exception:  # a library may fail in any way while it is imported
        return False
    return True


def main(names: list[str]) -> None:
    # Libraries print to standard output, so answers go to a copy of it made before it is redirected.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    if names:
        serve(starter(names[0]), sys.stdin.buffer, answers)
    else:
        answers.write(json.dumps([name for name in PEERS if has(name)]).encode() + b"\n")
        answers.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
