"""What makes a scene hard, measured from its truth and its noiseless picture; scenario files state these figures.

contrast    median of the followed target's apparent temperature less that of what is behind it, K
SCR         median of its signal-to-clutter ratio in the noiseless picture, the camera's noise added to
            the ring's spread (`irsim.render.contrast`); of the first and the last fifth of the frames as well
size        median of its box, px
speed       median of its apparent speed, px per frame
clutter     places of the empty scene that stand out of their own ring, over the target's box, at least half
            as much as the target does and in the same sense, per 1000 px^2
neighbour   least distance of another target's centre while neither is hidden, its frame, and that one's
            contrast as a share of the target's (medians)
crossing    angle between the ways of two targets at the frame where their boxes overlap most, degrees
hidden      largest hidden fraction, the frames of which that is within 0.02, and by what
flicker     least light of a single frame as a share of the frames about it
Medians are over every STRIDE-th frame, and where the scene is drawn by its seed, over SEEDS too.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from irsim.render.contrast import GUARD_PX, RING_PX, scr
from irsim.render.frame import Renderer
from irsim.scenario.loader import load
from irsim.scenario.model import Scenario
from irsim.scenario.placement import placed_occluders
from irsim.types import Box, Floats, TargetTruth, Truth

SEEDS = (0, 1, 2)
STRIDE = 20


@dataclass(frozen=True)
class Figures:
    """Of one scenario; None where there is no such thing. See the module for each."""

    contrast_k: float
    scr: float
    scr_ends: tuple[float, float]
    size: tuple[float, float]
    speed: float
    clutter: float
    neighbour: tuple[float, int, float] | None
    crossing: tuple[float, int] | None
    hidden: tuple[float, int, int, str] | None
    flicker: tuple[float, int] | None

    def lines(self) -> list[str]:
        """As a scenario's head states them."""
        rows = [
            f"contrast {self.contrast_k:.1f} K, SCR {self.scr:.1f} ({self.scr_ends[0]:.1f} at first, "
            f"{self.scr_ends[1]:.1f} at last), box {self.size[0]:.0f} x {self.size[1]:.0f} px, "
            f"speed {self.speed:.1f} px/frame, clutter {self.clutter:.2f} per 1000 px2"
        ]
        if self.neighbour:
            distance, frame, share = self.neighbour
            rows.append(f"neighbour {distance:.0f} px away at frame {frame}, {share:.2f} of the contrast")
        if self.crossing:
            rows.append(f"crossing at {self.crossing[0]:.0f} degrees at frame {self.crossing[1]}")
        if self.hidden:
            share, first, last, by = self.hidden
            rows.append(f"hidden {share:.2f} in frames {first} to {last} by {by}")
        if self.flicker:
            rows.append(f"flicker to {self.flicker[0]:.2f} of its contrast at frame {self.flicker[1]}")
        return rows


def figures(scenario: Scenario) -> Figures:
    """The figures of a scenario, over SEEDS; its occluders stand where the scenario's own seed puts them."""
    scenario = scenario.model_copy(update={"occluders": placed_occluders(scenario)})
    runs = [_Run.of(scenario.model_copy(update={"seed": seed})) for seed in SEEDS]
    first = runs[0]
    return Figures(
        _median(runs, "contrast_k"),
        _median(runs, "scr"),
        (_median(runs, "scr_first"), _median(runs, "scr_last")),
        (_median(runs, "wide"), _median(runs, "high")),
        _median(runs, "speed"),
        float(np.mean([run.clutter for run in runs])),
        first.neighbour,
        first.crossing,
        first.hidden,
        first.flicker,
    )


@dataclass(frozen=True)
class _Run:
    """The figures of one seed; the last four are of the first seed alone, ways being mostly scripted."""

    contrast_k: float
    scr: float
    scr_first: float
    scr_last: float
    wide: float
    high: float
    speed: float
    clutter: float
    neighbour: tuple[float, int, float] | None
    crossing: tuple[float, int] | None
    hidden: tuple[float, int, int, str] | None
    flicker: tuple[float, int] | None

    @classmethod
    def of(cls, scenario: Scenario) -> _Run:
        scene = Renderer(scenario)
        name = scenario.follow or scenario.targets[0].id
        first = scenario.seed == SEEDS[0]
        empty = Renderer(scenario.model_copy(update={"without": tuple(target.id for target in scenario.targets)}))
        seen, ratios, places = [], [], []
        contrasts: dict[str, list[float]] = {}
        for index in range(0, scenario.frames, STRIDE):
            light, truth = scene.scene(index)
            for other in truth.targets:
                if (other.visible or 0) >= 0.9:
                    contrasts.setdefault(other.id, []).append(other.contrast_k or 0.0)
            target = truth.target(name)
            if target is None or (target.visible or 0) < 0.9:
                continue
            seen.append(target)
            ratios.append(scr(light, target.box, scene.noise(index)))
            if index % (3 * STRIDE) == 0:
                behind = empty.scene(index)[0]
                places.append(_alike(behind, target.box, _stands_out(light, target.box)))
        fifth = max(len(ratios) // 5, 1)
        neighbour, crossing = _meetings(scene, name, contrasts) if first else (None, None)
        return cls(
            float(np.median([target.contrast_k or 0.0 for target in seen])),
            float(np.median(ratios)),
            float(np.median(ratios[:fifth])),
            float(np.median(ratios[-fifth:])),
            float(np.median([target.box.w for target in seen])),
            float(np.median([target.box.h for target in seen])),
            float(np.median([math.hypot(*(target.velocity or (0, 0))) for target in seen])),
            float(np.mean(places)),
            neighbour,
            crossing,
            _hiding(scene, name) if first and (scenario.occluders or crossing) else None,
            _flickering(scene, name) if first else None,
        )


def _median(runs: list[_Run], key: str) -> float:
    return float(np.median([getattr(run, key) for run in runs]))


def _stands_out(light: Floats, box: Box) -> float:
    """Mean over a box less the mean of its ring, in the picture's unit."""
    return scr(light, box) * _spread(light, box)


def around(shape: tuple[int, ...], box: Box) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """(rows, cols) twice: the share of each pixel that the box holds (it has a pixel's size at least), and its ring."""
    x, y = np.arange(shape[1]), np.arange(shape[0])[:, None]
    wide, high = max(box.w, 1.0) / 2, max(box.h, 1.0) / 2

    def share(places: npt.NDArray[np.int64], middle: float, half: float) -> Floats:
        held = np.minimum(places + 0.5, middle + half) - np.maximum(places - 0.5, middle - half)
        return np.asarray(np.clip(held, 0, 1))

    def grown(by: float) -> npt.NDArray[np.bool_]:
        return np.asarray((np.abs(y - box.cy) <= high + by) & (np.abs(x - box.cx) <= wide + by))

    return share(y, box.cy, high) * share(x, box.cx, wide), grown(RING_PX) & ~grown(GUARD_PX)


def _spread(light: Floats, box: Box) -> float:
    ring = around(light.shape, box)[1]
    return float(light[ring].astype(np.float64).std())


def _alike(light: Floats, box: Box, signal: float) -> float:
    """Places per 1000 px^2 that stand out by half the signal or more, each counted once."""
    size = max(round(box.w), 1), max(round(box.h), 1)
    picture = np.asarray(light, dtype=np.float32)
    inner = cv2.boxFilter(picture, -1, size)
    areas = [(size[0] + 2 * by) * (size[1] + 2 * by) for by in (RING_PX, GUARD_PX)]
    sums = [
        cv2.boxFilter(picture, -1, (size[0] + 2 * by, size[1] + 2 * by)) * area
        for by, area in zip((RING_PX, GUARD_PX), areas, strict=True)
    ]
    excess = (inner - (sums[0] - sums[1]) / (areas[0] - areas[1])) / signal
    peaks = (excess >= 0.5) & (excess == cv2.dilate(excess, np.ones((size[1], size[0]))))
    return 1000.0 * float(peaks.sum()) / picture.size


def _meetings(
    scene: Renderer, name: str, contrasts: dict[str, list[float]]
) -> tuple[tuple[float, int, float] | None, tuple[float, int] | None]:
    """The nearest neighbour that does not overlap, and the crossing that overlaps."""
    now = scene.now(scene.scenario.frames - 1)
    ways = {course.target.id: now.camera.project(course.positions)[:-1] for course in now.trajectories}
    own = ways.pop(name)
    neighbours: list[tuple[float, int, float]] = []
    crossing = None
    for other, way in ways.items():
        distances = np.hypot(*(way - own).T)
        index = int(np.argmin(distances))
        truth = scene.scene(index)[1]
        here, there = _of(truth, name), _of(truth, other)
        if here.box.iou(there.box) > 0.05:
            angle = np.degrees(math.atan2(*_turned(there)) - math.atan2(*_turned(here)))
            crossing = abs(math.remainder(float(angle), 360)), index
        elif (here.visible or 0) > 0.5 and (there.visible or 0) > 0.5:
            share = float(np.median(contrasts[other]) / np.median(contrasts[name]))
            neighbours.append((float(distances[index]), index, share))
    return min(neighbours, default=None), crossing


def _turned(target: TargetTruth) -> tuple[float, float]:
    assert target.velocity is not None
    return target.velocity[1], target.velocity[0]


def _of(truth: Truth, name: str) -> TargetTruth:
    target = truth.target(name)
    assert target is not None
    return target


def _hiding(scene: Renderer, name: str) -> tuple[float, int, int, str] | None:
    """The deepest hiding, looked for at every third frame and then frame by frame."""
    count = scene.scenario.frames
    coarse = [index for index in range(0, count, 3) if (_of(scene.scene(index)[1], name).visible or 0) < 0.98]
    near = sorted({index for at in coarse for index in range(max(at - 2, 0), min(at + 3, count))})
    truths = {index: _of(scene.scene(index)[1], name) for index in near}
    left = {index: truth.visible or 0.0 for index, truth in truths.items()}
    if not left:
        return None
    least = min(left.values())
    deep = [index for index in near if left[index] <= least + 0.02]
    stretch = max(_stretches(deep), key=len)
    return 1 - least, stretch[0], stretch[-1], "+".join(truths[stretch[0]].occluders)


def _stretches(indices: list[int]) -> list[list[int]]:
    return [[i for _, i in group] for _, group in groupby(enumerate(indices), lambda pair: pair[1] - pair[0])]


def _flickering(scene: Renderer, name: str) -> tuple[float, int] | None:
    flicker = next(target for target in scene.targets if target.id == name).shape.flicker
    rate = scene.scenario.camera.rate_hz
    factors = [flicker.factor(index / rate, scene.scenario.seed, name) for index in range(scene.scenario.frames)]
    index = int(np.argmin(factors))
    if factors[index] == max(factors):
        return None
    dim, before, after = (_of(scene.scene(at)[1], name).contrast_k or 0.0 for at in (index, index - 2, index + 2))
    return 2 * dim / (before + after), index


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def check_head(path: Path) -> None:
    """Assert that the lines '#: ...' of a scenario's head agree with the measured figures to a tenth."""
    stated = [line[2:].strip() for line in path.read_text().splitlines() if line.startswith("#:")]
    measured = figures(load(path)).lines()
    assert [NUMBER.sub("", line) for line in stated] == [NUMBER.sub("", line) for line in measured]
    for said, found in zip(stated, measured, strict=True):
        numbers = [float(number) for number in NUMBER.findall(found)]
        assert [float(number) for number in NUMBER.findall(said)] == pytest.approx(numbers, rel=0.1, abs=0.06), path
