"""Turns that jump at random from one rate to another: a Markov chain of coordinated turns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.base import Several
from irsim.config.quantities import LARGEST, Degrees, Pair, PixelSpeed, Positive, Turning
from irsim.geometry.context import SceneContext
from irsim.motion.arcs import chord
from irsim.motion.base import PixelPath
from irsim.motion.dynamics import Dynamics, constant_velocity
from irsim.motion.headed import HeadedPath, frames_of
from irsim.rng import stream
from irsim.types import Floats

TurnRate = Annotated[float, Field(ge=-90, le=90)]


def coordinated_turn(rate: float, step: float = 1.0) -> Floats:
    """(4, 4) F of (x, vx, y, vy) over a step of time at `rate` rad per unit of it, positive from x to y.

    Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, 11.7.1.
    """
    c, s = math.cos(rate * step), math.sin(rate * step)
    along = s / rate if rate else step
    across = (1 - c) / rate if rate else 0.0
    return np.array([[1, along, 0, -across], [0, c, 0, -s], [0, across, 1, along], [0, s, 0, c]])


@dataclass(frozen=True, eq=False)
class Jumps:
    """Turn rates that hold for whole frames and jump.

    rates  (modes,) rad per frame, from the first axis to the second; it begins with the first
    hold   mean length of a turn, frames; the next is drawn evenly from the other rates
    """

    rates: Floats
    hold: float

    def places(
        self, frames: Floats, start: tuple[float, float], speed: float, heading: float, context: SceneContext, name: str
    ) -> Floats:
        """(n, 2) at frame numbers (n,), in any unit of length.

        start: at frame 0;  speed: length per frame;  heading: rad at frame 0, from the first axis to the second
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
        """(count,) rad per frame, of the frames that begin at 0 .. count-1."""
        modes, mode = len(self.rates), 0
        chosen: list[int] = []
        for chance, drawn in stream(context.seed, name, "path").random((count, 2)).tolist():
            if chosen and modes > 1 and chance < 1 / self.hold:
                mode = (mode + 1 + int(drawn * (modes - 1))) % modes
            chosen.append(mode)
        return np.asarray(self.rates[chosen])

    @property
    def switching(self) -> Floats:
        """(modes, modes) chance of mode j at the next frame after mode i."""
        modes = len(self.rates)
        leave = 1 / self.hold if modes > 1 else 0.0
        switching = np.full((modes, modes), leave / max(modes - 1, 1))
        np.fill_diagonal(switching, 1 - leave)
        return switching


class Jump(PixelPath):
    """Constant speed, at a turn rate that jumps at random among a few."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """Px per frame."""
    heading_deg: Degrees = 0.0
    """Direction at frame 0, degrees: 0 right, 90 down."""
    rates_deg: Annotated[Several[TurnRate], Field(min_length=1)] = (0.0, 4.0, -4.0)
    """Turn rates, degrees per frame, positive clockwise; it begins with the first."""
    hold_frames: Annotated[float, Field(ge=1, le=LARGEST)] = 30.0
    """Mean length of a turn, frames; the next is drawn evenly from the other rates."""

    @property
    def jumps(self) -> Jumps:
        return Jumps(np.radians(self.rates_deg), self.hold_frames)

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        return self.jumps.places(frames, self.start, self.speed, math.radians(self.heading_deg), context, name)

    def dynamics(self, context: SceneContext) -> Dynamics:
        """One mode for each rate; within a mode nothing is random."""
        transitions = np.stack([coordinated_turn(math.radians(rate)) for rate in self.rates_deg])
        return Dynamics(("x", "vx", "y", "vy"), transitions, np.zeros_like(transitions), self.jumps.switching)


class JumpM(HeadedPath):
    """Level flight at constant speed in space, at a turn rate that jumps at random among a few.

    It pulls speed_m_s times the turn rate in rad/s: 8 degrees a second at 200 m/s are 2.8 g.
    """

    rates_deg_s: Annotated[Several[Turning], Field(min_length=1)] = (0.0, 8.0, -8.0)
    """Turn rates, degrees a second, positive to the right; it begins with the first."""
    hold_s: Positive = 3.0
    """Mean length of a turn, s, no less than a frame; the next is drawn evenly from the other rates."""

    def jumps(self, context: SceneContext) -> Jumps:
        return Jumps(np.radians(self.rates_deg_s) / context.rate_hz, frames_of(self.hold_s, context))

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        speed = self.speed_m_s / context.rate_hz
        ahead, right = self.jumps(context).places(frames, (0.0, 0.0), speed, 0.0, context, name).T
        return self.laid(ahead, right, self.climbed(frames, context), context)

    def dynamics(self, context: SceneContext) -> Dynamics:
        """One mode for each rate; within a mode nothing is random. The state lies along the world's axes, in which the
        turns are level, whatever `axes`."""
        step, modes = 1 / context.rate_hz, len(self.rates_deg_s)
        transitions = np.zeros((modes, 6, 6))
        transitions[:, :4, :4] = [coordinated_turn(math.radians(rate), step) for rate in self.rates_deg_s]
        transitions[:, 4:, 4:] = constant_velocity(("up",), step).transitions
        state = ("north", "vnorth", "east", "veast", "up", "vup")
        return Dynamics(state, transitions, np.zeros_like(transitions), self.jumps(context).switching)
