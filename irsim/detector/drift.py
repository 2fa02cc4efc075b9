"""Non-uniformity that grows after a correction, until the next one takes it away."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated

import cv2
import numpy as np
from pydantic import Field

from irsim.detector.ar1 import Over, Process, over
from irsim.detector.base import Moment, Noise, Ratio, read_only
from irsim.detector.response import Response
from irsim.detector.scratch import scratch
from irsim.kinds import Fraction, NotNegative
from irsim.types import Floats

COARSE = 0.002
"""The drift is drawn at nodes this share of its time constant apart; straight lines between them lack a thousandth
of the variance that it tends to, at most."""


class Drift(Noise):
    """Offset and gain of each pixel wander off after a correction, and are drawn back: mean-reverting.

    Each is D[k] = X[k] - rho^(k-c) X[c], with X a stationary Ornstein-Uhlenbeck process and c the frame of
    the last correction: from 0 it grows to the sigmas below as 1 - rho^(2(k-c)) in variance.
    """

    pixel: Ratio = 0.5
    """Sigma from pixel to pixel that offsets tend to, in units of the camera's NETD."""
    column: Ratio = 0.25
    """Sigma from column to column that offsets tend to, in units of the camera's NETD."""
    row: Ratio = 0.1
    """Sigma from row to row that offsets tend to, in units of the camera's NETD."""
    gain: Fraction = 0.0
    """Sigma from pixel to pixel that gains tend to, as a share of the signal."""
    time_constant_s: Annotated[float, Field(gt=0, le=1e6)] = 600.0
    """Time in which a deviation falls to 1/e on average, s."""
    age_s: NotNegative = 0.0
    """Time from the last correction to frame 0, s."""

    def respond(self, signal: Floats, response: Response, moment: Moment) -> None:
        if self.gain:
            gain = scratch(moment.shape, "gain")
            gain.fill(1)
            for scale, drawn in self._sum("gain", "pixel", moment):
                cv2.scaleAdd(drawn, self.gain * scale, gain, dst=gain)
            cv2.multiply(signal, gain, dst=signal)
            if response.zero:  # what dark pixels give has no gain
                cv2.addWeighted(gain, -response.zero, signal, 1, response.zero, dst=signal)

    def add(self, signal: Floats, response: Response, moment: Moment) -> None:
        if self.pixel:
            for scale, drawn in self._sum("pixel", "pixel", moment):
                cv2.scaleAdd(drawn, self.pixel * response.noise * scale, signal, dst=signal)
        lines: tuple[tuple[Over, float], ...] = (("column", self.column), ("row", self.row))
        for what, sigma in lines:
            if sigma:
                line = sum(np.float32(scale) * drawn for scale, drawn in self._sum(what, what, moment))
                np.add(signal, line * np.float32(sigma * response.noise), out=signal)

    def variance(self, signal: Floats, response: Response, moment: Moment, fixed: bool) -> Floats | float:
        if not fixed:
            return 0.0
        decay, since = self._course(moment)
        grown = -math.expm1(-2 * decay * (moment.index - since))
        offsets = (self.pixel**2 + self.column**2 + self.row**2) * response.noise**2
        return grown * (offsets + (self.gain * (signal.astype(np.float64) - response.zero)) ** 2)

    def _course(self, moment: Moment) -> tuple[float, int]:
        """Decay a frame, and the frame of the last correction (below 0 where it was before frame 0)."""
        since = moment.corrected if moment.corrections else -round(self.age_s * moment.rate_hz)
        return 1 / (moment.rate_hz * self.time_constant_s), since

    def _sum(self, term: str, what: Over, moment: Moment) -> list[tuple[float, Floats]]:
        """The terms, factor and array, whose sum is D at this frame."""
        decay, since = self._course(moment)
        shape = over(moment.shape, what)
        key = (decay, shape, moment.seed, self.name, term)
        terms = [(share, _node(*key, node)) for node, share in _between(moment.index, decay)]
        kept = math.exp(-decay * (moment.index - since))
        return [*terms, (-kept, _at(*key, since))] if kept > 1e-6 else terms


def _between(index: int, decay: float) -> list[tuple[int, float]]:
    """Nodes on both sides of a frame and their shares in it."""
    step = max(int(COARSE / decay), 1)
    node, beyond = divmod(index, step)
    return [(node, 1 - beyond / step), (node + 1, beyond / step)] if beyond else [(node, 1.0)]


@lru_cache(maxsize=8)
def _at(decay: float, shape: tuple[int, int], seed: int, name: str, term: str, index: int) -> Floats:
    """X at a frame."""
    nodes = [(share, _node(decay, shape, seed, name, term, node)) for node, share in _between(index, decay)]
    return read_only(np.asarray(sum(np.float32(share) * drawn for share, drawn in nodes)))


@lru_cache(maxsize=16)
def _node(decay: float, shape: tuple[int, int], seed: int, name: str, term: str, node: int) -> Floats:
    return _process(decay, shape, seed, name, term).frame(node)


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str, term: str) -> Process:
    return Process(decay * max(int(COARSE / decay), 1), shape, seed, "noise", name, term)
