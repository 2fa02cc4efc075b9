"""Filters of points on three worlds: the claims of a digest on tabu search, and of Li and Li 2014 on the likelihood PF.

The digest ("Application of a tabu search particle filter in target tracking") compares interacting models with extended
Kalman proposals and tabu search with the interacting-model particle filter, in glint noise; it prints no settings that
survive. The worlds are chosen here: a target that turns by the models' own rate, a jet of a stress scenario with missed
and false plots, and a slow one of which only bearings are measured, from a weaving observer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import irsim
from irsim.types import Floats
from irtrack.metrics import mean_interval
from irtrack.papers.verdicts import Verdict, judge
from irtrack.points import Observer, PointRuns, PointSensor, World, compare
from irtrack.points.motion import TURNS, Motion
from irtrack.points.world import simulated, target_places

RUNS_A_SEED = 4
"""Number of runs per seed of the other experiments: 200 for 50 seeds."""
MODES = np.repeat([0, 2, 0, 1, 0], [15, 12, 10, 12, 10])
"""Models of the turning target: straight, right, straight, left, straight."""


def _turning(seeds: range) -> tuple[Floats, Floats | None]:
    start = np.tile([60.0, 40.0, 2.0, 0.5], (len(seeds), 1))
    states = simulated(Motion(acceleration=0.1).bank(TURNS), MODES, start, seeds)
    return states[..., :2], states[..., 2:]


def _scenario(severity: int) -> Callable[[range], tuple[Floats, Floats | None]]:
    def places(seeds: range) -> tuple[Floats, Floats | None]:
        scenario = irsim.load("stress/manoeuvre", (f"severity={severity}", "frames=60"))
        source = irsim.Rendering(scenario, "manoeuvre")
        return np.stack([target_places(source.with_seed(seed)) for seed in seeds]), None

    return places


@dataclass(frozen=True)
class PointScene:
    """World of the page: places by seeds, sensor, observer, settings of filters with several models and with one."""

    title: str
    places: Callable[[range], tuple[Floats, Floats | None]]
    sensor: PointSensor
    observer: Observer
    motion: Motion
    single: Motion

    def world(self, seeds: range) -> World:
        """Return the world of the seeds, one run each."""
        places, velocities = self.places(seeds)
        return World.of(places, self.sensor, self.observer, seeds, (5.0, 1.0), velocities)


SCENES = {
    "turning": PointScene(
        "A target that turns, range and bearing with glint",
        _turning,
        PointSensor(),
        Observer(velocity=(1.0, 0.0)),
        Motion(acceleration=0.2),
        Motion(acceleration=0.4),
    ),
    "jet": PointScene(
        "stress/manoeuvre, severity 2; range and bearing with glint, missed and false plots",
        _scenario(2),
        PointSensor(detection_probability=0.9, false_plots=0.5),
        Observer(start=(0.0, -80.0)),
        Motion(acceleration=0.2, turn_rate=0.1),
        Motion(acceleration=0.4),
    ),
    "bearings": PointScene(
        "stress/manoeuvre, severity 0; bearings with glint from a weaving observer",
        _scenario(0),
        PointSensor(kind="bearing"),
        Observer(start=(0.0, -40.0), velocity=(2.0, 0.0), weave=30.0, period=30.0),
        Motion(acceleration=0.05, turn_rate=0.03),
        Motion(acceleration=0.05),
    ),
}
"""The worlds by name. `single` has the acceleration with the least error of `ekf` on 40 development runs."""


@dataclass(frozen=True, eq=False)
class PointResult:
    """Results by world and filter, and the number of runs of each world."""

    worlds: Mapping[str, Mapping[str, PointRuns]]
    runs: int

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each world and filter: RMSE with its 95 % interval, px; share lost; NEES; Neff; ms."""
        found = []
        for world, filters in self.worlds.items():
            for name, each in filters.items():
                mean, low, high = map(float, mean_interval(each.rmse))
                figures = {"lost": each.lost.mean(), "nees": np.median(each.nees), "neff": each.neff.mean()}
                row: dict[str, Any] = {"world": SCENES[world].title, "filter": name, "rmse": mean, "low": low}
                found.append(row | {"high": high, "ms": each.ms} | {key: float(v) for key, v in figures.items()})
        return found

    def verdicts(self) -> list[Verdict]:
        """Judge the claims run by run on the same plots."""
        found = []
        for world, filters in self.worlds.items():
            tabu = filters["tabu_ekpf_imm"]
            for other in ("imm_pf", "imm_ekf", "ekpf_imm", "ukf_pf"):
                rule = f"RMSE of tabu_ekpf_imm below that of {other}"
                text = "Tabu search with interacting models tracks manoeuvring targets better."
                found.append(_verdict(text, "digest, abstract", world, rule, tabu.rmse < filters[other].rmse))
            if "likelihood" in filters:
                less = filters["likelihood"].neff < filters["bootstrap"].neff
                text, rule = "The likelihood PF degenerates more.", "mean Neff of likelihood below that of bootstrap"
                found.append(_verdict(text, "Li 2014, section 1", world, rule, less))
        return found


def _verdict(text: str, place: str, world: str, rule: str, answers: np.ndarray) -> Verdict:
    return Verdict(text, place, f"points: {world}", rule, judge(answers.tolist()))


def points_result(runs: int, first: int = 0) -> PointResult:
    """Run all filters on all worlds, with the seeds first .. first + runs - 1."""
    seeds = range(first, first + runs)
    every = {name: compare(scene.world(seeds), scene.motion, scene.single) for name, scene in SCENES.items()}
    return PointResult(every, runs)
