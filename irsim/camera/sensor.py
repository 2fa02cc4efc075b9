"""The detector of a camera as a whole: light to counts, and the variance of each count."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from irsim.camera.bloom import Bloom
from irsim.camera.bloom_variance import spread
from irsim.camera.correction import Correction
from irsim.camera.fixed_sum import Product, Sum
from irsim.camera.int16_image import Words
from irsim.camera.noise_base import FrameContext, Noise
from irsim.camera.noise_equivalent import Equivalent
from irsim.camera.response import Lines, Response
from irsim.camera.scratch import scratch
from irsim.camera.temporal_sigma import add_grain
from irsim.camera.variance import Variance
from irsim.types import Counts, Floats


@dataclass(frozen=True, eq=False)
class Sensor:
    """A response and its noise terms, in a camera and a scene.

    Of the noises one at most counts electrons. rate_hz of the camera; seed of the scene; bloom of saturated pixels;
    correction, when the camera corrects itself; falloff of a frame, (rows, cols) float32, the share of light that the
    lens lets through.
    """

    response: Response
    noises: Sequence[Noise]
    rate_hz: float
    seed: int
    bloom: Bloom | None = None
    correction: Correction | None = None
    falloff: Callable[[int], Floats] | None = None
    _steady: Sum = field(default_factory=Sum, init=False, repr=False)
    _gains: Product = field(default_factory=Product, init=False, repr=False)

    def shown(self, index: int) -> int:
        """The frame whose picture is seen at frame `index`."""
        return index if self.correction is None else self.correction.shown(index)

    def frame_context(self, index: int, shape: tuple[int, int]) -> FrameContext:
        """Frame `index` as noise sees it."""
        last, count = (0, 0) if self.correction is None else self.correction.last(index)
        return FrameContext(operator.index(index), shape, self.rate_hz, self.seed, last, count)

    @property
    def steps(self) -> int:
        """Those from light to what is read: pixels hold it, what is new in each is drawn, then whatever else a noise
        adds in a way of its own."""
        return 2 + len(self._doing["add"])

    def step(self, picture: Floats, index: int, begin: int, end: int, spent: bool = False) -> Floats:
        """A frame's picture, (rows, cols) float32, after the steps before `end`, of one after those before `begin`;
        before the first it is light, in-band radiance in W/m2/sr, after it a signal in the units of `response`.

        A `spent` picture is needed by nobody any more: its memory, which is in the caches, is written over.
        """
        return self._step(picture, self.frame_context(index, picture.shape), begin, end, spent)

    def _step(self, picture: Floats, frame_context: FrameContext, begin: int, end: int, spent: bool) -> Floats:
        own = picture if spent else scratch(picture.shape, "signal")
        if begin == 0 < end:
            self.held(picture, frame_context.index, own, self._gain(frame_context))
        elif not spent:
            np.copyto(own, picture)
        if begin <= 1 < end:
            self._draw(own, frame_context)
        for noise in self._doing["add"][max(begin, 2) - 2 : max(end, 2) - 2]:
            noise.add(own, self.response, frame_context)
        return own

    def _draw(self, signal: Floats, frame_context: FrameContext) -> None:
        """Draw what is new in each pixel: one number for all noises, with the electrons where they are counted."""
        sigma = math.hypot(*(noise.grain(frame_context) for noise in self._doing["grain"])) * self.response.noise
        if counting := self._doing["count"]:
            counting[0].count(signal, self.response, frame_context, sigma)
        elif sigma:
            add_grain(signal, sigma, frame_context)

    def expose(
        self, light: Floats, index: int, spent: bool = False, out: Counts | None = None, steps: int = 0
    ) -> Counts:
        """(rows, cols) uint16 counts of `light` (rows, cols) float32, in-band radiance in W/m2/sr, at a frame; or of
        what it is after so many steps.

        Counts are rounded to the nearest (halves to even) and clipped to the depth of the detector. A `spent` light
        is written over (see `step`). The counts are put into `out`, where it is given.
        """
        frame_context = self.frame_context(index, light.shape)
        signal = self._step(light, frame_context, steps, self.steps, spent)
        counts = self.response.counts(signal, out, self._added(frame_context), self._lines(frame_context))
        for noise in self._doing["replace"]:
            noise.replace(counts, self.response, frame_context)
        return counts

    @cached_property
    def _doing(self) -> Mapping[str, Sequence[Noise]]:
        """The noises that do something of their own, by what it is: most do one thing only."""
        of_all = "gains", "count", "grain", "add", "lines", "lasting", "steady", "replace"
        doing = {
            what: [noise for noise in self.noises if getattr(type(noise), what) is not getattr(Noise, what)]
            for what in of_all
        }
        if len(doing["count"]) > 1:
            raise ValueError("one noise at most counts electrons")
        doing["steady"].sort(key=lambda noise: not noise.stationary)  # what changes comes last (`Sum`)
        return doing

    def _gain(self, frame_context: FrameContext) -> Words | None:
        """What the noises' gains are together."""
        gains = [gain for noise in self._doing["gains"] if (gain := noise.gains(frame_context)) is not None]
        return self._gains.of(gains) if gains else None

    def _added(self, frame_context: FrameContext) -> Sequence[Words]:
        """What is added to all that was drawn for this frame alone, in units of signal."""
        lasting = [found for noise in self._doing["lasting"] for found in noise.lasting(frame_context)]
        patterns = [part for noise in self._doing["steady"] if (part := noise.steady(frame_context)) is not None]
        all_of_them = [*lasting, *self._steady.of(patterns, frame_context)]
        return [Words(values, unit * self.response.noise) for values, unit in all_of_them]

    def _lines(self, frame_context: FrameContext) -> Lines | None:
        """What is added along whole rows and columns, in units of signal."""
        found = [lines for noise in self._doing["lines"] if (lines := noise.lines(frame_context)) is not None]
        if not found:
            return None
        down, across = found[0] if len(found) == 1 else (np.sum(parts, axis=0) for parts in zip(*found, strict=True))
        return down * np.float32(self.response.noise), across * np.float32(self.response.noise)

    def mean(self, light: Floats, index: int) -> Floats:
        """(rows, cols): the noiseless counts of a light at a frame before they are rounded and clipped; float64 of
        float64."""
        return self._counts(self.held(light, index))

    def variance(self, light: Floats, index: int, fixed: bool = True) -> Floats:
        """(rows, cols) float64, counts^2: the noise of each pixel about `mean(light, index)`, rounding's 1/12 with it.

        The mean square over all draws of the seed, noise terms being independent (also of an offset that is the
        same in all draws, such as that of odd and even rows); without `fixed`, what changes from frame to frame only.
        Infinite where a pixel says nothing of the light: dead, or saturated. Where pixels spill, what their gains give
        is the mean of draws (`irsim.camera.bloom_variance`).
        """
        signal, frame_context = self.held(light, index), self.frame_context(index, light.shape)
        variance = np.full(light.shape, 1 / 12)
        for noise in self.noises:
            variance += noise.variance(signal, self.response, frame_context, fixed) / self.response.gain**2
        variance += self._spilled(light, index, signal, frame_context, fixed)
        counts = self._counts(signal)
        silent = (counts < 0) | (counts >= self.response.full) | (signal >= self.response.well)
        variance[silent] = np.inf
        return variance

    def _spilled(
        self, light: Floats, index: int, held: Floats, frame_context: FrameContext, fixed: bool
    ) -> Floats | float:
        """What pixels that spill into others change of the variance that gains give to what is `held`, counts^2."""
        gain = sum(noise.share(frame_context, fixed).gain for noise in self.noises)
        if self.bloom is None or gain == 0:
            return 0.0
        response = self.response
        unspilled = replace(self, bloom=None, response=replace(response, well=math.inf)).held(light, index)
        found = spread(unspilled.astype(np.float32), gain, response.zero, response.top, self.bloom)
        if found is None:
            return 0.0
        region, squares = found
        changed = np.zeros(light.shape)
        changed[region] = (squares - gain * (held[region].astype(np.float64) - response.zero) ** 2) / response.gain**2
        return changed

    def equivalent(self, index: int) -> Equivalent:
        """The noise of a frame's pixels, but for bad ones, as light: of all terms together, without rounding."""
        frame_context, (known, others) = self.frame_context(index, (1, 1)), self._shares
        variance = Variance.together([known, *(noise.share(frame_context, True) for noise in others)])
        return Equivalent(self.response, variance, self.falloff and self.falloff(index))

    @cached_property
    def _shares(self) -> tuple[Variance, Sequence[Noise]]:
        """What those noises have together whose share is the same in all frames, and the others."""
        first = self.frame_context(0, (1, 1))
        known = Variance.together(noise.share(first, True) for noise in self.noises if noise.stationary)
        return known, [noise for noise in self.noises if not noise.stationary]

    def held(self, light: Floats, index: int, out: Floats | None = None, gain: Words | None = None) -> Floats:
        """What pixels hold of `light`, (rows, cols) in W/m2/sr, at a frame, before anything is read; in `out`, where
        that is given.

        gain (rows, cols), by what share each pixel answers more to light.
        """
        if self.falloff is not None:
            buffer = scratch(light.shape, "light") if light.dtype == np.float32 else None
            light = np.multiply(light, self.falloff(index), out=buffer)
        if self.bloom is None:
            return self.response.signal(light, out, gain, self.response.well)
        signal = self.response.signal(light, out, gain)
        self.bloom.spill(signal, self.response.top)
        return np.minimum(signal, np.float32(self.response.well), out=signal)

    def _counts(self, signal: Floats) -> Floats:
        return signal / np.float32(self.response.gain) + np.float32(self.response.offset)
