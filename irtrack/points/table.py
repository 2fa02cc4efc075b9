"""Table of filters of points by name, and their comparison on the same runs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irsim.config.base import suggestion
from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.points.gaussian import GaussianFilter
from irtrack.points.motion import TURNS, Motion
from irtrack.points.particles import PointPF
from irtrack.points.tabu import Tabu
from irtrack.points.world import World

PointFilter = GaussianFilter | PointPF

FILTERS: dict[str, PointFilter] = {
    "kf": GaussianFilter("converted"),
    "ekf": GaussianFilter(),
    "ukf": GaussianFilter("unscented"),
    "h_infinity": GaussianFilter(theta=0.5),
    "imm": GaussianFilter(models=("cv", "ca", "left", "right", "singer")),
    "imm_ekf": GaussianFilter(models=TURNS),
    "bootstrap": PointPF(),
    "auxiliary": PointPF(auxiliary=True),
    "likelihood": PointPF(proposal="likelihood"),
    "weight_selected": PointPF(share=0.56),
    "ekf_pf": PointPF(proposal="extended"),
    "ukf_pf": PointPF(proposal="unscented"),
    "imm_pf": PointPF(models=TURNS),
    "ekpf_imm": PointPF(models=TURNS, proposal="extended"),
    "tabu_ekpf_imm": PointPF(models=TURNS, proposal="extended", tabu=Tabu("greedy")),
    "tabu_ekpf_imm, metropolis": PointPF(models=TURNS, proposal="extended", tabu=Tabu("metropolis")),
}
"""Filters by name. `tabu_ekpf_imm` is that of a digest ("tabu search particle filter in target tracking", which
compares it with `imm_pf`): interacting models, extended Kalman proposals, tabu search. `ekpf_imm` is it without
search."""


def filter_of(name: str, motion: Motion) -> PointFilter:
    """Return the filter of a name with the settings of the motion models; InputError for an unknown name."""
    if name not in FILTERS:
        raise InputError(f"unknown filter '{name}'; allowed: {', '.join(FILTERS)}{suggestion(name, list(FILTERS))}")
    return replace(FILTERS[name], motion=motion)


@dataclass(frozen=True, eq=False)
class PointRuns:
    """Results of one filter on all runs.

    rmse    (R,) root mean square error of place of each run, px
    nees    (R,) mean normalised squared error of place: 2 where covariances are true
    neff    (R,) mean effective sample size, nan without particles
    lost    (R,) True where the last status is lost
    ms      CPU time of a step of one run, ms
    """

    rmse: Floats
    nees: Floats
    neff: Floats
    lost: np.ndarray
    ms: float

    @classmethod
    def of(cls, world: World, filter: PointFilter) -> PointRuns:
        """Run a filter on all runs and measure its CPU time."""
        begin = time.process_time()
        found = filter.run(world)
        took = time.process_time() - begin
        runs, steps = world.states.shape[:2]
        return cls(
            rmse=found.rmse(world),
            nees=found.nees(world).mean(axis=1),
            neff=found.neff.mean(axis=1),
            lost=found.statuses(world)[:, -1] == "lost",
            ms=1e3 * took / (runs * (steps - 1)),
        )


def compare(
    world: World, motion: Motion, single: Motion | None = None, names: Sequence[str] = tuple(FILTERS)
) -> dict[str, PointRuns]:
    """Return the results of filters on the same runs, without those that the sensor does not allow.

    `single`: settings of filters with one motion model, by default those of the others.
    """
    found = {}
    for name in names:
        filter = filter_of(name, motion)
        if len(filter.models) == 1 and single is not None:
            filter = replace(filter, motion=single)
        if world.sensor.kind != "bearing" or not filter.needs_range:
            found[name] = PointRuns.of(world, filter)
    return found
