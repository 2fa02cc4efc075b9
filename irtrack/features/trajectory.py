"""Velocity of a target from its last positions, and the similarity of two velocities.

Xue, Yuan, Xie 2011, section 2. Places are (..., k, 2) px, the oldest first; velocities (..., 2).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels

Speed = Literal["lambda", "sqrt_lambda"]


def pca_velocity(places: Floats, speed: Speed) -> Floats:
    """Return the velocity along the principal axis of the last positions (Algorithm 1).

    Its direction is that of the eigenvector of the largest eigenvalue lambda_max of their covariance (step 3, divided
    by k). The speed is proportional to lambda_max (step 5) or, by the text of section 2, to sqrt(lambda_max); the
    factor cancels in eq. 6. The paper leaves the vector's sign open; here it points from the first position to the
    last. Coincident positions have velocity 0.
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


def velocity_similarity(velocities: Floats, model: Floats) -> Floats:
    """Return the similarity (...), 0 .. 1, of velocities (..., 2) to the velocity `model` (2,) (eq. 6).

    It is the smaller speed over the larger, times the cosine between the directions, and 0 for a cosine below 0. Two
    velocities of 0 have similarity 1; a zero and a nonzero velocity have similarity 0.
    """
    speeds, pace = np.hypot(velocities[..., 0], velocities[..., 1]), float(np.hypot(*model))
    # min / max . cosine = dot / max^2, which needs no division by a speed of 0.
    larger, dot = np.maximum(speeds, pace), velocities @ model
    square = np.where(larger > 0, larger, 1.0) ** 2
    ratio: Floats = np.minimum(np.maximum(np.where(larger > 0, dot, square) / square, 0), 1)
    return ratio


def trajectory_similarity(trajectory: Floats, places: Floats, speed: Speed) -> Floats:
    """Return the similarity (N,) of a trajectory's velocity before and after adding each next position (N, 2) px.

    `trajectory` is (k, 2) px. The velocity after is that of its last k - 1 positions and the next position.
    """
    if COMPILED:
        out = np.empty(len(places))
        trajectory, places = (np.ascontiguousarray(each, np.float64) for each in (trajectory, places))
        kernels.trajectory_similarity(trajectory, places, speed == "sqrt_lambda", out)
        return out
    return _trajectory_similarity_plain(trajectory, places, speed)


def _trajectory_similarity_plain(trajectory: Floats, places: Floats, speed: Speed) -> Floats:
    tracks = np.empty((len(places) + 1, len(trajectory), 2))
    tracks[:-1, :-1], tracks[:-1, -1], tracks[-1] = trajectory[1:], places, trajectory
    velocities = pca_velocity(tracks, speed)
    return velocity_similarity(velocities[:-1], velocities[-1])


def line_fit(places: Floats) -> tuple[Floats, Floats]:
    """Fit a straight line to k positions (k, 2) px; return its position one frame ahead, px, and velocity, px/frame.

    Least squares give v = 12 / (k (k^2 - 1)) sum_i (i - mean i) x_i. A single position has velocity 0.
    """
    if COMPILED:
        ahead, velocity = np.empty(2), np.empty(2)
        kernels.line_fit(np.ascontiguousarray(places, np.float64), ahead, velocity)
        return ahead, velocity
    return _line_fit_plain(places)


def _line_fit_plain(places: Floats) -> tuple[Floats, Floats]:
    k = len(places)
    if k == 1:
        return places[0], np.zeros(2)
    steps = np.arange(k) - (k - 1) / 2
    velocity = 12 / (k * (k**2 - 1)) * (steps @ places)
    ahead: Floats = places.sum(axis=0) / k + (k + 1) / 2 * velocity
    return ahead, velocity
