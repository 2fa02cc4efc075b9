"""Paths whose turn rate jumps at random among a few values: a Markov chain of coordinated turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.base import Several
from irsim.config.quantities import Positive, Turning
from irsim.geometry.context import SceneContext
from irsim.motion.base import Dynamics, HeadedPath, HeadedPixelPath, constant_velocity, frames_of
from irsim.motion.curves import chord
from irsim.motion.random_turns import Frames, TurnRate
from irsim.rng import stream
from irsim.types import Floats


def coordinated_turn(rate: float, step: float = 1.0) -> Floats:
    """Return the transition matrix (4, 4) of (x, vx, y, vy) over a time `step` at a turn `rate`, rad per unit time,
    positive from x to y.

    Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, 11.7.1.
    """
    c, s = math.cos(rate * step), math.sin(rate * step)
    along = s / rate if rate else step
    across = (1 - c) / rate if rate else 0.0
    return np.array([[1, along, 0, -across], [0, c, 0, -s], [0, across, 1, along], [0, s, 0, c]])


@dataclass(frozen=True, eq=False)
class TurnRateChain:
    """Markov chain of turn rates that hold for whole frames.

    rates  (modes,) rad per frame, from the first axis to the second; the chain begins with the first
    hold   mean duration of a turn, frames; the next rate is drawn uniformly from the others
    """

    rates: Floats
    hold: float

    def places(
        self, frames: Floats, start: tuple[float, float], speed: float, heading: float, context: SceneContext, name: str
    ) -> Floats:
        """Return positions (n, 2) at frame numbers (n,), in any unit of length.

        start: position at frame 0; speed: distance per frame; heading: rad at frame 0, from the first axis to the
        second
        """
        frames = np.asarray(frames, dtype=np.float64)
        whole = np.maximum(np.floor(frames), 0).astype(np.int64)
        rates = self.drawn(int(whole.max(initial=0)) + 1, context, name)
        headings = heading + np.append(0.0, np.cumsum(rates))[:-1]
        ways = np.cumsum(chord(speed, headings, rates, np.ones(len(rates))), axis=0)
        places = np.concatenate([np.zeros((1, 2)), ways])
        rate = np.where(frames < 0, 0.0, rates[whole])
        return np.asarray(np.asarray(start) + places[whole] + chord(speed, headings[whole], rate, frames - whole))

    def drawn(self, count: int, context: SceneContext, name: str) -> Floats:
        """Return the turn rates (count,), rad per frame, of frames 0 .. count-1."""
        modes, mode = len(self.rates), 0
        chosen: list[int] = []
        for chance, drawn in stream(context.seed, name, "path").random((count, 2)).tolist():
            if chosen and modes > 1 and chance < 1 / self.hold:
                mode = (mode + 1 + int(drawn * (modes - 1))) % modes
            chosen.append(mode)
        return np.asarray(self.rates[chosen])

    @property
    def switching(self) -> Floats:
        """Transition probabilities (modes, modes) from mode i to mode j."""
        modes = len(self.rates)
        leave = 1 / self.hold if modes > 1 else 0.0
        switching = np.full((modes, modes), leave / max(modes - 1, 1))
        np.fill_diagonal(switching, 1 - leave)
        return switching


class Jump(HeadedPixelPath):
    """Constant speed in the picture, with a turn rate that jumps at random among a few values."""

    rates_deg: Annotated[Several[TurnRate], Field(min_length=1)] = (0.0, 4.0, -4.0)
    """Turn rates, degrees per frame, positive clockwise; the first holds at frame 0."""
    hold_frames: Frames = 30.0
    """Mean duration of a turn, frames; the next turn rate is drawn uniformly from the others."""

    @property
    def jumps(self) -> TurnRateChain:
        return TurnRateChain(np.radians(self.rates_deg), self.hold_frames)

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return self.jumps.places(frames, self.start, self.speed, math.radians(self.heading_deg), context, name)

    def dynamics(self, context: SceneContext) -> Dynamics:
        """Return one mode for each rate, without noise."""
        transitions = np.stack([coordinated_turn(math.radians(rate)) for rate in self.rates_deg])
        return Dynamics(("x", "vx", "y", "vy"), transitions, np.zeros_like(transitions), self.jumps.switching)


class JumpM(HeadedPath):
    """Level flight at constant speed, with a turn rate that jumps at random among a few values.

    The lateral acceleration is the speed times the turn rate in rad/s: 8 degrees a second at 200 m/s are 2.8 g.
    """

    rates_deg_s: Annotated[Several[Turning], Field(min_length=1)] = (0.0, 8.0, -8.0)
    """Turn rates, degrees a second, positive to the right; the first holds at frame 0."""
    hold_s: Positive = 3.0
    """Mean duration of a turn, s, at least one frame; the next turn rate is drawn uniformly from the others."""

    def jumps(self, context: SceneContext) -> TurnRateChain:
        return TurnRateChain(np.radians(self.rates_deg_s) / context.rate_hz, frames_of(self.hold_s, context))

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        speed = self.speed_m_s / context.rate_hz
        ahead, right = self.jumps(context).places(frames, (0.0, 0.0), speed, 0.0, context, name).T
        return self.displaced(ahead, right, self.climb(frames, context), context)

    def dynamics(self, context: SceneContext) -> Dynamics:
        """Return one mode for each rate, without noise. The state is in north, east and up, whatever `axes` is."""
        step, modes = 1 / context.rate_hz, len(self.rates_deg_s)
        transitions = np.zeros((modes, 6, 6))
        transitions[:, :4, :4] = [coordinated_turn(math.radians(rate), step) for rate in self.rates_deg_s]
        transitions[:, 4:, 4:] = constant_velocity(("up",), step).transitions
        state = ("north", "vnorth", "east", "veast", "up", "vup")
        return Dynamics(state, transitions, np.zeros_like(transitions), self.jumps(context).switching)
