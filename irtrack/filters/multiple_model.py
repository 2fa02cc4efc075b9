"""Kalman filters of many tracks at once, each with one or several motion models: the interacting multiple model.

State (x, y, vx, vy, ax, ay), px and frames; all models of a bank have the same state, so that states can mix. A track
with one model is a plain Kalman filter. All arrays have the tracks as first axis and the models as second.

H. Blom, Y. Bar-Shalom, "The interacting multiple model algorithm for systems with Markovian switching coefficients",
IEEE Trans. Automatic Control 33(8), 1988; Y. Bar-Shalom, X. Li, T. Kirubarajan, "Estimation with Applications to
Tracking and Navigation", 2001, section 11.6.6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, log, pi, sin

import numpy as np

from irsim.types import Floats

STATE = 6
"""Length of a state."""
_UNSURE = 1e-6
"""Variance of the acceleration in models without one, px^2/frame^4, so that no covariance is singular."""


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """Linear motion model over one frame: transition F (6, 6) and process noise Q (6, 6)."""

    F: Floats
    Q: Floats


def constant_velocity_model(acceleration: float, size: int = STATE) -> Model:
    """Return the constant-velocity model; `acceleration`: deviation of white acceleration, px/frame^2 (2001, eq.
    6.3.2-4).

    `size` 4 leaves out the acceleration from the state, for a bank of this model alone.
    """
    F, Q = np.zeros((STATE, STATE)), np.zeros((STATE, STATE))
    F[:4, :4] = np.eye(4)
    F[0, 2] = F[1, 3] = 1
    gain = np.array([0.5, 1.0])
    for axis in (0, 1):
        places = np.ix_((axis, 2 + axis), (axis, 2 + axis))
        Q[places] = acceleration**2 * np.outer(gain, gain)
    Q[4, 4] = Q[5, 5] = _UNSURE
    return Model(F[:size, :size], Q[:size, :size])


def white_acceleration_model(density: float, size: int = 4) -> Model:
    """Return the constant-velocity model with continuous white acceleration (2001, eq. 6.2.2-12): Q is not singular.

    `density`: root of its power spectral density, px/frame^(3/2).
    """
    model = constant_velocity_model(0.0, size)
    Q = model.Q.copy()
    for axis in (0, 1):
        Q[np.ix_((axis, 2 + axis), (axis, 2 + axis))] = density**2 * np.array([[1 / 3, 1 / 2], [1 / 2, 1]])
    return Model(model.F, Q)


def singer_model(acceleration: float, rate: float) -> Model:
    """Return the model with acceleration of deviation `acceleration`, px/frame^2, that decays with `rate`, 1/frame.

    R. Singer, "Estimating optimal tracking filter performance for manned maneuvering targets", IEEE TAES 6(4), 1970.
    Q = 2 rate acceleration^2 int_0^1 g g' ds, g the last column of F(s), by Gauss-Legendre quadrature.
    """

    def transition(s: float | Floats) -> list[Floats]:
        decay = np.exp(-rate * s)
        return [(rate * s - 1 + decay) / rate**2, (1 - decay) / rate, decay]

    nodes, weights = np.polynomial.legendre.leggauss(12)
    g = np.stack(transition((nodes + 1) / 2))
    one = 2 * rate * acceleration**2 * (g * weights / 2) @ g.T
    F, Q = np.eye(STATE), np.zeros((STATE, STATE))
    for axis in (0, 1):
        places = [axis, 2 + axis, 4 + axis]
        F[axis, 2 + axis] = 1
        F[places, 4 + axis] = transition(1.0)
        Q[np.ix_(places, places)] = one
    return Model(F, Q)


def constant_acceleration_model(increment: float) -> Model:
    """Return the constant-acceleration model; `increment`: deviation of its increments, px/frame^2 (2001, eq.
    6.3.3-5)."""
    F, Q = np.eye(STATE), np.zeros((STATE, STATE))
    gain = np.array([0.5, 1.0, 1.0])
    for axis in (0, 1):
        F[axis, 2 + axis] = F[2 + axis, 4 + axis] = 1
        F[axis, 4 + axis] = 0.5
        places = np.ix_((axis, 2 + axis, 4 + axis), (axis, 2 + axis, 4 + axis))
        Q[places] = increment**2 * np.outer(gain, gain)
    return Model(F, Q)


def coordinated_turn_model(rate: float, acceleration: float) -> Model:
    """Return the turn of a known rate, rad/frame from +x towards +y (2001, eq. 11.7.1-4), with white acceleration."""
    model = constant_velocity_model(acceleration)
    F = model.F.copy()
    s, c = sin(rate), cos(rate)
    F[:4, 2:4] = [[s / rate, -(1 - c) / rate], [(1 - c) / rate, s / rate], [c, -s], [s, c]]
    F[4:, 2:4] = rate * np.array([[-s, -c], [c, -s]])  # the acceleration towards the centre of the turn
    return Model(F, model.Q)


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """Filters of n tracks with M models: mean (n, M, 6), covariance (n, M, 6, 6), probabilities of models (n, M)."""

    mean: Floats
    covariance: Floats
    probability: Floats

    def __len__(self) -> int:
        return len(self.mean)

    def take(self, rows: np.ndarray) -> States:
        """Return the tracks selected by a mask or by indices."""
        return States(self.mean[rows], self.covariance[rows], self.probability[rows])

    def joined(self, others: States) -> States:
        """Return these tracks followed by others."""
        return States(
            np.concatenate([self.mean, others.mean]),
            np.concatenate([self.covariance, others.covariance]),
            np.concatenate([self.probability, others.probability]),
        )

    def moments(self) -> tuple[Floats, Floats]:
        """Return mean (n, 6) and covariance (n, 6, 6) of the mixtures over models (2001, eq. 11.6.6-16, -17)."""
        if self.mean.shape[1] == 1:
            return self.mean[:, 0], self.covariance[:, 0]
        mean = np.einsum("nm,nmi->ni", self.probability, self.mean)
        apart = self.mean - mean[:, None]
        return mean, np.einsum("nm,nmij->nij", self.probability, self.covariance + _outer(apart))


def _outer(vectors: Floats) -> Floats:
    product: Floats = vectors[..., :, None] * vectors[..., None, :]
    return product


@dataclass(frozen=True)
class MultipleModel:
    """Bank of motion models with the probabilities (M, M) of switching from row to column in a frame."""

    models: Sequence[Model]
    switching: Floats

    @classmethod
    def of(cls, models: Sequence[Model], stay: float) -> MultipleModel:
        """Return a bank whose models persist with probability `stay` and switch to all others with equal
        probability."""
        count = len(models)
        if count == 1:
            return cls(models, np.ones((1, 1)))
        switching = np.full((count, count), (1 - stay) / (count - 1))
        np.fill_diagonal(switching, stay)
        return cls(models, switching)

    @cached_property
    def _stacked(self) -> tuple[Floats, Floats]:
        return np.stack([each.F for each in self.models]), np.stack([each.Q for each in self.models])

    def started(self, centers: Floats, variance: Floats, speed: float) -> States:
        """Return tracks at centres (n, 2) px, variances (n, 2) px^2; `speed`: deviation of the velocity on each axis,
        px/frame."""
        count, models, size = len(centers), len(self.models), len(self.models[0].F)
        mean = np.zeros((count, models, size))
        mean[:, :, :2] = centers[:, None]
        covariance = np.zeros((count, models, size, size))
        covariance[:, :, 0, 0], covariance[:, :, 1, 1] = variance[:, :1], variance[:, 1:]
        covariance[:, :, 2, 2] = covariance[:, :, 3, 3] = speed**2
        if size == STATE:
            covariance[:, :, 4, 4] = covariance[:, :, 5, 5] = _UNSURE
        return States(mean, covariance, np.full((count, models), 1 / models))

    def predict(self, states: States) -> States:
        """Return the states a frame ahead: the models' estimates mixed (2001, eq. 11.6.6-7 to -10), then moved."""
        F, Q = self._stacked
        mixed = self._mixed(states) if len(self.models) > 1 else states
        mean = np.matmul(F, mixed.mean[..., None])[..., 0]
        covariance = np.matmul(np.matmul(F, mixed.covariance), np.swapaxes(F, 1, 2)) + Q
        return States(mean, covariance, mixed.probability)

    def _mixed(self, states: States) -> States:
        joint = states.probability[:, :, None] * self.switching  # (n, from, to)
        predicted = joint.sum(axis=1)
        weights = joint / predicted[:, None]
        mean = np.einsum("nft,nfi->nti", weights, states.mean)
        apart = states.mean[:, :, None] - mean[:, None]  # (n, from, to, 6)
        covariance = np.einsum("nft,nfij->ntij", weights, states.covariance)
        covariance += np.einsum("nft,nfti,nftj->ntij", weights, apart, apart)
        return States(mean, covariance, predicted)


def update(states: States, centers: Floats, noise: Floats) -> States:
    """Return the states after detections at centres (n, 2) px of noise (2, 2) or (n, 2, 2) px^2, one a track.

    Models whose prediction fits gain probability (2001, eq. 11.6.6-14). The covariance is P - K S K'.
    """
    nu = centers[:, None] - states.mean[:, :, :2]
    inverse, determinant, gain, cross = _gains(states, noise if noise.ndim == 2 else noise[:, None])
    mean = states.mean + np.matmul(gain, nu[..., None])[..., 0]
    covariance = _symmetric(states.covariance - np.matmul(gain, np.swapaxes(cross, -1, -2)))
    if states.mean.shape[1] == 1:
        return States(mean, covariance, states.probability)
    fit = np.log(states.probability) - 0.5 * (_squares(nu, inverse) + np.log(determinant))
    weights = np.exp(fit - fit.max(axis=1, keepdims=True))
    return States(mean, covariance, weights / weights.sum(axis=1, keepdims=True))


def update_mixture(states: States, centers: Floats, noise: Floats, beta: Floats) -> States:
    """Return the states after detections (m, 2) px of noise (2, 2) px^2; beta (n, m): probabilities of association.

    The rest of the probability is that of no detection. Probabilistic data association (Y. Bar-Shalom, F. Daum, J.
    Huang, "The probabilistic data association filter", IEEE Control Systems 29(6), 2009, eqs. 35 to 43). Each model has
    its own probabilities of association: beta times its share of the detection's likelihood.
    """
    nu = centers[None, None] - states.mean[:, :, None, :2]  # (n, M, m, 2)
    inverse, determinant, gain, cross = _gains(states, noise)
    none = np.maximum(1 - beta.sum(axis=1, keepdims=True), 0.0)
    own, probability = beta[:, None, :], states.probability
    if probability.shape[1] > 1:
        fit = np.log(probability)[..., None] - 0.5 * (
            _squares(nu, inverse[:, :, None]) + np.log(determinant)[..., None]
        )
        share = np.exp(fit - fit.max(axis=1, keepdims=True))
        own = own * share / share.sum(axis=1, keepdims=True)  # (n, M, m), summing to beta over the models
        probability = none * probability + own.sum(axis=2)
        own = own / probability[..., None]
    mean_nu = np.einsum("nmk,nmki->nmi", own, nu)
    spread = np.einsum("nmk,nmki,nmkj->nmij", own, nu, nu) - _outer(mean_nu)
    mean = states.mean + np.matmul(gain, mean_nu[..., None])[..., 0]
    covariance = states.covariance - own.sum(axis=2)[..., None, None] * np.matmul(gain, np.swapaxes(cross, -1, -2))
    covariance = _symmetric(covariance + np.matmul(np.matmul(gain, spread), np.swapaxes(gain, -1, -2)))
    return States(mean, covariance, probability)


def densities(states: States, noise: Floats, detections: Floats) -> tuple[Floats, Floats]:
    """Return squared Mahalanobis distances (n, m) and log densities (n, m), per px^2, of detections (m, 2) px.

    The distance, for gates, is from the mixture's mean with its covariance; the density is that of the mixture.
    """
    centers, S = states.mean[:, :, :2], states.covariance[:, :, :2, :2] + noise
    distance, density = _densities(centers, S, detections)
    if centers.shape[1] == 1:
        return distance[:, 0], density[:, 0]
    mean, covariance = states.moments()
    outer, _ = _densities(mean[:, None, :2], covariance[:, None, :2, :2] + noise, detections)
    weighted = density + np.log(states.probability)[..., None]
    top = weighted.max(axis=1)
    return outer[:, 0], top + np.log(np.exp(weighted - top[:, None]).sum(axis=1))


def _densities(centers: Floats, S: Floats, detections: Floats) -> tuple[Floats, Floats]:
    """Return squared distances and log densities (n, M, m) of detections (m, 2) about centres (n, M, 2)."""
    a, b, d = S[..., 0, 0], S[..., 0, 1], S[..., 1, 1]
    determinant = a * d - b * b
    x, y = detections[:, 0] - centers[..., :1], detections[:, 1] - centers[..., 1:]
    xx, xy, yy = ((each / determinant)[..., None] for each in (d, -2 * b, a))
    distance = (xx * x + xy * y) * x + yy * y * y
    density: Floats = -0.5 * distance - (0.5 * np.log(determinant) + log(2 * pi))[..., None]
    return distance, density


def _gains(states: States, noise: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return S^-1 (n, M, 2, 2), det S, the gain (n, M, 6, 2), and the covariance of state and centre (n, M, 6, 2)."""
    inverse, determinant = inverse_2x2(states.covariance[:, :, :2, :2] + noise)
    cross = states.covariance[:, :, :, :2]
    return inverse, determinant, np.matmul(cross, inverse), cross


def _squares(nu: Floats, inverse: Floats) -> Floats:
    """Return nu' S^-1 nu of vectors (..., 2) and symmetric inverses (..., 2, 2)."""
    x, y = nu[..., 0], nu[..., 1]
    found: Floats = inverse[..., 0, 0] * x * x + 2 * inverse[..., 0, 1] * x * y + inverse[..., 1, 1] * y * y
    return found


def _symmetric(matrices: Floats) -> Floats:
    half: Floats = (matrices + np.swapaxes(matrices, -1, -2)) / 2
    return half


def inverse_2x2(matrices: Floats) -> tuple[Floats, Floats]:
    """Return inverses (..., 2, 2) and determinants (...) of symmetric matrices (..., 2, 2)."""
    a, b, d = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
    determinant = a * d - b * b
    inverse = np.empty(matrices.shape)
    inverse[..., 0, 0], inverse[..., 1, 1] = d / determinant, a / determinant
    inverse[..., 0, 1] = inverse[..., 1, 0] = -b / determinant
    return inverse, determinant


def moved(states: States, homography: Floats) -> States:
    """Return the states after the camera moved the whole scene by a homography (3, 3) of pixels.

    Places are mapped exactly, velocities, accelerations and covariances by the homography's derivative at the place.
    """
    places = states.mean[:, :, :2]
    x, y, w = np.moveaxis(places @ homography[:, :2].T + homography[:, 2], -1, 0)
    w = np.maximum(w, _BEHIND)
    mapped = np.stack([x / w, y / w], axis=-1)
    slope = (homography[:2, :2] - mapped[..., None] * homography[2, :2]) / w[..., None, None]
    axes = states.mean.shape[2] // 2
    whole = np.zeros((*mapped.shape[:2], 2 * axes, 2 * axes))
    for axis in range(0, 2 * axes, 2):
        whole[:, :, axis : axis + 2, axis : axis + 2] = slope
    mean = np.matmul(whole, states.mean[..., None])[..., 0]
    mean[:, :, :2] = mapped
    covariance = np.matmul(np.matmul(whole, states.covariance), np.swapaxes(whole, -1, -2))
    return replace(states, mean=mean, covariance=_symmetric(covariance))


_BEHIND = 1e-3
"""Least depth of a mapped place, in units of that on the optical axis: places behind the camera are mapped far outside
the picture."""
