"""A TraX tracker without irtrack: it follows the brightest pixel, and misbehaves by its mode.

Run as `python fake_trax.py MODE AT [hello's KEY=VALUE...]`. Wants pictures from memory.
"""

from __future__ import annotations

import base64
import os
import re
import sys
import time
from pathlib import Path

ANSWERS = {
    "nan": '@@TRAX:state "nan,2,3,4"',
    "flat": '@@TRAX:state "1,2,0,4"',
    "words": '@@TRAX:state "somewhere left"',
    "several": '@@TRAX:state "1,2,3,4" "5,6,7,8"',
    "unclosed": '@@TRAX:state "1,2,3,4',
    "sure": '@@TRAX:state "1,2,3,4" "confidence=very"',
    "hello": "@@TRAX:hello",
    "quit": '@@TRAX:quit "trax.reason=no more\\nluck"',
    "special": '@@TRAX:state "0"',
    "twice": '@@TRAX:state "1,2,3,4"\n@@TRAX:state "1,2,3,4"',
}


def words(line: str) -> list[str]:
    return [quoted or plain for quoted, plain in re.findall(r'"([^"]*)"|(\S+)', line)]


def place(picture: str) -> tuple[int, int]:
    columns, _, depth, data = picture.removeprefix("image:").split(";")
    size = 2 if depth == "gray16" else 1
    plain = base64.b64decode(data)
    values = [int.from_bytes(plain[k : k + size], "little") for k in range(0, len(plain), size)]
    row, column = divmod(values.index(max(values)), int(columns))
    return column, row


def main(mode: str, at: int, hello: list[str]) -> None:
    version = next((int(each[13:]) for each in hello if each.startswith("trax.version=") and each[13:].isdigit()), 1)
    print(" ".join(["@@TRAX:hello", '"trax.image=memory;"', *(f'"{each}"' for each in hello)]), flush=True)
    w = h = 0.0
    frame, started = -1, False
    for line in sys.stdin:
        kind, *arguments = words(line.removeprefix("@@TRAX:"))
        arguments = [each for each in arguments if not each.startswith("irtrack.")]
        if kind == "quit":
            Path(os.environ.get("FAREWELL", os.devnull)).write_text("farewell")
            return
        if kind == "initialize":
            if version < 4:
                *pictures, region = arguments
            else:
                (region,) = arguments
            w, h = (float(each) for each in region.split(",")[2:])
            started = True
            if version == 4:
                continue
        else:
            pictures = arguments
        assert kind in ("initialize", "frame"), line
        assert started, line
        assert len(pictures) == 1, line
        frame += 1
        column, row = place(pictures[0])
        answer = f'@@TRAX:state "{column - (w - 1) / 2},{row - (h - 1) / 2},{w},{h}" "confidence={os.getpid()}"'
        if frame >= at:
            if mode == "hang":
                time.sleep(600)
            if mode == "flood":
                print("x" * 3_000_000, "@@TRAX:state 1,2,3,4", flush=True)
                print("y" * 3_000_000, file=sys.stderr, flush=True)
            if mode == "endless":
                while True:
                    print("still looking" * 99, flush=True)
            answer = ANSWERS.get(mode, answer)
        sys.stdout.write(f"{answer}\n")  # in one breath
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3:])
