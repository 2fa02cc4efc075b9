"""Labelled frames of shipped scenarios, from development seeds, in three sets: training, calibration, scores."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal, Protocol

import numpy as np

import irsim
from irsim.types import Box, Image, TargetTruth
from irtrack.types import LEAST_PX

Set = Literal["training", "calibration", "scores"]

SEEDS: dict[Set, list[int]] = {
    "training": [1000, 1001, 1002, 1003, 1004],
    "calibration": [1005, 1006],
    "scores": [1007, 1008],
}
"""Development seeds of each set; no seed of the papers' page or of the bench."""
FRAMES = 5
"""Frames of each scenario and seed, evenly spread."""
SCENARIOS = (
    *("sources/cheng-sky", "sources/cheng-sky-hard", "sources/cheng-ground", "sources/cui-cloud-mild"),
    *("sources/li-aircraft", "sources/li-pedestrian", "sources/li-pedestrian-hard"),
    *("sources/xue-ground", "sources/xue-sky-mild"),
    *("examples/birds", "examples/clouds", "examples/countryside", "examples/crossover", "examples/drones"),
    *("examples/ground", "examples/hiding", "examples/platform", "examples/sea", "examples/sky"),
    *("examples/swarm", "examples/traffic", "examples/treeline"),
    *("stress/hard-14x10", "stress/hard-6x6", "stress/hard-40x28", "many/birds"),
)
LEAST_VISIBLE = 0.9
"""Visible fraction of a target from which on it is an example."""
LEAST_CONTRAST = 6.0
"""Least |SCR| times the root of the box's area, px, of an example: fainter targets look like their background."""


class Progress(Protocol):
    """Function that takes the steps done and to do, and a note."""

    def __call__(self, done: int, total: int | None = None, note: str = "") -> None: ...


@dataclass(frozen=True, slots=True, eq=False)
class LabelledFrame:
    """Picture with the truth of its targets, its scenario and seed."""

    image: Image
    targets: tuple[TargetTruth, ...]
    scenario: str
    seed: int
    index: int

    def examples(self) -> list[TargetTruth]:
        """Return the targets that are visible enough to learn from."""
        return [target for target in self.targets if _is_clear(target)]


def box_of(target: TargetTruth) -> Box:
    """Return the box as a tracker is started with it: sides of at least `LEAST_PX`."""
    return target.box.at_least(LEAST_PX)


def labelled_frames(
    seeds: Iterable[int], scenarios: Sequence[str] = SCENARIOS, frames: int = FRAMES, progress: Progress | None = None
) -> list[LabelledFrame]:
    """Return evenly spread frames of scenarios rendered from seeds, as the 8-bit picture shows them."""
    found = []
    pairs = [(name, seed) for name in scenarios for seed in seeds]
    for done, (name, seed) in enumerate(pairs):
        if progress is not None:
            progress(done, len(pairs), f"{name}, seed {seed}")
        source = irsim.open_source(name).with_seed(seed)
        for index in np.linspace(0, len(source) - 1, frames + 2).astype(int)[1:-1].tolist():
            truth = source.truth(index)
            assert truth is not None
            found.append(LabelledFrame(source.frame(index, input="display").image, truth.targets, name, seed, index))
    return found


def _is_clear(target: TargetTruth) -> bool:
    if target.hidden or not target.in_view or (target.visible or 0) < LEAST_VISIBLE or target.crossing:
        return False
    box = box_of(target)
    return abs(target.scr or 0) * sqrt(box.w * box.h) >= LEAST_CONTRAST
