"""Gaussian filters of points, over all runs at once: Kalman, extended, unscented, H-infinity, interacting models.

    predict     mixed by the models' switching, then F mean, F P F' + Q            (`MultipleModel.predict`)
    update      with each plot apart, then merged by the probabilities of association

With one plot and no false ones this is the filter's plain update; otherwise it is probabilistic data association (Y.
Bar-Shalom, F. Daum, J. Huang 2009; of several models: A. Houles, Y. Bar-Shalom, "Multisensor tracking of a maneuvering
target in clutter", IEEE TAES 25(2), 1989), without a gate.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import log, pi
from typing import Literal, Protocol

import numpy as np

from irsim.types import Floats
from irtrack.errors import InputError
from irtrack.filters.multiple_model import States
from irtrack.filters.unscented import sigma_points, sigma_weights
from irtrack.points.motion import ModelName, Motion
from irtrack.points.sensor import PointSensor, log_sum_exp
from irtrack.points.world import PointEstimates, World

Update = Literal["converted", "extended", "unscented"]


@dataclass(frozen=True)
class GaussianFilter:
    """Filter with normal states.

    update     converted: plots become places, for a linear filter; extended: the sensor's derivative at the prediction;
               unscented: sigma points
    models     one model, or the interacting multiple model
    noise      variance of plots: `matched` to that with glint, or `nominal`, without
    theta      share of the largest feasible theta of an H-infinity filter (see `irtrack.trackers.h_infinity`); 0: none
    """

    update: Update = "extended"
    models: tuple[ModelName, ...] = ("cv",)
    noise: Literal["matched", "nominal"] = "matched"
    theta: float = 0.0
    motion: Motion = field(default_factory=Motion)

    def run(self, world: World) -> PointEstimates:
        """Return the estimates of all runs; InputError where the filter needs a range and the sensor gives none."""
        require_range(self, world.sensor)
        bank = self.motion.bank(self.models)
        size = len(bank.models[0].F)
        runs, steps = world.states.shape[:2]
        states = bank.started(world.start[:, :2], np.tile(world.start_sd[:2] ** 2, (runs, 1)), float(world.start_sd[2]))
        states.mean[:, :, :4] = world.start[:, None]
        if size > 4:
            states.covariance[:, :, [4, 5], [4, 5]] = self.motion.manoeuvre**2
        mean, covariance = np.empty((runs, steps, 4)), np.empty((runs, steps, 4, 4))
        for k in range(steps):
            if k:
                states = self.updated(bank.predict(states), world.plots[:, k], world.observer[k], world.sensor)
            center, P = states.moments()
            mean[:, k], covariance[:, k] = center[:, :4], P[:, :4, :4]
        return PointEstimates(mean, covariance, np.full((runs, steps), np.nan))

    @property
    def needs_range(self) -> bool:
        """True for converted plots, and for H-infinity: its covariance doubles each frame where nothing is
        measured."""
        return self.update == "converted" or self.theta > 0

    def updated(self, states: States, plots: Floats, observer: Floats, sensor: PointSensor) -> States:
        """Return the states after plots (R, J, m) of one frame."""
        factor = sensor.matched_factor if self.noise == "matched" else 1.0
        mean, P, fit = update_all(
            states.mean, states.covariance, plots, observer, sensor, self.update, factor, self.theta
        )
        if len(self.models) == 1:
            return States(mean, P, states.probability)
        weights = np.log(states.probability) + fit
        weights = np.exp(weights - log_sum_exp(weights)[:, None])
        return States(mean, P, np.maximum(weights, 1e-300))


class NeedsRange(Protocol):
    """Filter that may need a range."""

    @property
    def needs_range(self) -> bool: ...


def require_range(filter: NeedsRange, sensor: PointSensor) -> None:
    """Raise InputError where a filter needs a range and the sensor measures bearings alone."""
    if filter.needs_range and sensor.kind == "bearing":
        raise InputError("sensor bearing: this filter needs a range; allowed: range_bearing, position")


def update_all(
    mean: Floats, P: Floats, plots: Floats, observer: Floats, sensor: PointSensor, update: Update, factor: float,
    theta: float = 0.0,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Return means (R, M, d), covariances (R, M, d, d) and ln p(plots) (R, M) of normal states after plots (R, J, m).

    `factor`: variance of plots over that without glint. A frame without plots changes nothing.
    """
    nu, S, cross, scale = _innovations(mean, P, plots, observer, sensor, update, factor)
    missing = np.asarray(np.isnan(nu).any(axis=-1))
    nu = np.where(missing[..., None], 0.0, nu)
    gain = np.swapaxes(np.linalg.solve(S, np.swapaxes(cross, -1, -2)), -1, -2)  # (R, M, J or 1, d, m)
    solved = np.linalg.solve(S, nu[..., None])[..., 0]
    density = -0.5 * ((nu * solved).sum(axis=-1) + np.linalg.slogdet(S)[1] + nu.shape[-1] * log(2 * pi)) + scale
    terms = np.where(missing, -np.inf, density + log(sensor.detection_probability))
    none = np.broadcast_to(sensor.log_missed(plots)[:, None, None], (*terms.shape[:2], 1))
    terms = np.concatenate([none, terms], axis=2)
    fit = log_sum_exp(terms)
    share = np.exp(terms - np.where(np.isneginf(fit), 0.0, fit)[..., None])
    share[..., 0] += 1 - share.sum(axis=-1)  # where all underflow, as without a plot
    after = P[:, :, None] - np.matmul(gain, np.swapaxes(cross, -1, -2))
    shift = np.matmul(gain, nu[..., None])[..., 0]
    if theta:
        after, shift = _worst_case(P, after, nu, shift, sensor, factor, theta)
    moved = np.einsum("rmj,rmjd->rmd", share[..., 1:], shift)
    spread = np.einsum("rmj,rmjd,rmje->rmde", share[..., 1:], shift, shift) - moved[..., None] * moved[..., None, :]
    each = np.broadcast_to(after, (*shift.shape, shift.shape[-1]))
    covariance = share[..., 0, None, None] * P + np.einsum("rmj,rmjde->rmde", share[..., 1:], each) + spread
    return mean + moved, (covariance + np.swapaxes(covariance, -1, -2)) / 2, np.maximum(fit, -1e300)


def _innovations(
    mean: Floats, P: Floats, plots: Floats, observer: Floats, sensor: PointSensor, update: Update, factor: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return innovations (R, M, J, m), their covariances, the covariances of state and plot (R, M, J or 1, d, m), and
    the logarithm of the factor from densities of innovations to densities of plots."""
    R = sensor.variances * factor
    zero: Floats = np.zeros(1)
    relative = mean[..., :2] - observer
    if update == "converted":
        places, slope = sensor.places_of(plots)
        noise = np.where(np.isnan(slope), 0.0, slope)
        noise = np.matmul(noise * R, np.swapaxes(noise, -1, -2)) + 1e-12 * np.eye(2)
        area = np.zeros(plots.shape[:2]) if sensor.kind == "position" else np.log(np.maximum(plots[..., 0], 1e-9))
        S = P[:, :, None, :2, :2] + noise[:, None]
        return places[:, None] - relative[:, :, None], S, P[:, :, None, :, :2], area[:, None]
    if update == "extended":
        H = sensor.jacobian(relative)
        cross = np.matmul(P[..., :2], np.swapaxes(H, -1, -2))
        S = np.matmul(H, cross[..., :2, :]) + np.diag(R)
        return (
            sensor.residual(plots[:, None], sensor.measured(relative)[:, :, None]),
            S[:, :, None],
            cross[:, :, None],
            zero,
        )
    points = sigma_points(mean, P)
    of_mean, of_covariance = sigma_weights(mean.shape[-1])
    images = sensor.measured(points[..., :2] - observer)
    first = images[..., :1, :]
    apart = sensor.residual(images, first)  # about the central point, so that bearings do not jump
    middle = np.einsum("s,rmsi->rmi", of_mean, apart)
    apart = apart - middle[..., None, :]
    weighted = apart * of_covariance[:, None]
    S = np.matmul(np.swapaxes(weighted, -1, -2), apart) + np.diag(R)
    cross = np.matmul(np.swapaxes(points - mean[..., None, :], -1, -2), weighted)
    nu = sensor.residual(plots[:, None], first + middle[..., None, :])
    return nu, S[:, :, None], cross[:, :, None], zero


def _worst_case(
    P: Floats, after: Floats, nu: Floats, shift: Floats, sensor: PointSensor, factor: float, theta: float
) -> tuple[Floats, Floats]:
    """Return covariances and shifts of the mean by the H-infinity filter (D. Simon 2006, eq. 11.89).

    The errors weighed are those of place; theta is a share of the largest feasible one.
    """
    chosen = theta / np.linalg.eigvalsh(P[..., :2, :2])[..., -1]
    rest = np.tile(np.eye(P.shape[-1]), (*after.shape[:-2], 1, 1))
    rest[..., :, :2] -= chosen[..., None, None, None] * after[..., :, :2]
    wide = np.linalg.solve(rest, after)
    wide = (wide + np.swapaxes(wide, -1, -2)) / 2
    # With P+ H' R^-1 nu = shift, the mean moves by wide P+^-1 shift = (I - theta P+ S)^-1 shift.
    return wide, np.linalg.solve(rest, shift[..., None])[..., 0]
