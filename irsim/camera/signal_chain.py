"""The signal chain of a camera: light to counts, and the variance of each count.

light -> vignetting -> response (photons to electrons, dark current, pixel gains) -> bloom -> full well
      -> shot noise, read noise and other white noise (one draw) -> further noise terms
      -> correlated noise, fixed pattern, lines -> quantisation -> dead pixels
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from irsim.camera.bloom import Bloom, bloom_variance
from irsim.camera.buffers import Int16Image, scratch
from irsim.camera.drift import Correction
from irsim.camera.noise import NoiseEquivalentRadiance, add_temporal_noise
from irsim.camera.noise_base import ArrayCache, FrameContext, Noise, NoiseVariance, gain_product, pattern_sum
from irsim.camera.response import Lines, Response
from irsim.types import Counts, Floats

NOISE_STEPS = (
    "gain_deviation",
    "draw_electrons",
    "temporal_sigma",
    "add",
    "correlated_noise",
    "fixed_pattern",
    "line_noise",
    "replace_counts",
)
"""Methods of `Noise` that act on a frame."""


@dataclass(frozen=True, eq=False)
class SignalChain:
    """Response and noise terms of a camera in one scene.

    At most one of the noise terms draws electrons. `rate_hz` of the camera; `seed` of the scene; `bloom` of saturated
    pixels; `correction`, the non-uniformity corrections; `vignetting` of a frame, (rows, cols) float32, the
    transmittance relative to the axis.
    """

    response: Response
    noises: Sequence[Noise]
    rate_hz: float
    seed: int
    bloom: Bloom | None = None
    correction: Correction | None = None
    vignetting: Callable[[int], Floats] | None = None
    _patterns: ArrayCache[Sequence[Int16Image]] = field(
        default_factory=lambda: ArrayCache(pattern_sum), init=False, repr=False
    )
    _gains: ArrayCache[Int16Image] = field(default_factory=lambda: ArrayCache(gain_product), init=False, repr=False)

    def shown(self, index: int) -> int:
        """Return the frame whose picture is shown at frame `index`: an earlier one while a correction freezes it."""
        return index if self.correction is None else self.correction.shown(index)

    def frame_context(self, index: int, shape: tuple[int, int]) -> FrameContext:
        """Return the context of frame `index` for noise terms."""
        last, count = (0, 0) if self.correction is None else self.correction.last(index)
        return FrameContext(operator.index(index), shape, self.rate_hz, self.seed, last, count)

    def expose(self, light: Floats, index: int, spent: bool = False, out: Counts | None = None) -> Counts:
        """Return the counts, (rows, cols) uint16, of light (rows, cols) float32, in-band radiance, W/m²/sr.

        Counts are rounded to the nearest (halves to even) and clipped to the bit depth.

        spent   True: the memory of the light may be overwritten
        out     memory for the counts
        """
        frame = self.frame_context(index, light.shape)
        signal = light if spent else scratch(light.shape, "signal")
        self.pixel_signal(light, index, signal, self._gain_deviation(frame))
        self._draw_white_noise(signal, frame)
        for noise in self._terms["add"]:
            noise.add(signal, self.response, frame)
        counts = self.response.counts(signal, out, self._added_images(frame), self._lines(frame))
        for noise in self._terms["replace_counts"]:
            noise.replace_counts(counts, self.response, frame)
        return counts

    def pixel_signal(
        self, light: Floats, index: int, out: Floats | None = None, gain: Int16Image | None = None
    ) -> Floats:
        """Return the noiseless signal in the pixels before they are read, of light (rows, cols), W/m²/sr.

        out    memory for the result
        gain   (rows, cols) relative deviation of each pixel's gain
        """
        if self.vignetting is not None:
            buffer = scratch(light.shape, "light") if light.dtype == np.float32 else None
            light = np.multiply(light, self.vignetting(index), out=buffer)
        if self.bloom is None:
            return self.response.signal(light, out, gain, self.response.well)
        signal = self.response.signal(light, out, gain)
        self.bloom.spill(signal, self.response.top)
        return np.minimum(signal, np.float32(self.response.well), out=signal)

    def _draw_white_noise(self, signal: Floats, frame: FrameContext) -> None:
        """Draw white noise, one normal number a pixel for all terms, together with shot noise if the signal is in
        electrons."""
        sigma = math.hypot(*(noise.temporal_sigma(frame) for noise in self._terms["temporal_sigma"]))
        sigma *= self.response.noise
        if counting := self._terms["draw_electrons"]:
            counting[0].draw_electrons(signal, self.response, frame, sigma)
        elif sigma:
            add_temporal_noise(signal, sigma, frame)

    @cached_property
    def _terms(self) -> Mapping[str, Sequence[Noise]]:
        """Noise terms by the method of `Noise` that they override, to call only these; most terms override one
        method."""
        terms = {
            step: [noise for noise in self.noises if getattr(type(noise), step) is not getattr(Noise, step)]
            for step in NOISE_STEPS
        }
        if len(terms["draw_electrons"]) > 1:
            raise ValueError("at most one noise term may count electrons")
        # The sum of patterns is rounded: another order would change counts.
        terms["fixed_pattern"].sort(key=lambda noise: not noise.stationary)
        return terms

    def _gain_deviation(self, frame: FrameContext) -> Int16Image | None:
        found = [noise.gain_deviation(frame) for noise in self._terms["gain_deviation"]]
        deviations = [deviation for deviation in found if deviation is not None]
        return self._gains.of(frame.shape, deviations) if deviations else None

    def _added_images(self, frame: FrameContext) -> Sequence[Int16Image]:
        """Return correlated noise and fixed patterns, in units of the signal."""
        correlated = [image for noise in self._terms["correlated_noise"] for image in noise.correlated_noise(frame)]
        found = [noise.fixed_pattern(frame) for noise in self._terms["fixed_pattern"]]
        fixed = self._patterns.of(frame.shape, [pattern for pattern in found if pattern is not None])
        return [Int16Image(values, unit * self.response.noise) for values, unit in (*correlated, *fixed)]

    def _lines(self, frame: FrameContext) -> Lines | None:
        """Return the noise along rows and columns, in units of the signal."""
        found = [lines for noise in self._terms["line_noise"] if (lines := noise.line_noise(frame)) is not None]
        if not found:
            return None
        down, across = found[0] if len(found) == 1 else (np.sum(parts, axis=0) for parts in zip(*found, strict=True))
        return down * np.float32(self.response.noise), across * np.float32(self.response.noise)

    def mean(self, light: Floats, index: int) -> Floats:
        """Return the noiseless counts before rounding and clipping, (rows, cols), float64 for float64 light."""
        return self._to_counts(self.pixel_signal(light, index))

    def variance(self, light: Floats, index: int, fixed: bool = True, clipped: bool = True) -> Floats:
        """Return the variance of each pixel about `mean(light, index)`, (rows, cols) float64, counts², 1/12 of rounding
        included.

        The variance is the mean square over all seeds, for independent noise terms (an offset that is the same for all
        seeds, such as that of odd and even rows, counts too). Infinite where a pixel does not respond: dead or
        saturated. Where pixels spill, the part due to gains is a mean over draws (`bloom_variance`).

        fixed     False: only the part that changes from frame to frame
        clipped   False: a pixel whose mean is outside the range of counts keeps the variance that it has before
                  clipping
        """
        signal, frame = self.pixel_signal(light, index), self.frame_context(index, light.shape)
        variance = np.full(light.shape, 1 / 12)
        for noise in self.noises:
            variance += noise.variance(signal, self.response, frame, fixed) / self.response.gain**2
        variance += self._bloom_correction(light, index, signal, frame, fixed)
        silent = signal >= self.response.well
        if clipped:
            counts = self._to_counts(signal)
            silent |= (counts < 0) | (counts >= self.response.full)
        variance[silent] = np.inf
        return variance

    @property
    def varies_by_signal(self) -> bool:
        """True where the variance of each pixel follows from its own signal: without bloom and bad pixels."""
        return self.bloom is None and all(type(noise).variance is Noise.variance for noise in self.noises)

    def temporal_variance(self, mean: Floats, index: int) -> Floats:
        """Return the temporal variance, counts², of any pixels by their noiseless counts, where `varies_by_signal`.

        As `variance` with `fixed` and `clipped` False.
        """
        frame, response = self.frame_context(index, (1, 1)), self.response
        terms = NoiseVariance.total(noise.variance_terms(frame, False) for noise in self.noises)
        signal = (mean - response.offset) * response.gain
        variance = 1 / 12 + terms.overall(signal, response) / response.gain**2
        variance[signal >= response.well * (1 - 1e-9)] = np.inf
        return variance

    def common_variance(self, index: int) -> tuple[float, float, float]:
        """Return the temporal variances common to a row, to a column and to the whole frame, counts²; `variance`
        includes all three."""
        frame, scale = self.frame_context(index, (1, 1)), (self.response.noise / self.response.gain) ** 2
        lines = [noise.line_variance(frame) for noise in self.noises]
        common = NoiseVariance.total(noise.variance_terms(frame, False) for noise in self.noises).frame
        return scale * sum(row for row, _ in lines), scale * sum(column for _, column in lines), scale * common

    def fixed_offsets(self, index: int, shape: tuple[int, int]) -> Floats:
        """Return the sum of the fixed patterns, (rows, cols) counts, that frame `index` adds to the mean."""
        frame, total = self.frame_context(index, shape), np.zeros(shape)
        for noise in self._terms["fixed_pattern"]:
            pattern = noise.fixed_pattern(frame)
            total += 0.0 if pattern is None else pattern
        return np.asarray(total * (self.response.noise / self.response.gain))

    def _bloom_correction(
        self, light: Floats, index: int, signal: Floats, frame: FrameContext, fixed: bool
    ) -> Floats | float:
        """Return the change that blooming makes to the variance due to gains, counts²."""
        gain = sum(noise.variance_terms(frame, fixed).gain for noise in self.noises)
        if self.bloom is None or gain == 0:
            return 0.0
        response = self.response
        unspilled = replace(self, bloom=None, response=replace(response, well=math.inf)).pixel_signal(light, index)
        found = bloom_variance(unspilled.astype(np.float32), gain, response.zero, response.top, self.bloom)
        if found is None:
            return 0.0
        region, squares = found
        change = np.zeros(light.shape)
        change[region] = (squares - gain * (signal[region].astype(np.float64) - response.zero) ** 2) / response.gain**2
        return change

    def noise_equivalent(self, index: int) -> NoiseEquivalentRadiance:
        """Return the noise-equivalent radiance of a frame by all terms together, without rounding and bad pixels."""
        frame, (constant, others) = self.frame_context(index, (1, 1)), self._variance_terms
        variance = NoiseVariance.total([constant, *(noise.variance_terms(frame, True) for noise in others)])
        return NoiseEquivalentRadiance(self.response, variance, self.vignetting and self.vignetting(index))

    @cached_property
    def _variance_terms(self) -> tuple[NoiseVariance, Sequence[Noise]]:
        """Variance of all stationary terms together, and the terms that are not stationary."""
        first = self.frame_context(0, (1, 1))
        constant = NoiseVariance.total(noise.variance_terms(first, True) for noise in self.noises if noise.stationary)
        return constant, [noise for noise in self.noises if not noise.stationary]

    def _to_counts(self, signal: Floats) -> Floats:
        return signal / np.float32(self.response.gain) + np.float32(self.response.offset)
