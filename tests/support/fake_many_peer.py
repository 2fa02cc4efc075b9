"""A program that speaks the protocol of many targets and nothing of irtrack, and misbehaves as its first word says."""

from __future__ import annotations

import json
import os
import sys
from typing import Any


def main(mode: str, at: int) -> None:
    """Answer with each detection as a track of its rank from left to right; the score is that of the seed."""
    seed = 0
    while line := sys.stdin.buffer.readline():
        request = json.loads(line)
        seed = request.get("seed", seed)
        boxes = sorted(box[:4] for box in request["detections"])
        answer: dict[str, Any] = {"tracks": [[rank, *box, seed % 7] for rank, box in enumerate(boxes)]}
        if request["do"] == "step" and request["frame"] >= at:
            if mode == "short":
                answer = {"tracks": [[rank, *box] for rank, box in enumerate(boxes)]}
            elif mode == "occluded":
                answer = {"tracks": [[rank, *box, None, "occluded"] for rank, box in enumerate(boxes)]}
            elif mode == "raise":
                answer = {"error": "ValueError: too many"}
            elif mode == "die":
                print("out of luck", file=sys.stderr, flush=True)
                os._exit(3)
            elif mode == "twice":
                answer = {"tracks": [[1, 5, 5, 3, 3], [1, 50, 50, 3, 3]]}
            elif mode == "nan":
                answer = {"tracks": [[1, float("nan"), 5, 3, 3]]}
            elif mode == "flat":
                answer = {"tracks": [[1, 5, 5, 0, 3]]}
            elif mode == "status":
                answer = {"tracks": [[1, 5, 5, 3, 3, 0.5, "dreaming"]]}
            elif mode == "half":
                answer = {"tracks": [[1.5, 5, 5, 3, 3]]}
            elif mode == "none":
                answer = {}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
