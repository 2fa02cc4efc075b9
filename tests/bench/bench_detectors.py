"""The time of a detector's step on whole frames of a rendered sky, and of their ceiling: part of `make bench`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from time import process_time

import cv2

import irsim
from irtrack.detectors import DETECTORS, FilterDetector, make_detector

FRAMES, ROUNDS = 10, 20
SIZES = ((160, 120), (320, 240), (640, 512))
"""Columns and rows: the points of a curve of time against pixels."""


def detectors(sizes: tuple[tuple[int, int], ...] = SIZES) -> Iterator[tuple[str, float]]:
    """Yield (name, ms on one core) of each filter: the least of a few rounds over the frames."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    for columns, rows in sizes:
        scenario = irsim.load("sky", [f"frames={FRAMES}", f"camera.size=[{columns},{rows}]"])
        frames = list(irsim.open_source(scenario).frames("counts"))
        for name, kind in DETECTORS.items():
            if not issubclass(kind, FilterDetector):
                continue
            detector = make_detector(name)
            state, _ = detector.step(None, frames[0])
            least = math.inf
            for _ in range(ROUNDS):
                for frame in frames[1:]:
                    begin = process_time()
                    state, _ = detector.step(state, frame)
                    least = min(least, process_time() - begin)
            yield f"detector_{name}_{columns}x{rows}_step", 1e3 * least
    yield f"ideal_matched_filter_{columns}x{rows}_target", ceiling_ms(scenario)
    cv2.setNumThreads(threads)


def ceiling_ms(scenario: irsim.Scenario) -> float:
    """Return the time of d^2 of one target in a new frame, ms on one core: the least of the frames."""
    found, least = irsim.Detectability(scenario), math.inf
    for index in range(FRAMES):
        begin = process_time()
        found.d2(index, scenario.targets[0].id)
        least = min(least, process_time() - begin)
    return 1e3 * least


if __name__ == "__main__":
    for name, ms in detectors():
        print(f"{name}: {ms:.3g} ms", flush=True)
