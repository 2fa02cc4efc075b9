"""Base classes of noise terms, their variance, and the sums of patterns that are constant over many frames."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from operator import is_
from typing import Annotated, ClassVar, Generic, Literal, NamedTuple, TypeVar

import cv2
import numpy as np
from pydantic import Field

from irsim.camera.buffers import Int16Image, int16_image, int16_sum
from irsim.camera.response import Lines, Response
from irsim.config.base import NamedKind
from irsim.rng import normals
from irsim.types import Counts, Floats, read_only

Ratio = Annotated[float, Field(ge=0, le=1000)]
"""A sigma in units of the camera's NETD."""

BLOCK_FRAMES = 32
"""Number of consecutive frames whose few random numbers are drawn together: opening a stream takes as long as drawing a
thousand numbers."""

FINEST_UNIT = 0.01
"""Unit of a fixed pattern, NETD, below which its rounding (standard deviation 0.003) is negligible."""


@dataclass(frozen=True)
class FrameContext:
    """Index and shape of a frame, and the camera's state in it, for noise terms.

    `index` and `shape` (rows, cols) of the frame; `rate_hz` of the camera; `seed` of the scene; `last_correction`, the
    frame of the last non-uniformity correction (0 before the first one); `corrections`, their number up to this frame.
    """

    index: int
    shape: tuple[int, int]
    rate_hz: float
    seed: int
    last_correction: int = 0
    corrections: int = 0


Signal = TypeVar("Signal", float, Floats)
Result = TypeVar("Result")


class NoiseVariance(NamedTuple):
    """Variance of a noise term over all seeds, by its dependence on the signal.

    pixel    independent of the light and of other pixels, NETD²
    frame    common to all pixels of a frame, NETD²
    gain     variance of the pixels' gains: multiplies the squared signal of light
    shot     number of terms that count electrons: multiplies signal + read noise² in electrons
    """

    pixel: float = 0.0
    frame: float = 0.0
    gain: float = 0.0
    shot: float = 0.0

    @classmethod
    def total(cls, terms: Iterable[NoiseVariance]) -> NoiseVariance:
        """Return the sum of the variances of independent terms."""
        pixel = frame = gain = shot = 0.0
        for term in terms:
            pixel, frame, gain, shot = pixel + term[0], frame + term[1], gain + term[2], shot + term[3]
        return cls(pixel, frame, gain, shot)

    def within_frame(self, signal: Signal, response: Response) -> Signal:
        """Return the variance between pixels of one frame at a noiseless signal, signal²: all terms but `frame`."""
        light, lit = signal - response.zero, (signal + abs(signal)) / 2
        return self.pixel * response.noise**2 + self.gain * light**2 + self.shot * (lit + response.read**2)

    def overall(self, signal: Signal, response: Response) -> Signal:
        """Return the variance of a pixel at a noiseless signal, signal²."""
        return self.within_frame(signal, response) + self.frame * response.noise**2


class Noise(NamedKind):
    """Noise term of a camera. A subclass overrides the methods of the steps in which it acts, and `variance_terms`.

    `signal` is the frame so far, (rows, cols) float32 in the units of `response`, changed in place. All random numbers
    but those of `temporal_sigma` are addressed by the seed, the term's name, a word for the quantity and the frame (or
    its block of BLOCK_FRAMES): they do not depend on the frames rendered before.
    """

    stationary: ClassVar[bool] = False
    """True where `variance_terms` is the same in all frames. It is then evaluated once, and fixed patterns of
    stationary terms are summed before those that may change. A subclass that overrides `variance_terms` must set this
    attribute too."""

    def gain_deviation(self, frame: FrameContext) -> Floats | None:
        """Return the relative deviation of each pixel's gain, (rows, cols) float32, read only; None where it is 0."""
        return None

    def temporal_sigma(self, frame: FrameContext) -> float:
        """Return the sigma of white noise, independent from pixel to pixel, from frame to frame and of the light, NETD.

        The camera draws one normal number a pixel for all terms together, as their sum is normal, at an address that
        does not depend on the terms.
        """
        return 0.0

    def draw_electrons(self, signal: Floats, response: Response, frame: FrameContext, sigma: float) -> None:
        """Replace mean numbers of electrons by drawn numbers and add white noise of `sigma`, in units of the signal. At
        most one term of a camera draws electrons.
        """

    def add(self, signal: Floats, response: Response, frame: FrameContext) -> None:
        """Add noise to the signal that was read out, after saturation and white noise."""

    def line_noise(self, frame: FrameContext) -> Lines | None:
        """Return noise constant along rows, (rows,), and columns, (cols,), NETD, float32, read only; None where 0."""
        return None

    def correlated_noise(self, frame: FrameContext) -> Sequence[Int16Image]:
        """Return the images of noise correlated in time that are added to this frame, NETD."""
        return ()

    def fixed_pattern(self, frame: FrameContext) -> Floats | None:
        """Return noise that is constant over many frames, NETD, float32, broadcastable to (rows, cols), read only.

        The same array is returned as long as the pattern is the same: the patterns of all terms are then summed once.
        None where it is 0.
        """
        return None

    def replace_counts(self, counts: Counts, response: Response, frame: FrameContext) -> None:
        """Replace counts, (rows, cols) uint16, in place, as the last step of a frame."""

    @abstractmethod
    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        """Return the variance added to an ordinary pixel.

        fixed   True: with fixed patterns; False: only the part that changes from frame to frame
        """

    def line_variance(self, frame: FrameContext) -> tuple[float, float]:
        """Return the temporal variances common to a row and to a column, NETD²; they are part of `pixel`."""
        return 0.0, 0.0

    def variance(self, signal: Floats, response: Response, frame: FrameContext, fixed: bool) -> Floats | float:
        """Return the variance of each pixel about the noiseless `signal`, signal², broadcastable to the signal.

        The variance is that over all seeds of the scene; see `variance_terms` for `fixed`. Infinite where a pixel does
        not respond to light.
        """
        return self.variance_terms(frame, fixed).overall(signal.astype(np.float64), response)

    @property
    def counts_electrons(self) -> bool:
        """True where the term draws electrons, which requires a signal in electrons."""
        return type(self).draw_electrons is not Noise.draw_electrons


class Additive(Noise):
    """Noise term that is added to the signal, independent of the light."""

    @abstractmethod
    def pattern(self, frame: FrameContext) -> Floats:
        """Return the frame's noise, NETD, float32, broadcastable to (rows, cols), read only."""

    @abstractmethod
    def pattern_variance(self, frame: FrameContext, fixed: bool) -> float:
        """Return the variance of a pixel of the pattern, NETD²; see `variance_terms` for `fixed`."""

    def add(self, signal: Floats, response: Response, frame: FrameContext) -> None:
        pattern = self.pattern(frame)
        if pattern.shape == signal.shape:
            cv2.scaleAdd(pattern, response.noise, signal, dst=signal)
        else:
            np.add(signal, pattern * np.float32(response.noise), out=signal)

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance(pixel=self.pattern_variance(frame, fixed))


# Gaussian terms per pixel, row, column or frame

Over = Literal["pixel", "row", "column", "frame"]
"""Elements of an image that have one random number each."""

Term = tuple[str, Over, float]
"""Name of a Gaussian term, its elements and its sigma."""


def element_shape(shape: tuple[int, int], over: Over) -> tuple[int, int]:
    """Return the shape, broadcastable to an image, of one number per pixel, row or column, or for the whole image."""
    rows, columns = shape
    return {"pixel": (rows, columns), "row": (rows, 1), "column": (1, columns), "frame": (1, 1)}[over]


def line_terms(pixel: float, column: float, row: float) -> tuple[Term, ...]:
    """Return the Gaussian terms per pixel, column and row of given sigmas."""
    return ("pixel", "pixel", pixel), ("column", "column", column), ("row", "row", row)


@lru_cache(maxsize=8)
def gaussian_pattern(shape: tuple[int, int], seed: int, name: str, terms: tuple[Term, ...], number: int = 0) -> Floats:
    """Return the sum of Gaussian terms, (rows, cols) float32, read only; each `number` has another pattern."""
    address = (number,) if number else ()
    pattern = np.zeros(shape, np.float32)
    for term, over, sigma in terms:
        pattern += normals(element_shape(shape, over), seed, "noise", name, term, *address) * np.float32(sigma)
    return read_only(pattern)


# Patterns of several terms


class ArrayCache(Generic[Result]):
    """Last result of a function of a shape and arrays, kept as long as the arrays are the same objects.

    It changes no result: a term returns the same array as long as its pattern is the same.
    """

    def __init__(self, compute: Callable[[tuple[int, int], Sequence[Floats]], Result]) -> None:
        self._compute = compute
        self._kept: tuple[tuple[int, int], Sequence[Floats], Result] | None = None

    def of(self, shape: tuple[int, int], arrays: Sequence[Floats]) -> Result:
        kept = self._kept  # read once: another thread may replace it
        if kept is None or kept[0] != shape or len(kept[1]) != len(arrays) or not all(map(is_, kept[1], arrays)):
            kept = self._kept = shape, arrays, self._compute(shape, arrays)
        return kept[2]


def pattern_sum(shape: tuple[int, int], patterns: Sequence[Floats]) -> Sequence[Int16Image]:
    """Return one or two images (rows, cols) that sum to the fixed patterns; none without patterns."""
    if not patterns:
        return ()
    total = np.zeros(shape, np.float32)
    for pattern in patterns:
        total += pattern
    return int16_sum(total, FINEST_UNIT)


def gain_product(shape: tuple[int, int], deviations: Sequence[Floats]) -> Int16Image:
    """Return the relative deviation of the product of several gains, each (rows, cols) float32."""
    first, *others = deviations
    for other in others:
        first = (1 + first) * (1 + other) - np.float32(1)
    return int16_image(first)
