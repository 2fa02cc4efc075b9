"""The detector of a camera as a whole: light to counts, and the variance of each count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from irsim.compiled import COMPILED, kernels
from irsim.detector.base import Moment, Noise
from irsim.detector.bloom import Bloom
from irsim.detector.correction import Correction
from irsim.detector.response import Response
from irsim.detector.scratch import scratch
from irsim.detector.steady import Sum
from irsim.types import Counts, Floats


@dataclass(frozen=True, eq=False)
class Sensor:
    """A response and its noise terms, in a camera and a scene.

    rate_hz of the camera; seed of the scene; bloom of saturated pixels; correction, when the camera
    corrects itself; falloff (rows, cols) float32, the share of light that the lens lets through.
    """

    response: Response
    noises: Sequence[Noise]
    rate_hz: float
    seed: int
    bloom: Bloom | None = None
    correction: Correction | None = None
    falloff: Floats | None = None
    _steady: Sum = field(default_factory=Sum, init=False, repr=False)

    def shown(self, index: int) -> int:
        """The frame whose picture is seen at frame `index`."""
        return index if self.correction is None else self.correction.shown(index)

    def moment(self, index: int, shape: tuple[int, int]) -> Moment:
        """Frame `index` as noise sees it."""
        last, count = (0, 0) if self.correction is None else self.correction.last(index)
        return Moment(index, shape, self.rate_hz, self.seed, last, count)

    def expose(self, light: Floats, index: int, spent: bool = False, out: Counts | None = None) -> Counts:
        """(rows, cols) uint16 counts of `light` (rows, cols) float32, in-band radiance in W/m2/sr, at a frame.

        Counts are rounded to the nearest (halves to even) and clipped to the depth of the detector. A `spent` light
        is needed by nobody any more: its memory, which is in the caches, is written over. The counts are put into
        `out`, where it is given.
        """
        signal = self._signal(light, light if spent else scratch(light.shape, "signal"))
        moment = self.moment(index, light.shape)
        for noise in self.noises:
            noise.respond(signal, self.response, moment)
        self._saturate(signal)
        for noise in self.noises:
            noise.add(signal, self.response, moment)
        steady = self._steady.of([part for noise in self.noises if (part := noise.steady(moment)) is not None], moment)
        if steady is not None:
            cv2.scaleAdd(steady, self.response.noise, signal, dst=signal)
        for noise in self.noises:
            noise.replace(signal, self.response, moment)
        return self.response.counts(signal, out)

    def mean(self, light: Floats) -> Floats:
        """(rows, cols): the noiseless counts of a light before they are rounded and clipped; float64 of float64."""
        return self._counts(self._held(light))

    def variance(self, light: Floats, index: int, fixed: bool = True) -> Floats:
        """(rows, cols) float64, counts^2: the noise of each pixel about `mean(light)`, rounding's 1/12 with it.

        Over all draws of the seed, noise terms being independent; without `fixed`, what changes from
        frame to frame only. Infinite where a pixel says nothing of the light: dead, or saturated.
        """
        signal, moment = self._held(light), self.moment(index, light.shape)
        variance = np.full(light.shape, 1 / 12)
        for noise in self.noises:
            variance += noise.variance(signal, self.response, moment, fixed) / self.response.gain**2
        counts = self._counts(signal)
        silent = (counts < 0) | (counts >= self.response.full) | (signal >= self.response.well)
        variance[silent] = np.inf
        return variance

    def _signal(self, light: Floats, out: Floats | None = None) -> Floats:
        if self.falloff is not None:
            buffer = scratch(light.shape, "light") if light.dtype == np.float32 else None
            light = np.multiply(light, self.falloff, out=buffer)
        return self.response.signal(light, out)

    def _held(self, light: Floats) -> Floats:
        signal = self._signal(light)
        self._saturate(signal)
        return signal

    def _counts(self, signal: Floats) -> Floats:
        return signal / np.float32(self.response.gain) + np.float32(self.response.offset)

    def _saturate(self, signal: Floats) -> None:
        if self.bloom is not None:
            self.bloom.spill(signal, self.response.top)
        if signal.max() <= self.response.well:
            return
        if COMPILED and signal.dtype == np.float32 and signal.flags.c_contiguous:
            kernels.hold(signal, self.response.well)
        else:
            np.minimum(signal, np.float32(self.response.well), out=signal)
