"""Turns that jump at random from one rate to another: a Markov chain of coordinated turns."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.kinds import LARGEST, Degrees, Pair, PixelSpeed, Several
from irsim.motion.arcs import chord
from irsim.motion.base import PixelPath
from irsim.motion.dynamics import Dynamics
from irsim.rng import stream
from irsim.stage import Stage
from irsim.types import Floats

TurnRate = Annotated[float, Field(ge=-90, le=90)]


def coordinated_turn(rate: float) -> Floats:
    """(4, 4) F of (x, vx, y, vy) over a frame at `rate` rad per frame.

    Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, 11.7.1.
    """
    c, s = math.cos(rate), math.sin(rate)
    along = s / rate if rate else 1.0
    across = (1 - c) / rate if rate else 0.0
    return np.array([[1, along, 0, -across], [0, c, 0, -s], [0, across, 1, along], [0, s, 0, c]])


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

    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        whole = np.maximum(np.floor(frames), 0).astype(np.int64)
        rates = self._rates(int(whole.max(initial=0)) + 1, stage, name)
        headings = math.radians(self.heading_deg) + np.append(0.0, np.cumsum(rates))[:-1]
        ways = np.cumsum(chord(self.speed, headings, rates, np.ones(len(rates))), axis=0)
        places = np.concatenate([np.zeros((1, 2)), ways])
        part = frames - whole
        rate = np.where(frames < 0, 0.0, rates[whole])
        return np.asarray(np.asarray(self.start) + places[whole] + chord(self.speed, headings[whole], rate, part))

    def _rates(self, count: int, stage: Stage, name: str) -> Floats:
        """(count,) rad per frame, of the frames that begin at 0 .. count-1."""
        modes, mode = len(self.rates_deg), 0
        chosen: list[int] = []
        for chance, drawn in stream(stage.seed, name, "path").random((count, 2)).tolist():
            if chosen and modes > 1 and chance < 1 / self.hold_frames:
                mode = (mode + 1 + int(drawn * (modes - 1))) % modes
            chosen.append(mode)
        return np.asarray(np.radians(np.array(self.rates_deg)[chosen]))

    def dynamics(self, stage: Stage) -> Dynamics:
        """One mode for each rate; within a mode nothing is random."""
        modes = len(self.rates_deg)
        transitions = np.stack([coordinated_turn(math.radians(rate)) for rate in self.rates_deg])
        leave = 1 / self.hold_frames if modes > 1 else 0.0
        switching = np.full((modes, modes), leave / max(modes - 1, 1))
        np.fill_diagonal(switching, 1 - leave)
        return Dynamics(("x", "vx", "y", "vy"), transitions, np.zeros_like(transitions), switching)
