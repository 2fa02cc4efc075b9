"""Non-uniformity that grows after a correction, until the next one takes it away."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.detector.ar1 import Process
from irsim.detector.base import Moment, Noise, Ratio, read_only
from irsim.detector.terms import Term, over
from irsim.detector.variance import Variance
from irsim.kinds import Switches
from irsim.quantities import Fraction, NotNegative
from irsim.types import Floats

COARSE = 0.004
"""The drift is drawn at nodes at most this share of its time constant apart; straight lines between them lack two
thousandths of the variance that it tends to, at most."""

STAIRS = 4
"""Steps from node to node in which it goes along that line: each is about a fiftieth of the sigma it tends to."""


class Drift(Noise):
    """Offset and gain of each pixel wander off after a correction, and are drawn back: mean-reverting.

    Each is D[k] = X[k] - rho^(k-c) X[c], with X a stationary Ornstein-Uhlenbeck process and c the frame of
    the last correction: from 0 it grows to the sigmas below as 1 - rho^(2(k-c)) in variance.
    """

    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("pixel", "column", "row", "gain")}

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

    def gains(self, moment: Moment) -> Floats | None:
        return self._now(moment, (("gain", "pixel", self.gain),)) if self.gain else None

    def steady(self, moment: Moment) -> Floats | None:
        terms: tuple[Term, ...] = (
            ("pixel", "pixel", self.pixel),
            ("column", "column", self.column),
            ("row", "row", self.row),
        )
        terms = tuple(term for term in terms if term[2])
        return self._now(moment, terms) if terms else None

    def share(self, moment: Moment, fixed: bool) -> Variance:
        if not fixed:
            return Variance()
        decay, since = self._course(moment)
        grown = -math.expm1(-2 * decay * (moment.index - since))
        return Variance(own=grown * (self.pixel**2 + self.column**2 + self.row**2), gain=grown * self.gain**2)

    def _course(self, moment: Moment) -> tuple[float, int]:
        """Decay a frame, and the frame of the last correction (below 0 where it was before frame 0)."""
        since = moment.corrected if moment.corrections else -round(self.age_s * moment.rate_hz)
        return 1 / (moment.rate_hz * self.time_constant_s), since

    def _now(self, moment: Moment, terms: tuple[Term, ...]) -> Floats:
        """The sum of the terms' D at this frame, (rows, cols)."""
        decay, since = self._course(moment)
        stays = max(_step(decay) // STAIRS, 1)
        index = max(moment.index - moment.index % stays, since)
        return _between(decay, moment.shape, moment.seed, self.name, terms, since, index)


def _step(decay: float) -> int:
    """Frames from node to node: a power of two, as are the chunks of frames that processes render (`irsim.crew`)."""
    return 1 << max(int(COARSE / decay), 1).bit_length() - 1


@lru_cache(maxsize=4)
def _between(
    decay: float, shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], since: int, index: int
) -> Floats:
    """The sum of the terms' D at a frame, on the straight line between the nodes before and after it."""
    step, node = _step(decay), index // _step(decay)
    start, end = max(node * step, since), (node + 1) * step
    share = (end - index) / (end - start)
    before, after = (_deviation(decay, shape, seed, name, terms, since, at) for at in (start, end))
    return read_only(np.asarray(cv2.addWeighted(before, share, after, 1 - share, 0)))


@lru_cache(maxsize=8)
def _deviation(
    decay: float, shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], since: int, index: int
) -> Floats:
    """The sum of the terms' D at a node, or at the correction itself."""
    total = np.zeros(shape, np.float32)
    kept = np.float32(math.exp(-decay * (index - since)))
    for term, what, sigma in terms:
        key = (decay, over(shape, what), seed, name, term)
        total += np.float32(sigma) * (_at(*key, index) - kept * _at(*key, since))
    return read_only(total)


@lru_cache(maxsize=8)
def _at(decay: float, shape: tuple[int, int], seed: int, name: str, term: str, index: int) -> Floats:
    """X at a frame: at a node, or on the straight line between two."""
    process = _process(decay, shape, seed, name, term)
    node, beyond = divmod(index, _step(decay))
    before = process.frame(node)
    if not beyond:
        return before
    share = np.float32(beyond / _step(decay))
    return read_only(before + share * (process.frame(node + 1) - before))


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str, term: str) -> Process:
    return Process(decay * _step(decay), shape, seed, "noise", name, term)
