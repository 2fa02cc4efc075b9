"""Brightness over time: blinking lights, pulsating plumes, glints of tumbling objects."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Annotated

from pydantic import Field

from irsim.config.base import Family, Kind
from irsim.config.quantities import Fraction, NotNegative, Positive
from irsim.rng import stream


class Flicker(Kind):
    """Change of a target's brightness over time."""

    @abstractmethod
    def factor(self, time: float, seed: int, name: str) -> float:
        """Return the factor on the radiance at a time, s; random kinds draw from the stream addressed by `seed` and the
        target's id, `name`."""


class Steady(Flicker):
    """Constant brightness."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0


class Blink(Flicker):
    """Square wave between two brightnesses."""

    period_s: Positive = 1.0
    """Period, s."""
    bright: Annotated[float, Field(gt=0, lt=1)] = 0.5
    """Share of the period at the nominal brightness."""
    dim: NotNegative = 0.5
    """Brightness factor in the rest of the period; above 1 the rest is brighter."""
    phase: Fraction = 0.0
    """Phase in frame 0, as a share of the period; the period begins at the nominal brightness."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0 if (time / self.period_s + self.phase) % 1.0 < self.bright else self.dim


class Wave(Flicker):
    """Sinusoidal variation around the nominal brightness."""

    hz: Positive = 1.0
    """Frequency, Hz."""
    depth: Fraction = 0.3
    """Amplitude, as a share of the nominal brightness."""
    phase: Fraction = 0.0
    """Phase in frame 0, as a share of the period; the period begins at the mean brightness, rising."""

    def factor(self, time: float, seed: int, name: str) -> float:
        return 1.0 + self.depth * math.sin(2 * math.pi * (self.hz * time + self.phase))


class Flutter(Flicker):
    """Random log-normal variation with mean 1, for example of a flame.

    The logarithm interpolates standard normal numbers n_k at knots `correlation_s` apart: cos(a) n_k + sin(a) n_(k+1).
    The angle a runs from 0 to pi/2, so the variance is constant.
    """

    rms: Annotated[float, Field(ge=0, le=2)] = 0.2
    """Standard deviation of the logarithm of the brightness."""
    correlation_s: Positive = 0.1
    """Correlation time, s."""

    def factor(self, time: float, seed: int, name: str) -> float:
        place = time / self.correlation_s
        knot = math.floor(place)
        angle = (place - knot) * math.pi / 2
        here, there = (float(stream(seed, name, "flutter", number).standard_normal()) for number in (knot, knot + 1))
        normal = math.cos(angle) * here + math.sin(angle) * there
        return math.exp(self.rms * normal - self.rms**2 / 2)


FLICKERS = Family("flicker", Flicker, {"steady": Steady, "blink": Blink, "wave": Wave, "flutter": Flutter})
