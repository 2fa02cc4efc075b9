"""The law of a random path, as filters and Cramer-Rao bounds over several frames want it: transitions and noises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Floats


@dataclass(frozen=True, eq=False)
class Dynamics:
    """x(k+1) = F x(k) + w, w ~ N(0, Q), from frame to frame, in one or several modes.

    state        names of the state's components; px and frames, or m and s for paths in metres
    transitions  (modes, d, d) F of each mode
    noises       (modes, d, d) Q of each mode
    switching    (modes, modes) chance of mode j at the next frame after mode i; rows sum to one
    """

    state: tuple[str, ...]
    transitions: Floats
    noises: Floats
    switching: Floats

    @classmethod
    def single(cls, state: tuple[str, ...], transition: Floats, noise: Floats) -> Dynamics:
        """A linear motion of one mode."""
        return cls(state, transition[None], noise[None], np.ones((1, 1)))


def constant_velocity(axes: tuple[str, ...], step: float = 1.0) -> Dynamics:
    """Steady motion without noise: each axis and its rate `v<axis>` over `step` frames or seconds."""
    state = tuple(name for axis in axes for name in (axis, f"v{axis}"))
    transition = np.kron(np.eye(len(axes)), np.array([[1.0, step], [0.0, 1.0]]))
    return Dynamics.single(state, transition, np.zeros_like(transition))
