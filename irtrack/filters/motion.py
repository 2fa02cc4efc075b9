"""How a target's centre moves from one frame to the next. Lengths in px, time in frames."""

from __future__ import annotations

from math import pi
from typing import Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Floats
from irtrack._native import COMPILED, kernels

Propagation = Literal["gaussian", "disc"]
"""How particles spread within a radius: normal, of a third of it; or even over the disc."""


def random_walk(positions: Floats, radius: float, propagation: Propagation, rng: np.random.Generator) -> Floats:
    """Places (N, 2) px spread about where they were, within a radius in px (normal: 98.9 % of them)."""
    if propagation == "gaussian":
        return positions + radius / 3 * rng.standard_normal(positions.shape)
    distance, angle = radius * np.sqrt(rng.random(len(positions))), 2 * pi * rng.random(len(positions))
    spread: Floats = positions + np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
    return spread


def random_walk_density(places: Floats, origins: Floats, radius: float, propagation: Propagation) -> Floats:
    """(N,) density per px^2 of `random_walk` at places (N, 2) px from origins (M, 2), each as likely."""
    square = ((places[:, None] - origins[None]) ** 2).sum(axis=2)
    if propagation == "disc":
        inside: Floats = (square <= radius**2).mean(axis=1) / (pi * radius**2)
        return inside
    variance = (radius / 3) ** 2
    density: Floats = np.exp(-square / (2 * variance)).mean(axis=1) / (2 * pi * variance)
    return density


def ar2(positions: Floats, previous: Floats, damping: float, noise: Floats) -> Floats:
    """x_t = x_{t-1} + damping (x_{t-1} - x_{t-2}) + u for x (N, 2), u (N, 2) px.

    Second-order autoregression (Cheng et al. 2006, eq. 4, where damping is 1). With damping 1 and
    noise of deviation R the spread after n frames is R sqrt(n (n+1) (2n+1) / 6).
    """
    return positions + damping * (positions - previous) + noise


def ar2_drawn(
    positions: Floats,
    previous: Floats,
    chosen: npt.NDArray[np.intp],
    damping: float,
    deviation: Floats,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """`ar2` of the particles `chosen` (n,) among positions and previous ones (N, 2) px, their noise normal of a
    deviation (n,) px: where they are (n, 2), and where they come from."""
    normals = rng.standard_normal((len(chosen), 2))
    if not COMPILED:
        return _ar2_drawn_plain(positions, previous, chosen, damping, deviation, normals)
    moved, origins = np.empty_like(normals), np.empty_like(normals)
    kernels.ar2_drawn(positions, previous, chosen, damping, deviation, normals, moved, origins)
    return moved, origins


def _ar2_drawn_plain(
    positions: Floats,
    previous: Floats,
    chosen: npt.NDArray[np.intp],
    damping: float,
    deviation: Floats,
    normals: Floats,
) -> tuple[Floats, Floats]:
    origins = positions.take(chosen, axis=0)
    return ar2(origins, previous.take(chosen, axis=0), damping, deviation[:, None] * normals), origins


def constant_velocity(acceleration: float) -> tuple[Floats, Floats]:
    """Transition F and process noise Q (4, 4) of the state (x, y, vx, vy) over one frame.

    Discrete white-noise acceleration of standard deviation `acceleration` px/frame^2 (Bar-Shalom,
    Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, eq. 6.3.2-4).
    """
    eye = np.eye(2)
    transition = np.block([[eye, eye], [np.zeros((2, 2)), eye]])
    noise = acceleration**2 * np.block([[eye / 4, eye / 2], [eye / 2, eye]])
    return transition, noise
