"""Non-uniformity that grows after a correction, until the next one takes it away."""

from __future__ import annotations

import math
from functools import lru_cache, reduce
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from irsim.camera.drift_process import Departure
from irsim.camera.noise_base import FrameContext, Noise, Ratio, read_only
from irsim.camera.process import numbers
from irsim.camera.terms import Term, over
from irsim.camera.variance import Variance
from irsim.config.base import Switches
from irsim.config.quantities import Fraction, NotNegative
from irsim.types import Floats

COARSE = 0.004
"""The drift is drawn anew at most this share of its time constant apart, and stays so meanwhile."""

LEAP = 0.1
"""Steps are at most so much of the NETD in sigma, unless a frame's is more: finer ones tell no one more about a drift
that is seen through the camera's noise (300 frames of `uncooled_lwir`, steps of 2 frames: `irsim noise` finds what went
in; of 8, with straight lines between, a fifth less of the drift)."""

BRIGHT = 1700.0
"""The signal by which gains are judged, in units of the NETD: that of three million electrons, half of what a well for
long exposures holds, where shot noise is all that there is."""


class Drift(Noise):
    """Offset and gain of each pixel wander off after a correction, and are drawn back: mean-reverting.

    Each is an Ornstein-Uhlenbeck process that is 0 at the frame c of the last correction: it grows to the sigmas
    below as 1 - rho^(2(k-c)) in variance. Frames are counted by the steps in which it is drawn.
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

    def gains(self, frame_context: FrameContext) -> Floats | None:
        return self._now(frame_context, (("gain", "pixel", self.gain),)) if self.gain else None

    def steady(self, frame_context: FrameContext) -> Floats | None:
        terms: tuple[Term, ...] = (
            ("pixel", "pixel", self.pixel),
            ("column", "column", self.column),
            ("row", "row", self.row),
        )
        terms = tuple(term for term in terms if term[2])
        return self._now(frame_context, terms) if terms else None

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        if not fixed:
            return Variance()
        decay, since, now = self._course(frame_context)
        grown = -math.expm1(-2 * decay * (now - since))
        return Variance(own=grown * (self.pixel**2 + self.column**2 + self.row**2), gain=grown * self.gain**2)

    def _course(self, frame_context: FrameContext) -> tuple[float, int, int]:
        """Decay a step, and the steps of the last correction (below 0 where that was before frame 0) and this frame."""
        since = frame_context.corrected if frame_context.corrections else -round(self.age_s * frame_context.rate_hz)
        decay = 1 / (frame_context.rate_hz * self.time_constant_s)
        step = _step(decay, math.hypot(self.pixel, self.column, self.row, self.gain * BRIGHT))
        return decay * step, since // step, frame_context.index // step

    def _now(self, frame_context: FrameContext, terms: tuple[Term, ...]) -> Floats:
        """The sum of the terms' D at this frame, broadcastable to (rows, cols)."""
        return _deviation(frame_context.shape, frame_context.seed, self.name, terms, *self._course(frame_context))


def _step(decay: float, sigma: float) -> int:
    """Frames that a step takes: a power of two, as are the chunks of frames that processes render (`irsim.render.workers`)."""
    most = min(COARSE / decay, LEAP**2 / (2 * decay * sigma**2) if sigma else math.inf)
    return 1 << max(int(most), 1).bit_length() - 1


@lru_cache(maxsize=4)
def _deviation(
    shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], decay: float, since: int, now: int
) -> Floats:
    """The sum of the terms' D at a step, broadcastable to the shape."""
    gone = (
        numbers(_process(decay, over(shape, what), seed, name, term, since).frame(now - since)) * np.float32(sigma)
        for term, what, sigma in terms
    )
    return read_only(reduce(_plus, gone))


def _plus(total: Floats, term: Floats) -> Floats:
    """Their sum, in the memory of the total where it has room for it: half the time of a new picture."""
    room = total.shape == np.broadcast_shapes(total.shape, term.shape)
    return np.add(total, term, out=total if room else None)


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str, term: str, since: int) -> Departure:
    return Departure(decay, shape, seed, "noise", name, term, since)
