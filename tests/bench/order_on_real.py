"""Order of the detectors on rendered scenes beside their order on real sequences: Kendall's tau with an interval.

python tests/bench/order_on_real.py FOLDER [FRAMES]

FOLDER   searched for folders with frames.mp4 and gt.csv (frame,x,y,w,h,id,cls)
FRAMES   the first so many of each sequence and scene; by default 12

A detector's figure is its probability of detection, mean over .1, 1 and 10 false alarms a frame, then over sequences or
scenes. The interval is of a bootstrap over sequences and over scenes.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from scipy.stats import kendalltau

import irsim
from irsim.types import Source
from irtrack.detectors import DETECTORS, FilterDetector, make_detector
from irtrack.metrics.detection import DetectionFigures
from irtrack.replay.many import run_detector

SCENES = Path(__file__).parents[2] / "scenarios" / "examples"
NAMES = [name for name, kind in DETECTORS.items() if issubclass(kind, FilterDetector)]
RATES = (0.1, 1.0, 10.0)
RESAMPLES = 2000


def real(folder: Path, frames: int, scratch: Path) -> Iterator[Source]:
    """Yield the first frames of the sequences of a folder as recordings, written to `scratch`."""
    for number, video in enumerate(sorted(folder.rglob("frames.mp4"))):
        truth, place = video.with_name("gt.csv"), scratch / f"{number}-{video.parent.name}"
        if truth.exists():
            film = cv2.VideoCapture(str(video))
            pictures = [film.read()[1] for _ in range(frames)]
            film.release()
            np.save(place.with_suffix(".npy"), [cv2.cvtColor(each, cv2.COLOR_BGR2GRAY) for each in pictures])
            head, *lines = truth.read_text().splitlines()
            shown = [line for line in lines if int(line.partition(",")[0]) < frames]
            place.with_suffix(".csv").write_text("\n".join([head, *shown]) + "\n")
            pictures_file, boxes = place.with_suffix(".npy"), place.with_suffix(".csv")
            yield irsim.open_recording(irsim.import_frames(pictures_file, place.with_suffix(".mcap"), truth=boxes))


def rendered() -> Iterator[Source]:
    """Yield the example scenes that have targets."""
    for path in sorted(SCENES.glob("*.yaml")):
        scenario = irsim.load(path)
        if scenario.targets and not scenario.background.has_noise:
            yield irsim.open_source(scenario)


def figures(source: Source, frames: int) -> list[float]:
    """Return the figure of each detector on a source; nan without a target."""
    truths, found = list(source.truths(0, frames)), []
    for name in NAMES:
        detector = make_detector(name, {"threshold": 2.0, "most": 300})
        detections = run_detector(detector, source, frames=frames)
        scored = DetectionFigures.of(truths, detections, source.rate_hz)
        found.append(float(np.mean([scored.pd_at(rate) for rate in RATES])))
    print(f"{source.name:30}", *(f"{value:.2f}" for value in found), file=sys.stderr, flush=True)
    return found


def tau(one: np.ndarray, other: np.ndarray) -> float:
    """Return Kendall's tau of the mean figures (sequences, detectors) of two sets."""
    return float(kendalltau(one.mean(axis=0), other.mean(axis=0)).statistic)


def main(folder: str, frames: str = "12") -> None:
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as scratch:
        tables = [
            np.array([figures(source, int(frames)) for source in sources])
            for sources in (real(Path(folder), int(frames), Path(scratch)), rendered())
        ]
    own, drawn = (table[np.isfinite(table).all(axis=1)] for table in tables)
    if not len(own):
        raise SystemExit(f"{folder}: no sequence with a target; allowed: folders of frames.mp4 and gt.csv")
    rng = np.random.default_rng(0)
    again = [
        tau(own[rng.integers(len(own), size=len(own))], drawn[rng.integers(len(drawn), size=len(drawn))])
        for _ in range(RESAMPLES)
    ]
    low, high = np.quantile(again, [0.025, 0.975])
    for title, table in (("real", own), ("rendered", drawn)):
        mean = table.mean(axis=0)
        print(title, *(f"{NAMES[k]} {mean[k]:.3f}" for k in np.argsort(-mean)))
    print(f"tau {tau(own, drawn):.2f} ({low:.2f} to {high:.2f}), {len(own)} sequences, {len(drawn)} scenes")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        raise SystemExit(__doc__)
    main(*sys.argv[1:])
