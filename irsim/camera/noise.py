"""Noise terms without memory: white, shot, fixed-pattern, odd-even and 3-D noise, and their noise-equivalent radiance.

Terms are independent of each other; their sigmas are in units of the camera's NETD.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import cv2
import numpy as np
from pydantic import Field

from irsim._native import COMPILED, kernels
from irsim.camera.buffers import scratch
from irsim.camera.noise_base import (
    BLOCK_FRAMES,
    FrameContext,
    Noise,
    NoiseVariance,
    Ratio,
    Term,
    gaussian_pattern,
    line_terms,
)
from irsim.camera.response import Lines, Response
from irsim.config.base import Switches
from irsim.rng import Address, kernel_arguments, normals, uniforms
from irsim.types import Box, Floats, read_only

POISSON_BELOW_E = 200.0
"""Mean electrons below which shot noise is drawn from the Poisson distribution; above, its skewness is under 0.07."""

LEAST_TRANSMITTANCE = 1e-3
"""Lower limit of the lens's transmittance at a pixel: at 0 the noise-equivalent radiance is infinite."""


def temporal_address(frame: FrameContext) -> tuple[int, *tuple[Address, ...]]:
    """Return the address of a frame's white noise.

    The address contains no term's name, so that switching a term off leaves the numbers of the other terms unchanged.
    """
    return frame.seed, "noise", "white", frame.index


def add_temporal_noise(signal: Floats, sigma: float, frame: FrameContext) -> None:
    """Add white noise of standard deviation `sigma` to a signal (rows, cols) float32, C-contiguous, in place."""
    if COMPILED:
        kernels.add_normals(*kernel_arguments(*temporal_address(frame)), signal, sigma)
        return
    drawn = normals(signal.shape, *temporal_address(frame), out=scratch(signal.shape, "drawn"))
    cv2.scaleAdd(drawn, sigma, signal, dst=signal)


class White(Noise):
    """White noise, independent from pixel to pixel and from frame to frame (tvh in 3-D noise terms)."""

    stationary: ClassVar[bool] = True

    ratio: Ratio = 1.0
    """Sigma in units of the camera's NETD."""

    def temporal_sigma(self, frame: FrameContext) -> float:
        return self.ratio

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(pixel=self.ratio**2)


class Shot(Noise):
    """Shot noise of the electrons together with the read noise. For a detector of kind `electrons`.

    The variance is S + read noise² for a mean of S electrons: Poisson below 200 electrons, its normal limit above. The
    normal part is drawn together with the white noise of other terms. A saturated pixel has no shot noise.
    """

    stationary: ClassVar[bool] = True

    def draw_electrons(self, signal: Floats, response: Response, frame: FrameContext, sigma: float) -> None:
        variance, well = response.read**2 + sigma**2, response.well
        if COMPILED:
            found = kernels.add_shot(
                *kernel_arguments(*temporal_address(frame)), signal, variance, well, POISSON_BELOW_E
            )
            if not found:
                return
            pairs = np.frombuffer(found)
            dark, means = pairs[::2].astype(np.intp), pairs[1::2].astype(np.float32)
        else:
            dark = np.flatnonzero(signal < POISSON_BELOW_E)
            means = signal.reshape(-1)[dark]
            drawn = normals(frame.shape, *temporal_address(frame), out=scratch(frame.shape, "drawn"))
            normal = np.where((signal >= well) | (signal < POISSON_BELOW_E), np.float32(0), signal)
            cv2.accumulateProduct(np.sqrt(normal + np.float32(variance)), drawn, signal)
        if dark.size:
            uniform = uniforms(signal.size, frame.seed, "noise", self.name, "uniform", frame.index)[dark] + 2.0**-54
            signal.reshape(-1)[dark] += poisson(np.maximum(means, 0), uniform).astype(np.float32) - means

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(shot=1.0)


def poisson(means: Floats, uniform: Floats) -> Floats:
    """Return Poisson numbers, (n,) float64, of `means` (0 to a few hundred) at the probabilities `uniform`.

    Each is the smallest k at which the distribution function, the sum of m^k e^-m / k!, reaches the probability.
    """
    found = np.zeros(means.shape)
    left = np.arange(means.size)
    term = np.exp(-np.asarray(means, np.float64))
    mean, wanted, total = np.asarray(means, np.float64), np.asarray(uniform, np.float64), term.copy()
    k = 0
    while left.size:
        going = (total < wanted) & ((k < mean) | (term > 0))
        left, mean, wanted, term, total = left[going], mean[going], wanted[going], term[going], total[going]
        k += 1
        found[left] = k
        term = term * mean / k
        total = total + term
    return found


class FixedPattern(Noise):
    """Fixed-pattern noise: the residual of non-uniformity correction (vh, h and v in 3-D noise terms).

    The defaults are those of a fresh correction, tvh:vh:h:v = 1:0.3:0.15:0.08. The terms are those of
    D'Agostino and Webb, Proc. SPIE 1488 (1991).
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("pixel", "column", "row")}

    pixel: Ratio = 0.3
    """Sigma from pixel to pixel (vh), in units of the camera's NETD."""
    column: Ratio = 0.15
    """Sigma from column to column (h), in units of the camera's NETD."""
    row: Ratio = 0.08
    """Sigma from row to row (v), in units of the camera's NETD."""
    redrawn: bool = False
    """True: each correction of the camera leaves another pattern; False: all leave the same."""

    def fixed_pattern(self, frame: FrameContext) -> Floats:
        number = frame.corrections if self.redrawn else 0
        return gaussian_pattern(
            frame.shape, frame.seed, self.name, line_terms(self.pixel, self.column, self.row), number
        )

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(pixel=(self.pixel**2 + self.column**2 + self.row**2) if fixed else 0.0)


class OddEven(Noise):
    """Offset of even rows or columns above odd rows or columns, as from two readout amplifiers."""

    stationary: ClassVar[bool] = True

    ratio: Annotated[float, Field(ge=-1000, le=1000)] = 1.0
    """Half the difference of even and odd lines, in units of the camera's NETD; negative where even lines are lower."""
    along: Literal["rows", "columns"] = "rows"
    """Lines that alternate."""

    def fixed_pattern(self, frame: FrameContext) -> Floats:
        rows, columns = frame.shape
        return _alternating((rows, 1) if self.along == "rows" else (1, columns), self.ratio)

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(pixel=self.ratio**2 if fixed else 0.0)


@lru_cache(maxsize=8)
def _alternating(shape: tuple[int, int], ratio: float) -> Floats:
    """Return lines of `ratio` and -`ratio` alternately, float32, broadcastable to `shape`."""
    odd = np.arange(max(shape)).reshape(shape) % 2
    return read_only(np.where(odd, -ratio, ratio).astype(np.float32))


class Noise3d(Noise):
    """The seven terms of 3-D noise, each Gaussian and independent of the others; terms with t are white in time.

    J. A. D'Agostino and C. M. Webb, "Three-dimensional analysis framework and measurement methodology
    for imaging system noise", Proc. SPIE 1488 (1991): t time, v vertical (from row to row), h
    horizontal (from column to column). All are in units of the camera's NETD.
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {term: (term, 0.0) for term in ("t", "v", "h", "tv", "th", "vh", "tvh")}

    t: Ratio = 0.0
    """Sigma of the frame's level, independent from frame to frame."""
    v: Ratio = 0.0
    """Sigma from row to row, the same in all frames."""
    h: Ratio = 0.0
    """Sigma from column to column, the same in all frames."""
    tv: Ratio = 0.0
    """Sigma from row to row, independent from frame to frame (streaks)."""
    th: Ratio = 0.0
    """Sigma from column to column, independent from frame to frame (rain)."""
    vh: Ratio = 0.0
    """Sigma from pixel to pixel, the same in all frames."""
    tvh: Ratio = 1.0
    """Sigma from pixel to pixel, independent from frame to frame."""

    def temporal_sigma(self, frame: FrameContext) -> float:
        return self.tvh

    def line_noise(self, frame: FrameContext) -> Lines | None:
        if not (self.t or self.tv or self.th):
            return None
        block, at = divmod(frame.index, BLOCK_FRAMES)
        down, across = _line_block(frame.shape, frame.seed, self.name, (self.t, self.tv, self.th), block)
        return down[at], across[at]

    def fixed_pattern(self, frame: FrameContext) -> Floats | None:
        if not (self.v or self.h or self.vh):
            return None
        terms: tuple[Term, ...] = (("v", "row", self.v), ("h", "column", self.h), ("vh", "pixel", self.vh))
        return gaussian_pattern(frame.shape, frame.seed, self.name, terms)

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        changing = self.tv**2 + self.th**2 + self.tvh**2
        return NoiseVariance(pixel=changing + (self.v**2 + self.h**2 + self.vh**2 if fixed else 0.0), frame=self.t**2)

    def line_variance(self, frame: FrameContext) -> tuple[float, float]:
        return self.tv**2, self.th**2


@lru_cache(maxsize=4)
def _line_block(shape: tuple[int, int], seed: int, name: str, sigmas: tuple[float, float, float], block: int) -> Lines:
    """Return the terms t + tv, (BLOCK_FRAMES, rows), and th, (BLOCK_FRAMES, cols), of a block of frames."""

    def drawn(term: str, sigma: float, length: int) -> Floats:
        if not sigma:
            return np.zeros((BLOCK_FRAMES, length), np.float32)
        return normals((BLOCK_FRAMES, length), seed, "noise", name, term, block) * np.float32(sigma)

    (rows, columns), (t, tv, th) = shape, sigmas
    return read_only(drawn("t", t, 1) + drawn("tv", tv, rows)), read_only(drawn("th", th, columns))


@dataclass(frozen=True, eq=False)
class NoiseEquivalentRadiance:
    """Noise-equivalent radiance of one frame: the added light that raises the signal by the noise sigma between pixels.

    vignetting   (rows, cols) transmittance of the lens relative to its axis; None for 1 everywhere
    """

    response: Response
    variance: NoiseVariance
    vignetting: Floats | None = None

    def __call__(self, level: float, box: Box) -> float:
        """Return the noise-equivalent radiance, W/m²/sr, at a radiance `level`, W/m²/sr, in the middle of a box."""
        transmittance = 1.0 if self.vignetting is None else _at_center(self.vignetting, box)
        light = max(level * transmittance, 0.0)  # negative by rounding only
        sigma = math.sqrt(self.variance.within_frame(self.response.at(light), self.response))
        return self.response.light_step(light, sigma) / transmittance


def _at_center(vignetting: Floats, box: Box) -> float:
    rows, columns = vignetting.shape
    row, column = (min(max(round(at), 0), count - 1) for at, count in ((box.cy, rows), (box.cx, columns)))
    return max(float(vignetting[row, column]), LEAST_TRANSMITTANCE)
