"""Drift of offsets and gains between non-uniformity corrections, and the corrections."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import lru_cache, reduce
from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.camera.ar1 import MarkovBridge, State, draw_between, from_state, to_state
from irsim.camera.noise_base import FrameContext, Noise, NoiseVariance, Ratio, Term, element_shape, line_terms
from irsim.config.base import Part, Several, Switches
from irsim.config.quantities import Fraction, NotNegative
from irsim.rng import normals
from irsim.types import Floats, read_only

LONGEST_STEP = 0.004
"""Longest time step, as a share of the time constant; the drift is constant within a step."""

LARGEST_STEP = 0.1
"""Largest sigma of the change from step to step, NETD, unless the change in one frame is larger. Finer steps change no
measurement: in 300 frames of `uncooled_lwir`, `irsim noise` finds the simulated drift with steps of 2 frames, and a
fifth less with steps of 8 frames and linear interpolation."""

BRIGHT = 1700.0
"""Signal, NETD, for which the time step of gain drift is chosen: that of three million electrons with shot noise alone,
half of a well for long exposures."""

FrameNumber = Annotated[int, Field(ge=1, le=10_000_000)]


class Correction(Part):
    """Non-uniformity corrections: each resets the drift to 0, and the picture may freeze meanwhile."""

    switches: ClassVar[Switches] = {"freeze": ("freeze_frames", 0)}

    frames: Several[FrameNumber] = ()
    """Frames at which a correction begins."""
    period_frames: FrameNumber | None = None
    """Period of corrections, frames: a correction begins at each multiple of it as well."""
    freeze_frames: Annotated[int, Field(ge=0, le=10_000)] = 0
    """Number of frames that repeat the last picture before the correction; ground truth goes on. Drift restarts from 0
    at the first of these frames."""
    # Later frames are thus the same without a freeze. In a real camera with a shutter, drift restarts at the last of
    # these frames; for 0.5 s and a time constant of 600 s the difference is 4 % of the final sigma.

    @model_validator(mode="after")
    def _picture_moves(self) -> Correction:
        if self.period_frames is not None and self.freeze_frames >= self.period_frames:
            raise PydanticCustomError(
                "always_frozen",
                "a picture that is frozen for {freeze} of every {period} frames never changes; "
                "allowed: fewer than period_frames",
                {"freeze": self.freeze_frames, "period": self.period_frames, "at": ("freeze_frames",)},
            )
        return self

    def last(self, index: int) -> tuple[int, int]:
        """Return the frame of the last correction up to `index` (0 for none) and the number of corrections so far."""
        period = self.period_frames
        single = sorted(frame for frame in set(self.frames) if period is None or frame % period)
        count = bisect_right(single, index)
        frame = single[count - 1] if count else 0
        if period is not None:
            frame, count = max(frame, index - index % period), count + index // period
        return frame, count

    def shown(self, index: int) -> int:
        """Return the frame whose picture is shown at frame `index`: an earlier one while the picture is frozen."""
        while True:
            frame, count = self.last(index)
            if not count or index - frame >= self.freeze_frames:
                return index
            index = frame - 1


class DriftProcess(MarkovBridge[State]):
    """AR(1) process that starts at 0 in each element of `shape`, (rows, cols), addressed by seed, `address` and step.

    D[k] = rho D[k-1] + sqrt(1 - rho²) white[k] of variance 1 - rho^(2k), rho = exp(-decay). The value at each of the
    steps 1, 2, 4, ... is drawn given the one before in this series, values between them by the bridge. The values of
    the last call are cached: in sequence a step costs one draw on average.
    """

    def __init__(self, decay: float, shape: tuple[int, int], seed: int, *address: str | int) -> None:
        self.decay = decay
        self.shape = shape
        self.seed = seed
        self.address = address
        self._kept: dict[int, State] = {}

    def frame(self, index: int) -> State:
        """Return the process at step `index` (0 or more), read only."""
        if index == 0:
            return np.zeros(self.shape, np.int16)
        kept = self._kept  # read once: another thread may replace it
        first = 1 << index.bit_length() - 1
        ends = {first: self._power_of_two(first, kept)}
        if index > first:
            ends[2 * first] = kept[2 * first] if 2 * first in kept else self._forward(ends[first], 2 * first, first)
        nodes = self._kept = self.path(index, ends, kept)
        return nodes[index]

    def between(self, before: State, after: State, index: int, distance: int) -> State:
        return draw_between(self.decay * distance, before, after, self.seed, *self.address, index)

    def _power_of_two(self, index: int, kept: dict[int, State]) -> State:
        if index in kept:
            return kept[index]
        if index == 1:
            return self._forward(self.frame(0), 1, 1)
        return self._forward(self._power_of_two(index // 2, kept), index, index // 2)

    def _forward(self, before: State, index: int, distance: int) -> State:
        """Draw the value at step `index`, given the value `distance` steps before it."""
        rho, sigma = math.exp(-self.decay * distance), math.sqrt(-math.expm1(-2 * self.decay * distance))
        drawn = normals(self.shape, self.seed, *self.address, index)
        return to_state(np.asarray(cv2.addWeighted(from_state(before), rho, drawn, sigma, 0, dst=drawn)))


class Drift(Noise):
    """Mean-reverting drift of each pixel's offset and gain after a correction.

    Each deviation is an Ornstein-Uhlenbeck process that is 0 at step c of the last correction. At step k its variance
    is 1 - rho^(2(k-c)) times the square of its final sigma. A step is one frame or several.
    """

    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("pixel", "column", "row", "gain")}

    pixel: Ratio = 0.5
    """Final sigma of offsets from pixel to pixel, in units of the camera's NETD."""
    column: Ratio = 0.25
    """Final sigma of offsets from column to column, in units of the camera's NETD."""
    row: Ratio = 0.1
    """Final sigma of offsets from row to row, in units of the camera's NETD."""
    gain: Fraction = 0.0
    """Final sigma of gains from pixel to pixel, as a share of the signal."""
    time_constant_s: Annotated[float, Field(gt=0, le=1e6)] = 600.0
    """Time in which a deviation falls to 1/e on average, s."""
    age_s: NotNegative = 0.0
    """Time from the last correction to frame 0, s."""

    def gain_deviation(self, frame: FrameContext) -> Floats | None:
        return self._deviation(frame, (("gain", "pixel", self.gain),)) if self.gain else None

    def fixed_pattern(self, frame: FrameContext) -> Floats | None:
        terms = tuple(term for term in line_terms(self.pixel, self.column, self.row) if term[2])
        return self._deviation(frame, terms) if terms else None

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        if not fixed:
            return NoiseVariance()
        decay, since, now = self.steps(frame)
        grown = -math.expm1(-2 * decay * (now - since))
        return NoiseVariance(pixel=grown * (self.pixel**2 + self.column**2 + self.row**2), gain=grown * self.gain**2)

    def steps(self, frame: FrameContext) -> tuple[float, int, int]:
        """Return the decay per step, and the step numbers of the last correction and of this frame.

        The step of a correction before frame 0 is negative.
        """
        since = frame.last_correction if frame.corrections else -round(self.age_s * frame.rate_hz)
        decay = 1 / (frame.rate_hz * self.time_constant_s)
        step = _step_frames(decay, math.hypot(self.pixel, self.column, self.row, self.gain * BRIGHT))
        return decay * step, since // step, frame.index // step

    def _deviation(self, frame: FrameContext, terms: tuple[Term, ...]) -> Floats:
        """Return the sum of the terms' drift at this frame, broadcastable to (rows, cols)."""
        return _deviation(frame.shape, frame.seed, self.name, terms, *self.steps(frame))


def _step_frames(decay: float, sigma: float) -> int:
    """Return the number of frames in a drift step, a power of two, like the blocks that worker processes render."""
    most = min(LONGEST_STEP / decay, LARGEST_STEP**2 / (2 * decay * sigma**2) if sigma else math.inf)
    return 1 << max(int(most), 1).bit_length() - 1


@lru_cache(maxsize=4)
def _deviation(
    shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], decay: float, since: int, now: int
) -> Floats:
    """Return the sum of the terms' drift at a step, broadcastable to the shape."""
    parts = (
        from_state(_process(decay, element_shape(shape, over), seed, name, term, since).frame(now - since))
        * np.float32(sigma)
        for term, over, sigma in terms
    )
    return read_only(reduce(_add, parts))


def _add(total: Floats, term: Floats) -> Floats:
    """Return the sum. The array `total` is overwritten where its shape allows, which halves the time."""
    fits = total.shape == np.broadcast_shapes(total.shape, term.shape)
    return np.add(total, term, out=total if fits else None)


@lru_cache(maxsize=8)
def _process(decay: float, shape: tuple[int, int], seed: int, name: str, term: str, since: int) -> DriftProcess:
    return DriftProcess(decay, shape, seed, "noise", name, term, since)
