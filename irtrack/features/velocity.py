"""The velocity of a target out of its last places, and how like two velocities are.

Xue, Yuan, Xie 2011, section 2. Places are (..., k, 2) px, the oldest first; velocities (..., 2).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels

Speed = Literal["lambda", "sqrt_lambda"]


def pca_velocity(places: Floats, speed: Speed) -> Floats:
    """Velocity along the principal axis of the places (Algorithm 1).

    The covariance of the k places (step 3, divided by k) has the largest eigenvalue lambda_max; the
    direction is that of its vector, and the speed is proportional to lambda_max (step 5) or, as the
    text of section 2 says, to the axis' length, sqrt(lambda_max); the factor cancels in eq. 6. The
    algorithm leaves the vector's sign open: here it points from the first place to the last. Places
    that coincide have no velocity, 0.
    """
    k = places.shape[-2]
    off = places - places.sum(axis=-2, keepdims=True) / k
    covariance = np.einsum("...ki,...kj->...ij", off, off) / k
    xx, xy, yy = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    half = (xx - yy) / 2
    largest = (xx + yy) / 2 + np.hypot(half, xy)
    angle = np.arctan2(xy, half) / 2
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    forward = ((places[..., -1, :] - places[..., 0, :]) * axis).sum(axis=-1) >= 0
    length = largest if speed == "lambda" else np.sqrt(largest)
    velocity: Floats = (np.where(forward, length, -length))[..., None] * axis
    return velocity


def similarity(velocities: Floats, model: Floats) -> Floats:
    """(...) likeness of velocities (..., 2) to one (2,), 0 .. 1 (eq. 6).

    min of the speeds over their max, times the cosine between the directions. The text says 0 .. 1,
    but a cosine reaches -1: what points backwards counts 0. Two targets at rest are alike, 1; one at
    rest and one that moves are not, 0.
    """
    speeds, pace = np.hypot(velocities[..., 0], velocities[..., 1]), float(np.hypot(*model))
    # min / max . cosine = dot / max^2, which needs no division by a speed of 0.
    larger, dot = np.maximum(speeds, pace), velocities @ model
    square = np.where(larger > 0, larger, 1.0) ** 2
    alike: Floats = np.minimum(np.maximum(np.where(larger > 0, dot, square) / square, 0), 1)
    return alike


def velocity_likeness(trajectory: Floats, places: Floats, speed: Speed) -> Floats:
    """(N,) likeness of the velocity that each of the places (N, 2) px would give a trajectory (k, 2) in the next
    frame, to the one that it has."""
    if COMPILED:
        alike = np.empty(len(places))
        trajectory, places = (np.ascontiguousarray(each, np.float64) for each in (trajectory, places))
        kernels.velocity_likeness(trajectory, places, speed == "sqrt_lambda", alike)
        return alike
    return _velocity_likeness_plain(trajectory, places, speed)


def _velocity_likeness_plain(trajectory: Floats, places: Floats, speed: Speed) -> Floats:
    tracks = np.empty((len(places) + 1, len(trajectory), 2))
    tracks[:-1, :-1], tracks[:-1, -1], tracks[-1] = trajectory[1:], places, trajectory
    velocities = pca_velocity(tracks, speed)
    return similarity(velocities[:-1], velocities[-1])


def line(places: Floats) -> tuple[Floats, Floats]:
    """The straight line through k places (k, 2): where it is one frame on, px, and its velocity, px/frame.

    By least squares, v = 12 / (k (k^2 - 1)) sum_i (i - mean i) x_i; of one place: that place, at rest.
    """
    if COMPILED:
        ahead, velocity = np.empty(2), np.empty(2)
        kernels.line(np.ascontiguousarray(places, np.float64), ahead, velocity)
        return ahead, velocity
    return _line_plain(places)


def _line_plain(places: Floats) -> tuple[Floats, Floats]:
    k = len(places)
    if k == 1:
        return places[0], np.zeros(2)
    steps = np.arange(k) - (k - 1) / 2
    velocity = 12 / (k * (k**2 - 1)) * (steps @ places)
    ahead: Floats = places.sum(axis=0) / k + (k + 1) / 2 * velocity
    return ahead, velocity
