"""Motion models of a target's centre from one frame to the next. Distances are in px, times in frames."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Literal

import numpy as np

from irsim.types import Floats
from irtrack._native import COMPILED, kernels
from irtrack.filters.resampling import Indices

Propagation = Literal["gaussian", "disc"]
"""Distribution of particles within a radius: normal, of standard deviation radius / 3, or uniform over the disc."""

_STRAIGHT = 1e-4
"""Turn rate, rad/frame, below which sin(omega) / omega and related terms come from their series, to 1e-12."""


def random_walk(positions: Floats, radius: float, propagation: Propagation, rng: np.random.Generator) -> Floats:
    """Draw positions (N, 2) px about `positions` (N, 2), within a radius in px (normal: 98.9 % of them)."""
    if propagation == "gaussian":
        return positions + radius / 3 * rng.standard_normal(positions.shape)
    distance, angle = radius * np.sqrt(rng.random(len(positions))), 2 * pi * rng.random(len(positions))
    places: Floats = positions + np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
    return places


def random_walk_variance(radius: float, propagation: Propagation) -> float:
    """Return the variance on each axis of `random_walk`, px^2."""
    return (radius / 3) ** 2 if propagation == "gaussian" else radius**2 / 4


def random_walk_density(places: Floats, origins: Floats, radius: float, propagation: Propagation) -> Floats:
    """Return the density (N,) per px^2 of `random_walk` at `places` (N, 2), from equally likely `origins` (M, 2) px."""
    square = ((places[:, None] - origins[None]) ** 2).sum(axis=2)
    if propagation == "disc":
        inside: Floats = (square <= radius**2).mean(axis=1) / (pi * radius**2)
        return inside
    variance = (radius / 3) ** 2
    density: Floats = np.exp(-square / (2 * variance)).mean(axis=1) / (2 * pi * variance)
    return density


def ar2(
    positions: Floats, previous: Floats, ancestors: Indices, damping: float, deviation: Floats, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Draw x_t = x_{t-1} + damping (x_{t-1} - x_{t-2}) + u; return x_t and x_{t-1}, (n, 2) px each.

    positions and previous are x_{t-1}, x_{t-2} (N, 2) px, of which those at the indices `ancestors` (n,) move; u is
    normal with standard deviations `deviation` (n,) px. Second-order autoregression (Cheng et al. 2006, eq. 4, where
    damping is 1). With damping 1 and a deviation R, x has after n frames the deviation R sqrt(n (n+1) (2n+1) / 6).
    """
    normals = rng.standard_normal((len(ancestors), 2))
    if COMPILED:
        moved, before = np.empty_like(normals), np.empty_like(normals)
        kernels.ar2(positions, previous, ancestors, damping, deviation, normals, moved, before)
        return moved, before
    origins = positions.take(ancestors, axis=0)
    return origins + damping * (origins - previous.take(ancestors, axis=0)) + deviation[:, None] * normals, origins


def constant_velocity(acceleration: float) -> tuple[Floats, Floats]:
    """Return transition F and process noise Q (4, 4) of the state (x, y, vx, vy) over one frame.

    Discrete white-noise acceleration of standard deviation `acceleration` px/frame^2 (Bar-Shalom, Li, Kirubarajan,
    "Estimation with Applications to Tracking and Navigation", 2001, eq. 6.3.2-4).
    """
    eye = np.eye(2)
    transition = np.block([[eye, eye], [np.zeros((2, 2)), eye]])
    noise = acceleration**2 * np.block([[eye / 4, eye / 2], [eye / 2, eye]])
    return transition, noise


def coordinated_turn(state: Floats) -> tuple[Floats, Floats]:
    """Return the state (x, y, vx, vy, omega) a frame ahead, and its Jacobian (5, 5).

    Constant speed and turn rate omega, rad/frame from +x towards +y (Bar-Shalom, Li, Kirubarajan 2001, eq. 11.7.1-4
    and 11.7.2-3).
    """
    x, y, vx, vy, w = state.tolist()
    s, c = sin(w), cos(w)
    if abs(w) < _STRAIGHT:
        along, across = 1 - w * w / 6, w / 2
        d_along, d_across = -w / 3, 0.5 - w * w / 8
    else:
        along, across = s / w, (1 - c) / w
        d_along, d_across = (c - along) / w, (s - across) / w
    moved = np.array([x + along * vx - across * vy, y + across * vx + along * vy, c * vx - s * vy, s * vx + c * vy, w])
    jacobian = np.array(
        [
            [1, 0, along, -across, d_along * vx - d_across * vy],
            [0, 1, across, along, d_across * vx + d_along * vy],
            [0, 0, c, -s, -s * vx - c * vy],
            [0, 0, s, c, c * vx - s * vy],
            [0, 0, 0, 0, 1],
        ]
    )
    return moved, jacobian


def turn_noise(acceleration: float, turn_rate: float) -> Floats:
    """Return Q (5, 5) for standard deviations of acceleration, px/frame^2, and turn-rate change, rad/frame^2."""
    noise = np.zeros((5, 5))
    noise[:4, :4] = constant_velocity(acceleration)[1]
    noise[4, 4] = turn_rate**2
    return noise
