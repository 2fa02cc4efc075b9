"""World of points: trajectories of many runs in one plane, the observer's path, the plots; and estimates of them.

A run is one target of one seed. The plane is that of the picture, x right, y down, px, a frame the unit of time: the
targets of any scenario can be seen by such a sensor. Random numbers are addressed by the seed of the run, so that a run
is the same alone and among others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from irsim.rng import stream
from irsim.types import Floats, Source
from irtrack.errors import InputError
from irtrack.filters.multiple_model import MultipleModel
from irtrack.filters.unscented import square_root
from irtrack.points.sensor import Observer, PointSensor

GATE = 13.8
"""Largest squared Mahalanobis distance of a plot to the estimate in a frame that counts as a hit."""
LOST_AFTER = 10
"""Number of successive frames without a hit after which the status is lost."""


class Draws:
    """Random numbers of many runs, each from a stream of its own."""

    def __init__(self, seeds: Sequence[int], *address: str) -> None:
        self._streams = [stream(seed, "points", *address) for seed in seeds]

    def normal(self, *shape: int) -> Floats:
        """Draw standard normal numbers (R, *shape)."""
        return np.stack([each.standard_normal(shape) for each in self._streams])

    def uniform(self, *shape: int) -> Floats:
        """Draw uniform numbers (R, *shape), 0 <= u < 1."""
        return np.stack([each.random(shape) for each in self._streams])


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """World of R runs of K frames.

    states     (R, K, 4) true x, y px, vx, vy px/frame
    observer   (K, 2) px
    plots      (R, K, J, m), nan where there is none, in random order
    start      (R, 4) state in frame 0 that the filters start from
    start_sd   (4,) standard deviations of its errors
    """

    states: Floats
    observer: Floats
    plots: Floats
    sensor: PointSensor
    seeds: tuple[int, ...]
    start: Floats
    start_sd: Floats

    @classmethod
    def of(
        cls,
        places: Floats,
        sensor: PointSensor,
        observer: Observer,
        seeds: Sequence[int],
        start_sd: tuple[float, float] = (5.0, 1.0),
        velocities: Floats | None = None,
    ) -> World:
        """Return the world of places (R, K, 2) px with plots drawn by the seeds (R,).

        start_sd     standard deviations of the start state's place, px, and velocity, px/frame, on each axis
        velocities   (R, K, 2) px/frame; by default the step to the next frame
        """
        if places.ndim != 3 or places.shape[1] < 2 or not np.isfinite(places).all() or len(seeds) != len(places):
            raise InputError(f"places of shape {places.shape}; allowed: (R, K, 2), K at least 2, finite, a seed a run")
        if velocities is None:
            velocities = np.diff(places, axis=1, append=2 * places[:, -1:] - places[:, -2:-1])
        path = observer.places(places.shape[1])
        states = np.concatenate([places, velocities], axis=2)
        plots = [_plots(sensor, run - path, seed) for run, seed in zip(places, seeds, strict=True)]
        most = max(1, max(each.shape[1] for each in plots))
        padded = np.full((*places.shape[:2], most, sensor.size), np.nan)
        for row, each in zip(padded, plots, strict=True):
            row[:, : each.shape[1]] = each
        sds = np.repeat(np.array(start_sd, np.float64), 2)
        first = states[:, 0] + sds * Draws(seeds, "start").normal(4)
        return cls(states, path, padded, sensor, tuple(seeds), first, sds)

    def runs(self, rows: slice) -> World:
        """Return some of the runs."""
        return World(
            self.states[rows], self.observer, self.plots[rows], self.sensor, self.seeds[rows], self.start[rows],
            self.start_sd,
        )  # fmt: skip


def target_places(source: Source, target: str | None = None) -> Floats:
    """Return the true places (K, 2) px of a target of a scenario or recording; by default of the one to follow.

    InputError where the source has no truth, or the target does not exist in every frame.
    """
    name = target or source.follow
    found = [None if name is None else truth.target(name) for truth in source.truths()]
    centers = [each.center for each in found if each is not None]
    if len(centers) < max(len(source), 2):
        raise InputError(f"{source.name}: target {name!r} is known in {len(centers)} frames; allowed: in every frame")
    return np.array(centers)


def simulated(motion: MultipleModel, modes: np.ndarray, start: Floats, seeds: Sequence[int]) -> Floats:
    """Return states (R, K, d) from start states (R, d); `modes` (K - 1,): model of the bank from frame to frame."""
    draws = Draws(seeds, "motion")
    states = [start]
    for mode in modes.tolist():
        model = motion.models[mode]
        states.append(states[-1] @ model.F.T + draws.normal(start.shape[1]) @ square_root(model.Q).T)
    return np.stack(states, axis=1)


def _plots(sensor: PointSensor, places: Floats, seed: int) -> Floats:
    """Return the plots (K, J, m) of one run; nan where there are fewer than J."""
    rng, steps, m = stream(seed, "points", "plots"), len(places), sensor.size
    noise = sensor.noise(rng.standard_normal((steps, m)), rng.random(steps), sensor.glint)
    own = sensor.measured(places) + noise
    own[rng.random(steps) >= sensor.detection_probability] = np.nan
    counts = rng.poisson(sensor.false_plots, steps)
    spread = rng.random((steps, int(counts.max(initial=0)), m))
    spread[np.arange(spread.shape[1]) >= counts[:, None]] = np.nan
    low, width = {
        "bearing": (np.array([-pi]), np.array([2 * pi])),
        "range_bearing": (np.array([0, -pi]), np.array([sensor.reach, 2 * pi])),
        "position": (np.full(2, -sensor.reach), np.full(2, 2 * sensor.reach)),
    }[sensor.kind]
    plots = np.concatenate([own[:, None], low + spread * width], axis=1)
    order = rng.random(plots.shape[:2]).argsort(axis=1)
    shuffled: Floats = np.take_along_axis(plots, order[..., None], axis=1)
    return shuffled


@dataclass(frozen=True, slots=True, eq=False)
class PointEstimates:
    """Estimates of R runs: mean (R, K, 4) px, px/frame; covariance (R, K, 4, 4); Neff (R, K), nan without particles.

    Frame 0 holds the start.
    """

    mean: Floats
    covariance: Floats
    neff: Floats

    def rmse(self, world: World) -> Floats:
        """Return the root mean square error of place of each run (R,) over frames 1 .. K - 1, px."""
        apart = (self.mean - world.states)[:, 1:, :2]
        roots: Floats = np.sqrt((apart**2).sum(axis=2).mean(axis=1))
        return roots

    def nees(self, world: World) -> Floats:
        """Return the normalised squared error of place (R, K - 1): of mean 2 where the covariance is true."""
        apart = (self.mean - world.states)[:, 1:, :2]
        squares: Floats = (apart * np.linalg.solve(self.covariance[:, 1:, :2, :2], apart[..., None])[..., 0]).sum(-1)
        return squares

    def statuses(self, world: World) -> np.ndarray:
        """Return the status (R, K): `tracking` after a frame with a plot near the estimate, `occluded`, and `lost` from
        `LOST_AFTER` frames without one on."""
        sensor, relative = world.sensor, self.mean[..., :2] - world.observer
        apart = sensor.residual(world.plots, sensor.measured(relative)[:, :, None])
        H = sensor.jacobian(relative)
        R = np.diag(sensor.variances * sensor.matched_factor)
        S = np.matmul(np.matmul(H, self.covariance[..., :2, :2]), np.swapaxes(H, -1, -2)) + R
        squares = (apart * np.linalg.solve(S[:, :, None], apart[..., None])[..., 0]).sum(axis=-1)
        hits = (squares < GATE).any(axis=2)
        frames = np.arange(hits.shape[1])
        last = np.maximum.accumulate(np.where(hits, frames, 0), axis=1)
        missed = frames - last
        return np.where(missed == 0, "tracking", np.where(missed < LOST_AFTER, "occluded", "lost"))
