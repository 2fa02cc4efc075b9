"""A program that speaks the peers' protocol and nothing of irtrack, and misbehaves as its first word says."""

from __future__ import annotations

import json
import os
import sys
import time
from typing import Any


def main(mode: str, at: int) -> None:
    left_out, w, h = sys.stdin.buffer, 0.0, 0.0
    while line := left_out.readline():
        request = json.loads(line)
        rows, columns, size = request["rows"], request["columns"], 1 + (request["bits"] > 8)
        pixels = left_out.read(rows * columns * size)
        answer: dict[str, Any] = {}
        if request["do"] == "init":
            _, _, w, h = request["box"]
            answer = {"box": request["box"], "status": "tracking", "score": request["seed"] % 7}
        else:
            values = [int.from_bytes(pixels[k : k + size], "little") for k in range(0, len(pixels), size)]
            row, column = divmod(values.index(max(values)), columns)
            answer = {"box": [column - (w - 1) / 2, row - (h - 1) / 2, w, h], "score": os.getpid()}
        if request["do"] == "step" and request["frame"] >= at:
            if mode == "lost":
                answer["status"] = "lost"
            elif mode == "raise":
                answer = {"error": "ValueError: the box left the picture"}
            elif mode == "die":
                print("out of luck", file=sys.stderr, flush=True)
                os._exit(3)
            elif mode == "hang":
                time.sleep(600)
            elif mode == "garble":
                print("hello", flush=True)
                continue
            elif mode == "status":
                answer["status"] = "dreaming"
            elif mode == "nan":
                answer["box"] = [float("nan"), 0, 1, 1]
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
