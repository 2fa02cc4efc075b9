"""Particle filters of points, over all runs at once: one step with switches for proposal, models, weights and search.

    resample (first by what the next plot will weigh: auxiliary) -> model -> proposal -> weigh -> search -> estimate

A. Doucet, N. de Freitas, N. Gordon (eds.), "Sequential Monte Carlo Methods in Practice", 2001. Particles are states
(x, y, vx, vy), each with a motion model that switches as in an interacting multiple model (S. McGinnity, G. Irwin,
"Multiple model bootstrap filter for maneuvering target tracking", IEEE TAES 36(3), 2000).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from math import log, pi
from typing import Literal, NamedTuple

import numpy as np

from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.filters.multiple_model import MultipleModel
from irtrack.filters.particle import Weights, equal_weights, ess, normalise
from irtrack.filters.resampling import after_selection, copies_at, largest_first
from irtrack.filters.unscented import square_root
from irtrack.points.gaussian import require_range, update_all
from irtrack.points.motion import ModelName, Motion
from irtrack.points.sensor import PointSensor
from irtrack.points.tabu import Tabu, search
from irtrack.points.world import Draws, PointEstimates, World

PRIOR_SHARE = 0.2
"""likelihood: share of particles from the prior where a plot may be false or the target missed."""


class _Particles(NamedTuple):
    """Particles of many runs.

    x          (R, N, 4) states
    expected   (R, N, 4) their expectations given the last states
    P          (R, N, 4, 4) covariances of the proposal
    mode       (R, N) motion models
    """

    x: Floats
    expected: Floats
    P: Floats
    mode: np.ndarray

    def take(self, rows: np.ndarray) -> _Particles:
        """Return the particles of rows (R, n) of each run."""
        return _Particles(*(_rows(each, rows) for each in self))


class _Frame(NamedTuple):
    """Plots (R, J, m) of one frame, the observer's place (2,) px, the sensor, Q and its inverse (4, 4)."""

    plots: Floats
    observer: Floats
    sensor: PointSensor
    Q: Floats
    inverse: Floats

    def log_likelihood(self, x: Floats) -> Floats:
        """Return ln p(plots | x), (R, n), of states (R, n, 4)."""
        return self.sensor.log_likelihood(self.plots, x[..., :2] - self.observer)

    def log_posterior(self, x: Floats, expected: Floats) -> Floats:
        """Return ln p(plots | x) p(x | last state), (R, n), up to a constant."""
        apart = x - expected
        density: Floats = self.log_likelihood(x) - 0.5 * ((apart @ self.inverse) * apart).sum(axis=-1)
        return density


@dataclass(frozen=True)
class PointPF:
    """Particle filter of points.

    particles    N
    models       one motion model, or several that each particle switches between
    proposal     prior: bootstrap (Gordon, Salmond, Smith 1993). extended, unscented: normal, from a Kalman update of
                 each particle (R. van der Merwe, A. Doucet, N. de Freitas, E. Wan, "The unscented particle filter",
                 2000). likelihood: places from a plot, velocities given place (2001, section 2.3; Arulampalam et al.,
                 IEEE Trans. Signal Processing 50(2), 2002, section V-C)
    carried      extended, unscented: True: each particle carries the covariance of its Kalman filter, as in van der
                 Merwe et al.; False: it is Q before the update, as the last state of the particle is known (A. Doucet,
                 S. Godsill, C. Andrieu, Statistics and Computing 10, 2000, section II-D): less scatter of the weights
    auxiliary    True: resampled first by the likelihood of the expected state (M. Pitt, N. Shephard, JASA 94, 1999)
    share        Np / N of weight selection (Li, Li 2014, section 2); 1: none
    threshold    particles are resampled where Neff is below this share of N
    tabu         search after weighing
    """

    particles: int = 100
    models: tuple[ModelName, ...] = ("cv",)
    proposal: Literal["prior", "extended", "unscented", "likelihood"] = "prior"
    carried: bool = False
    auxiliary: bool = False
    share: float = 1.0
    threshold: float = 2 / 3
    tabu: Tabu = field(default_factory=lambda: Tabu("off"))
    motion: Motion = field(default_factory=Motion)

    def run(self, world: World) -> PointEstimates:
        """Return the estimates of all runs; InputError where the filter needs a range and the sensor gives none."""
        require_range(self, world.sensor)
        if self.particles < 2 or not 0 < self.share <= 1 or {"ca", "singer"} & set(self.models):
            raise InputError(
                f"particles {self.particles}, share {self.share}, models {self.models}; allowed: particles from 2 on, "
                "0 < share <= 1, models cv, left, right"
            )
        bank = self.motion.bank(self.models)
        F, Q = np.stack([each.F for each in bank.models]), bank.models[0].Q  # Q is the same in all models
        inverse = np.linalg.inv(Q)
        (runs, steps), n = world.states.shape[:2], self.particles
        draws = Draws(world.seeds, "filter")
        x = world.start[:, None] + world.start_sd * draws.normal(n, 4)
        P: Floats = np.tile(np.diag(world.start_sd**2), (runs, n, 1, 1))
        now = _Particles(x, x, P, (draws.uniform(n) * len(self.models)).astype(np.intp))
        W = equal_weights((runs, n))
        mean, covariance = np.empty((runs, steps, 4)), np.empty((runs, steps, 4, 4))
        neff = np.full((runs, steps), float(n))
        mean[:, 0], covariance[:, 0] = world.start, np.diag(world.start_sd**2)
        for k in range(1, steps):
            frame = _Frame(world.plots[:, k], world.observer[k], world.sensor, Q, inverse)
            mode = self._switched(now.mode, bank, draws)
            moves = F[mode]
            before: Floats = np.broadcast_to(Q, now.P.shape)
            if self.carried:
                before = Q + np.matmul(np.matmul(moves, now.P), np.swapaxes(moves, -1, -2))
            now = _Particles(now.x, np.matmul(moves, now.x[..., None])[..., 0], before, mode)
            first: Floats = np.zeros((runs, n))
            if self.auxiliary:
                first = frame.log_likelihood(now.expected)
                picked = _ancestors(copies_at(Weights(first, W).W, draws.uniform(1)))
                now, first, W = now.take(picked), _rows(first, picked), equal_weights((runs, n))
            now, lw = self._proposed(now, frame, draws)
            lw = lw - first
            if self.tabu.accept == "greedy":
                now, lw = self._searched(now, lw, W, frame, draws)
            W = Weights(lw, W).W
            if self.share < 1:
                order = largest_first(W, self._kept)
                now, W = now.take(order), _rows(W, order)
            kept = normalise(W[:, : self._kept])
            size = ess(W)
            mean[:, k] = np.einsum("rn,rni->ri", kept, now.x[:, : self._kept])
            apart = now.x[:, : self._kept] - mean[:, k, None]
            # A few distinct particles do not tell the covariance: that of the proposal is added, over Neff.
            own = np.einsum("rn,rnij->rij", W, now.P) / size[:, None, None]
            covariance[:, k] = np.einsum("rn,rni,rnj->rij", kept, apart, apart) + own
            neff[:, k] = size
            due = size < self.threshold * n
            now = now.take(self._picked(kept, due, draws))
            W = np.where(due[:, None], after_selection(W, self._kept, "own"), W)
            if self.tabu.accept == "metropolis":
                posterior = partial(frame.log_posterior, expected=now.expected)
                moved, _ = search(now.x, square_root(now.P), posterior, np.full((runs, 1), np.inf), self.tabu, draws)
                now = now._replace(x=moved)
        return PointEstimates(mean, covariance, neff)

    @property
    def needs_range(self) -> bool:
        """True for the likelihood proposal, which draws places from plots."""
        return self.proposal == "likelihood"

    @property
    def _kept(self) -> int:
        return max(1, round(self.share * self.particles))

    def _picked(self, kept: Floats, due: np.ndarray, draws: Draws) -> np.ndarray:
        """Return rows (R, N) after resampling those in front in the runs that are due."""
        n = self.particles
        rows = np.tile(np.arange(n), (len(kept), 1))
        picked = _ancestors(copies_at(kept, draws.uniform(1)))
        rows[:, : self._kept] = np.where(due[:, None], picked, rows[:, : self._kept])
        return rows

    def _switched(self, mode: np.ndarray, bank: MultipleModel, draws: Draws) -> np.ndarray:
        if len(self.models) == 1:
            return mode
        edges = bank.switching.cumsum(axis=1)[:, :-1]
        switched: np.ndarray = (draws.uniform(self.particles)[..., None] >= edges[mode]).sum(axis=-1)
        return switched

    def _proposed(self, now: _Particles, frame: _Frame, draws: Draws) -> tuple[_Particles, Floats]:
        """Draw states about the expected ones, and return the logarithms of their weights (R, N)."""
        normals = draws.normal(self.particles, 4)
        if self.proposal == "prior":
            now = now._replace(x=now.expected + normals @ square_root(frame.Q).T)
            return now, frame.log_likelihood(now.x)
        if self.proposal == "likelihood":
            return self._from_plots(now, frame, normals, draws.uniform(self.particles, 3))
        sensor = frame.sensor
        center, P, _ = update_all(
            now.expected, now.P, frame.plots, frame.observer, sensor, self.proposal, sensor.matched_factor
        )
        root = square_root(P)
        now = now._replace(x=center + np.matmul(root, normals[..., None])[..., 0], P=P)
        proposal = -0.5 * (normals**2).sum(axis=-1) - np.log(np.abs(np.linalg.det(root)))
        return now, frame.log_posterior(now.x, now.expected) - proposal

    def _from_plots(
        self, now: _Particles, frame: _Frame, normals: Floats, uniforms: Floats
    ) -> tuple[_Particles, Floats]:
        """Draw places from plots, or from the prior, and velocities given the places.

        The density of velocity cancels: weights are p(plots | place) p(place | last state) / q(place), with
        q(place) = s p(place | last state) + (1 - s) mean_j p(z_j | place) |dz / dplace|.
        """
        plots, observer, sensor, Q, _ = frame
        certain = sensor.detection_probability == 1 and sensor.false_plots == 0
        there = ~np.isnan(plots[..., 0])
        count = there.sum(axis=1)
        share = np.where(count == 0, 1.0, 0.0 if certain else PRIOR_SHARE)[:, None]
        order = np.argsort(~there, axis=1, kind="stable")
        nth = np.minimum((uniforms[..., 0] * count[:, None]).astype(np.intp), np.maximum(count - 1, 0)[:, None])
        chosen = np.nan_to_num(_rows(plots, _rows(order, nth)))
        drawn = chosen - sensor.noise(normals[..., : sensor.size], uniforms[..., 1])
        Qpp, Qvp = Q[:2, :2], Q[2:, :2]
        about = now.expected[..., :2]
        prior = about + normals[..., :2] @ square_root(Qpp).T
        places = np.where((uniforms[..., 2] < share)[..., None], prior, sensor.places_of(drawn)[0] + observer)
        gain = np.linalg.solve(Qpp, Qvp.T).T
        velocities = now.expected[..., 2:] + (places - about) @ gain.T
        velocities += normals[..., 2:] @ square_root(Q[2:, 2:] - gain @ Qvp.T).T
        relative = places - observer
        residuals = sensor.residual(plots[:, None], sensor.measured(relative)[:, :, None])
        own = np.exp(sensor.log_noise_density(residuals)).sum(axis=2) / np.maximum(count, 1)[:, None]
        if sensor.kind == "range_bearing":
            own /= np.maximum(np.hypot(relative[..., 0], relative[..., 1]), 1e-9)
        moved = log_normal(places - about, Qpp)
        q = share * np.exp(moved) + (1 - share) * own
        now = now._replace(x=np.concatenate([places, velocities], axis=2))
        return now, frame.log_likelihood(now.x) + moved - np.log(np.maximum(q, 1e-300))

    def _searched(
        self, now: _Particles, lw: Floats, W: Floats, frame: _Frame, draws: Draws
    ) -> tuple[_Particles, Floats]:
        """Return particles and weights after the tabu search of the particles of least weight."""
        count = max(1, round(self.tabu.share * self.particles))
        rows = largest_first(-(np.log(np.maximum(W, 1e-300)) + lw), count)[:, :count]
        best = frame.log_posterior(now.x, now.expected).max(axis=1, keepdims=True)
        few = now.take(rows)
        posterior = partial(frame.log_posterior, expected=few.expected)
        found, gain = search(few.x, square_root(few.P), posterior, best, self.tabu, draws)
        x, lw = now.x.copy(), lw.copy()
        np.put_along_axis(x, rows[..., None], found, axis=1)
        np.put_along_axis(lw, rows, _rows(lw, rows) + gain, axis=1)
        return now._replace(x=x), lw


def log_normal(apart: Floats, P: Floats) -> Floats:
    """Return ln N(apart; 0, P), (...), of vectors (..., d) and one covariance (d, d)."""
    solved = apart @ np.linalg.inv(P)
    density: Floats = -0.5 * ((apart * solved).sum(axis=-1) + np.linalg.slogdet(P)[1] + len(P) * log(2 * pi))
    return density


def _ancestors(copies: np.ndarray) -> np.ndarray:
    """Return the rows (R, N) of each run, each as often as `copies` (R, N) says."""
    runs, n = copies.shape
    return np.repeat(np.tile(np.arange(n), runs), copies.ravel()).reshape(runs, n)


def _rows(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return values (R, N, ...) at rows (R, n)."""
    found: np.ndarray = values[np.arange(len(rows))[:, None], rows]
    return found
