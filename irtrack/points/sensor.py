"""Sensor of points: measures bearing, range and bearing, or place, from a moving observer, with glint.

A plot z (m,) of a target at the place p (2,), relative to the observer, is

    bearing         atan2(y, x), rad from +x towards +y
    range_bearing   (|p|, bearing), px and rad
    position        p, px

plus noise (1 - epsilon) N(0, R) + epsilon N(0, c R). Heavy tails from the scintillation of the target's reflections are
called glint (G. Hewer, R. Martin, J. Zeh, "Robust preprocessing for Kalman filtering of glint noise", IEEE TAES 23(1),
1987). A target is missed with the probability 1 - P_D; false plots are Poisson in number and uniform.
"""

from __future__ import annotations

from math import log, pi
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from irsim.config.base import Part
from irsim.config.quantities import Fraction
from irsim.types import Floats

Kind = Literal["bearing", "range_bearing", "position"]
_NEAREST = 1e-6
"""Least squared distance from the observer in derivatives, px^2."""


class Observer(Part):
    """Path of the sensor: start + velocity k + weave sin(2 pi k / period), the weave across the velocity."""

    start: tuple[float, float] = (0.0, 0.0)
    """Place in frame 0, px."""
    velocity: tuple[float, float] = (0.0, 0.0)
    """Velocity, px/frame."""
    weave: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    """Amplitude of the weave, px; without one (and with a straight target) bearings do not determine the range."""
    period: Annotated[float, Field(gt=0, le=1e6)] = 40.0
    """Period of the weave, frames."""

    def places(self, steps: int) -> Floats:
        """Return the observer's places (steps, 2) px."""
        k = np.arange(steps)[:, None]
        along = np.array(self.velocity)
        across = np.array([-along[1], along[0]]) / (np.hypot(*along) or 1.0) if along.any() else np.array([0.0, 1.0])
        places: Floats = np.array(self.start) + k * along + self.weave * np.sin(2 * pi * k / self.period) * across
        return places


class PointSensor(Part):
    """Sensor of points."""

    kind: Kind = "range_bearing"
    bearing_sd: Annotated[float, Field(gt=0, le=3)] = 0.02
    """Standard deviation of bearings without glint, rad."""
    range_sd: Annotated[float, Field(gt=0, le=1e4)] = 2.0
    """Standard deviation of ranges, or of places on each axis, without glint, px."""
    glint: Annotated[float, Field(ge=0, lt=1)] = 0.1
    """epsilon, share of plots with glint."""
    glint_scale: Annotated[float, Field(ge=1, le=1e6)] = 100.0
    """c, factor of the variance with glint."""
    detection_probability: Annotated[float, Field(gt=0, le=1)] = 1.0
    """P_D."""
    false_plots: Annotated[float, Field(ge=0, le=100)] = 0.0
    """Mean number of false plots in a frame."""
    reach: Annotated[float, Field(gt=0, le=1e6)] = 300.0
    """Largest range of false plots, or half the side of their square, px."""
    stated_glint: Fraction | None = None
    """epsilon that the filters assume; by default the true one."""

    @property
    def size(self) -> int:
        """Length m of a plot."""
        return 1 if self.kind == "bearing" else 2

    @property
    def variances(self) -> Floats:
        """Diagonal of R, (m,)."""
        sds = {"bearing": (self.bearing_sd,), "range_bearing": (self.range_sd, self.bearing_sd)}
        variances: Floats = np.square(np.array(sds.get(self.kind, (self.range_sd, self.range_sd))))
        return variances

    @property
    def matched_factor(self) -> float:
        """Variance with glint over that without, 1 - epsilon + epsilon c."""
        epsilon = self._epsilon
        return 1 - epsilon + epsilon * self.glint_scale

    @property
    def density(self) -> float:
        """False plots per unit of the plots' space."""
        volumes = {"bearing": 2 * pi, "range_bearing": 2 * pi * self.reach, "position": (2 * self.reach) ** 2}
        return self.false_plots / volumes[self.kind]

    @property
    def _epsilon(self) -> float:
        return self.glint if self.stated_glint is None else self.stated_glint

    def measured(self, places: Floats) -> Floats:
        """Return the plots (..., m) of relative places (..., 2) px without noise."""
        if self.kind == "position":
            return places
        bearing = np.arctan2(places[..., 1], places[..., 0])
        if self.kind == "bearing":
            return bearing[..., None]
        return np.stack([np.hypot(places[..., 0], places[..., 1]), bearing], axis=-1)

    def residual(self, plots: Floats, expected: Floats) -> Floats:
        """Return plots less expected plots, (..., m), bearings within -pi .. pi."""
        apart: Floats = plots - expected
        if self.kind != "position":
            apart[..., -1] = (apart[..., -1] + pi) % (2 * pi) - pi
        return apart

    def jacobian(self, places: Floats) -> Floats:
        """Return the derivative (..., m, 2) of `measured` at relative places (..., 2) px."""
        if self.kind == "position":
            return np.broadcast_to(np.eye(2), (*places.shape[:-1], 2, 2))
        x, y = places[..., 0], places[..., 1]
        square = np.maximum(x * x + y * y, _NEAREST)
        turn = np.stack([-y / square, x / square], axis=-1)
        if self.kind == "bearing":
            return turn[..., None, :]
        return np.stack([places / np.sqrt(square)[..., None], turn], axis=-2)

    def places_of(self, plots: Floats) -> tuple[Floats, Floats]:
        """Return relative places (..., 2) px of plots with a range, and the derivative (..., 2, m) by the plot.

        "Converted measurements" (Y. Bar-Shalom, X. Li, T. Kirubarajan 2001, section 10.4.3), linearised: unbiased to
        r sigma^2 / 2.
        """
        if self.kind == "position":
            return plots, np.broadcast_to(np.eye(2), (*plots.shape[:-1], 2, 2))
        r, bearing = plots[..., 0], plots[..., 1]
        c, s = np.cos(bearing), np.sin(bearing)
        places = np.stack([r * c, r * s], axis=-1)
        return places, np.stack([np.stack([c, -r * s], axis=-1), np.stack([s, r * c], axis=-1)], axis=-2)

    def noise(self, normals: Floats, uniform: Floats, epsilon: float | None = None) -> Floats:
        """Return noise (..., m) from standard normal (..., m) and uniform (...) numbers."""
        epsilon = self._epsilon if epsilon is None else epsilon
        factor = np.where(uniform < epsilon, np.sqrt(self.glint_scale), 1.0)
        scaled: Floats = normals * np.sqrt(self.variances) * factor[..., None]
        return scaled

    def log_noise_density(self, residuals: Floats) -> Floats:
        """Return ln of the density (...) of noise (..., m); -inf where a residual is nan (no plot)."""
        square = (residuals**2 / self.variances).sum(axis=-1)
        square = np.where(np.isnan(square), np.inf, square)
        constant = -0.5 * (self.size * log(2 * pi) + float(np.log(self.variances).sum()))
        if self._epsilon == 0:
            return constant - 0.5 * square
        wide = log(self._epsilon) - 0.5 * self.size * log(self.glint_scale) - 0.5 * square / self.glint_scale
        if self._epsilon == 1:
            return constant + wide
        return constant + np.logaddexp(log(1 - self._epsilon) - 0.5 * square, wide)

    def log_likelihood(self, plots: Floats, places: Floats) -> Floats:
        """Return ln p(plots | place), (R, N), up to a constant, of relative places (R, N, 2) and plots (R, J, m), nan
        where there is none.

        p is proportional to (1 - P_D) lambda + P_D sum_j p(z_j | place), lambda the density of false plots.
        """
        residuals = self.residual(plots[:, None], self.measured(places)[:, :, None])
        none = self.log_missed(plots)[:, None]
        terms = self.log_noise_density(residuals) + log(self.detection_probability)
        if terms.shape[2] == 1 and np.isneginf(none).all():
            return terms[:, :, 0]
        return log_sum_exp(np.concatenate([terms, np.broadcast_to(none[..., None], (*terms.shape[:2], 1))], axis=2))

    def log_missed(self, plots: Floats) -> Floats:
        """Return ln((1 - P_D) lambda), (R,); 0 in frames without plots, where nothing is learned."""
        missed = (1 - self.detection_probability) * self.density
        empty = np.isnan(plots[..., 0]).all(axis=1)
        return np.where(empty, 0.0, log(missed) if missed > 0 else -np.inf)

    @property
    def glint_information(self) -> float:
        """Fisher information of the noise over that of N(0, R), for one axis; of both axes alike.

        E[(grad ln p)^2] / m of the mixture with R = 1, by quadrature along the radius: above 1 / `matched_factor`, the
        information of a normal of equal variance.
        """
        r = np.linspace(1e-9, 8 * np.sqrt(self.glint_scale), 200_001)
        shares = np.array([1 - self.glint, self.glint])[:, None]
        scales = np.array([1.0, self.glint_scale])[:, None]
        parts = shares * (2 * pi * scales) ** (-self.size / 2) * np.exp(-(r**2) / (2 * scales))
        density, slope = parts.sum(axis=0), (parts / scales).sum(axis=0) * r
        surface = 2.0 if self.size == 1 else 2 * pi * r
        whole = np.where(density > 0, slope**2 / np.maximum(density, 1e-300), 0) * surface
        return float(np.trapezoid(whole, r)) / self.size


def log_sum_exp(terms: Floats) -> Floats:
    """Return ln sum exp over the last axis, -inf where all terms are."""
    top = terms.max(axis=-1, keepdims=True)
    top = np.where(np.isneginf(top), 0.0, top)
    with np.errstate(divide="ignore"):
        total: Floats = np.log(np.exp(terms - top).sum(axis=-1)) + top[..., 0]
    return total
