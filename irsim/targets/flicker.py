"""Brightness that changes over time: blinking lights, beating plumes, the twinkle of what tumbles."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind
from irsim.config.quantities import Fraction, NotNegative, Positive
from irsim.rng import stream


class Flicker(Kind):
    """How a target's brightness changes over time."""

    @abstractmethod
    def factor(self, time: float, seed: int, name: str) -> float:
        """Factor of all its light at a time, s; random ones are addressed by seed and the target's name."""


class Steady(Flicker):
    """Always as bright."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0


class Blink(Flicker):
    """Bright and dim by turns."""

    period_s: Positive = 1.0
    """From one flash to the next, s."""
    bright: Annotated[float, Field(gt=0, lt=1)] = 0.5
    """Share of the period that it is bright."""
    dim: NotNegative = 0.5
    """Factor while it is dim; above 1 it is then brighter."""
    phase: Fraction = 0.0
    """Place in the period in frame 0; a period begins bright."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0 if (time / self.period_s + self.phase) % 1.0 < self.bright else self.dim


class Wave(Flicker):
    """A sine about its usual brightness."""

    hz: Positive = 1.0
    """Waves a second."""
    depth: Fraction = 0.3
    """The largest change, a share of the brightness."""
    phase: Fraction = 0.0
    """Place in the wave in frame 0; a wave begins rising from the middle."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0 + self.depth * math.sin(2 * math.pi * (self.hz * time + self.phase))


class Flutter(Flicker):
    """At random, log-normal with mean 1, like a flame.

    Between knots a time `correlation_s` apart the logarithm turns from one normal number to the next:
    cos(a) n_k + sin(a) n_(k+1), a from 0 to a right angle, so that its variance is the same at all times.
    """

    rms: Annotated[float, Field(ge=0, le=2)] = 0.2
    """Standard deviation of the logarithm of the brightness."""
    correlation_s: Positive = 0.1
    """Time in which the brightness changes to another, s."""

    def factor(self, time: float, seed: int, name: str) -> float:
        place = time / self.correlation_s
        knot = math.floor(place)
        angle = (place - knot) * math.pi / 2
        here, there = (float(stream(seed, name, "flutter", number).standard_normal()) for number in (knot, knot + 1))
        normal = math.cos(angle) * here + math.sin(angle) * there
        return math.exp(self.rms * normal - self.rms**2 / 2)


FLICKERS = Family("flicker", Flicker, {"steady": Steady, "blink": Blink, "wave": Wave, "flutter": Flutter})
