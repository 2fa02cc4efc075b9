"""Lost shares of trackers on real sequences: `python tests/validation/holds_on_real.py FOLDER [TRACKER...]`.

FOLDER    holds sequences NAME/frames.mp4 with NAME/gt.csv (frame,x,y,w,h,id,cls)
TRACKER   names with parameters as `irtrack bench` takes them; peers need `make peers`

Each labelled target is started at 10 places, every fifth frame of its labels, with its box displaced by up to 2 px on
each axis, alike for all trackers: with the labelled box ("padded") and with the half-maximum extent of what is in it
("tight"). A start without 20 further labels is left out. Lost by the rule of `irtrack.metrics.lost`. Rows are printed
as they come; the last lines are the shares by sequence, and their mean, each sequence weighing the same.
"""

from __future__ import annotations

import csv
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from irsim.rng import stream
from irsim.types import Box, Frame
from irtrack.bench.spec import parse_tracker_spec
from irtrack.features.extent import extent
from irtrack.metrics.lost import loss, off_frames

STARTS, APART, JITTER_PX, LEAST_LABELS = 10, 5, 2.0, 20
TRACKERS = ("imm_mf", "change_kalman", "template", "grey_pf", "cv_csrt")
Labels = dict[int, Box]


def frames_of(video: Path) -> list[Frame]:
    """Return the frames of a video, 8 bits."""
    film = cv2.VideoCapture(str(video))
    frames: list[Frame] = []
    while True:
        there, picture = film.read()
        if not there:
            film.release()
            return frames
        index = len(frames)
        grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
        frames.append(Frame(grey, index, index / 30, 8))


def labels_of(table: Path) -> dict[str, Labels]:
    """Return the boxes of each target by frame."""
    found: dict[str, Labels] = defaultdict(dict)
    with table.open() as lines:
        for row in csv.DictReader(lines):
            if row["x"]:
                x, y, w, h = (float(row[key]) for key in "xywh")
                found[row["id"]][int(row["frame"])] = Box(x + (w - 1) / 2, y + (h - 1) / 2, w, h)
    return dict(found)


def starts_of(labels: Labels, seed: int) -> Iterator[tuple[int, Box]]:
    """Yield frames and displaced boxes of the starts."""
    rng, order = stream(seed, "holds_on_real"), sorted(labels)
    for number in range(STARTS):
        dx, dy = rng.uniform(-JITTER_PX, JITTER_PX, 2)
        if number * APART + LEAST_LABELS < len(order):
            frame = order[number * APART]
            box = labels[frame]
            yield frame, Box(box.cx + dx, box.cy + dy, box.w, box.h)


def tight(frame: Frame, box: Box) -> Box:
    """Return the extent of what is in a box, with a pixel about it."""
    found = extent(frame.image.astype(np.float32), box)
    return Box(*found.center, found.size[0] + 2, found.size[1] + 2) if found.is_compact else box


def is_lost(name: str, frames: list[Frame], labels: Labels, start: int, box: Box) -> bool:
    """Return whether a tracker loses a target; one that fails counts as lost from there on."""
    tracker, off = parse_tracker_spec(name).tracker, []
    followed = [k for k in sorted(labels) if k > start]
    k = start
    try:
        state = tracker.init(frames[start], box, stream(0, name, "holds_on_real", start))
        for k in range(start + 1, followed[-1] + 1):
            state, estimate = tracker.step(state, frames[k], stream(0, name, "holds_on_real", k))
            if k in labels:
                truth = labels[k]
                error = np.array([np.hypot(estimate.center[0] - truth.cx, estimate.center[1] - truth.cy)])
                off.append(bool(off_frames(error, np.hypot([truth.w], [truth.h]), np.zeros(1))[0]))
    except Exception as error:  # a peer may raise anything
        print(f"{name} failed at frame {k}: {error}", file=sys.stderr)
        return True
    return loss(np.array(off), np.ones(len(off), bool)) is not None


def main(folder: str, *names: str) -> None:
    cv2.setNumThreads(1)
    names = names or TRACKERS
    lost: dict[tuple[str, str, str], list[bool]] = defaultdict(list)
    sequences = [path.parent for path in sorted(Path(folder).glob("*/frames.mp4")) if (path.parent / "gt.csv").exists()]
    if not sequences:
        raise SystemExit(f"{folder}: no sequence; allowed: a folder of NAME/frames.mp4 with NAME/gt.csv")
    for sequence in sequences:
        frames = frames_of(sequence / "frames.mp4")
        targets = sorted(labels_of(sequence / "gt.csv").items())
        starts = [
            (place, target, labels, *given)
            for number, (target, labels) in enumerate(targets)
            for place, given in enumerate(starts_of(labels, number))
        ]
        for _, target, labels, start, box in sorted(starts, key=lambda each: each[0]):
            for kind, given in (("padded", box), ("tight", tight(frames[start], box))):
                found = {name: is_lost(name, frames, labels, start, given) for name in names}
                for name, is_off in found.items():
                    lost[sequence.name, kind, name].append(is_off)
                print(sequence.name, target, start, kind, "lost:", *(name for name in names if found[name]), flush=True)
    for kind in ("padded", "tight"):
        for name in names:
            shares = [np.mean(lost[sequence.name, kind, name]) for sequence in sequences]
            words = (f"{sequence.name} {share:.1%}" for sequence, share in zip(sequences, shares, strict=True))
            print(f"{kind} {name}:", *words, f"mean {np.mean(shares):.1%}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    main(*sys.argv[1:])
