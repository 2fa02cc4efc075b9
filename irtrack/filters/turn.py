"""The coordinated turn: constant speed, a turn rate that wanders. Lengths in px, time in frames.

Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation",
2001, section 11.7.1 and 11.7.2; the state is (x, y, vx, vy, omega), omega in rad/frame from +x towards +y.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from irsim.types import Floats
from irtrack.filters.motion import constant_velocity

_STRAIGHT = 1e-4
"""rad/frame. Below, sin(omega) / omega and its like are taken from their series: of their terms of third
order, omega^3 < 1e-12 is left out."""


def coordinated_turn(state: Floats) -> tuple[Floats, Floats]:
    """The state (5,) a frame on (eq. 11.7.1-4), and the Jacobian (5, 5) of that (eq. 11.7.2-3)."""
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
    """Q (5, 5): accelerations of standard deviation px/frame^2, and a turn rate that moves by rad/frame a frame."""
    noise = np.zeros((5, 5))
    noise[:4, :4] = constant_velocity(acceleration)[1]
    noise[4, 4] = turn_rate**2
    return noise
