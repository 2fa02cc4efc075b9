"""Bad pixels: dead, hot and blinking pixels, in clusters."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.camera.ar1 import StationaryBridge
from irsim.camera.noise_base import BLOCK_FRAMES, FrameContext, Noise, NoiseVariance, Ratio
from irsim.camera.response import Response
from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Positive
from irsim.rng import stream, uniforms
from irsim.types import Bools, Counts, Floats, read_only

Address = tuple[int, str, str, str]

Indices = npt.NDArray[np.intp]
"""Flat indices of pixels."""

MAX_BAD = 0.2
"""Largest share of dead, of hot and of blinking pixels; with more, clusters would cover the picture."""

Share = Annotated[float, Field(ge=0, le=MAX_BAD)]

TELEGRAPH_PIXELS = 1 << 16
"""Pixels whose telegraph signals are drawn together for a block of frames, which takes about 40 MB."""


class BadPixels(Noise):
    """Dead, hot and blinking pixels, in clusters. Real cameras have 0.05 to 0.5 % of them.

    A blinking pixel jumps between two levels at random (random telegraph signal). Offsets of hot pixels and jumps of
    blinking ones are drawn from exponential distributions; jumps go up or down.
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {defect: (defect, 0.0) for defect in ("dead", "hot", "blinking")}

    dead: Share = 0.0005
    """Share of pixels that do not respond to light."""
    hot: Share = 0.0005
    """Share of pixels with an offset far too high."""
    blinking: Share = 0.001
    """Share of pixels that blink."""
    cluster: Annotated[float, Field(ge=1, le=100)] = 2.0
    """Mean number of pixels in a cluster."""
    dead_level: Fraction = 0.0
    """Level of dead pixels: 0 is count 0, 1 the highest count."""
    hot_ratio: Ratio = 100.0
    """Mean offset of hot pixels, in units of the camera's NETD; the least offset is half the mean."""
    blink_ratio: Ratio = 20.0
    """Mean height of a blinking pixel's jump, in units of the camera's NETD. Heights are exponential; half of the
    pixels jump up, half down."""
    on_s: Positive = 0.5
    """Mean dwell time of a blinking pixel off its normal level, s."""
    off_s: Positive = 2.0
    """Mean dwell time of a blinking pixel on its normal level, s."""

    def add(self, signal: Floats, response: Response, frame: FrameContext) -> None:
        blinking, jumps = self._blinking(response, frame)
        if blinking.size:
            signal.reshape(-1)[blinking] += jumps * self._telegraph(frame, blinking.size).frame(frame.index)

    def fixed_pattern(self, frame: FrameContext) -> Floats | None:
        if not self.hot:
            return None
        return _hot_pattern(frame.shape, self.hot, self.cluster, frame.seed, self.name, self.hot_ratio)

    def replace_counts(self, counts: Counts, response: Response, frame: FrameContext) -> None:
        counts.reshape(-1)[self._pixels("dead", self.dead, frame)] = round(self.dead_level * response.full)

    def variance_terms(self, frame: FrameContext, fixed: bool) -> NoiseVariance:
        return NoiseVariance()  # ordinary pixels are unaffected

    def variance(self, signal: Floats, response: Response, frame: FrameContext, fixed: bool) -> Floats | float:
        """Return the variance of each pixel, signal²; infinite for dead pixels.

        A blinking pixel with a jump h, off its normal level for a share p of the time, has p h² about the noiseless
        signal and p (1 - p) h² about its own mean. A hot pixel of offset h has h² about the noiseless signal and 0
        about its own mean.
        """
        variance = np.zeros(signal.size)
        on = self.on_s / (self.on_s + self.off_s)
        blinking, jumps = self._blinking(response, frame)
        variance[blinking] = (on if fixed else on * (1 - on)) * jumps.astype(np.float64) ** 2
        hot = self.fixed_pattern(frame) if fixed else None
        if hot is not None:
            variance += (hot.ravel().astype(np.float64) * response.noise) ** 2
        variance[self._pixels("dead", self.dead, frame)] = math.inf
        return variance.reshape(signal.shape)

    def _pixels(self, defect: str, share: float, frame: FrameContext) -> Indices:
        return clustered_pixels(frame.shape, share, self.cluster, frame.seed, self.name, defect)

    def _blinking(self, response: Response, frame: FrameContext) -> tuple[Indices, Floats]:
        """Return the blinking pixels and their jumps in units of the signal."""
        blinking = self._pixels("blinking", self.blinking, frame)
        mean = self.blink_ratio * response.noise
        return blinking, _jumps(frame.seed, self.name, "jumps", blinking.size, mean)

    def _telegraph(self, frame: FrameContext, count: int) -> TelegraphProcess:
        address = frame.seed, "noise", self.name, "telegraph"
        return _telegraph(self.on_s * frame.rate_hz, self.off_s * frame.rate_hz, count, address)


@lru_cache(maxsize=16)
def _jumps(seed: int, name: str, word: str, count: int, mean: float = 1.0) -> Floats:
    """Draw exponential numbers of mean `mean`, each with a random sign, (count,) float32."""
    drawn = stream(seed, "noise", name, word).random((2, count))
    jumps = mean * (np.where(drawn[0] < 0.5, -1.0, 1.0) * -np.log1p(-drawn[1]))
    return read_only(jumps.astype(np.float32))


@lru_cache(maxsize=4)
def _hot_pattern(shape: tuple[int, int], share: float, cluster: float, seed: int, name: str, mean: float) -> Floats:
    """Return the heights of hot pixels, 0 elsewhere: half the mean plus an exponential number of half the mean."""
    hot = clustered_pixels(shape, share, cluster, seed, name, "hot")
    pattern = np.zeros(shape, np.float32)
    pattern.reshape(-1)[hot] = mean * (0.5 + 0.5 * np.abs(_jumps(seed, name, "hot heights", hot.size)))
    return read_only(pattern)


@lru_cache(maxsize=16)
def clustered_pixels(shape: tuple[int, int], share: float, cluster: float, seed: int, name: str, word: str) -> Indices:
    """Draw flat indices of round(share * pixels) different pixels, in clusters of `cluster` on average.

    A cluster grows by 4-neighbours of its pixels; its size has a geometric distribution.
    """
    rows, columns = shape
    wanted = round(share * rows * columns)
    draws = stream(seed, "noise", name, word)
    found: dict[int, None] = {}
    while len(found) < wanted:
        size = min(int(draws.geometric(1 / cluster)), wanted - len(found))
        members = [(int(draws.integers(rows)), int(draws.integers(columns)))]
        while len(members) < size:
            row, column = members[int(draws.integers(len(members)))]
            down, right = ((0, 1), (0, -1), (1, 0), (-1, 0))[int(draws.integers(4))]
            neighbour = (min(max(row + down, 0), rows - 1), min(max(column + right, 0), columns - 1))
            if neighbour not in members:
                members.append(neighbour)
        found.update(dict.fromkeys(row * columns + column for row, column in members))
    return np.array(list(found), np.intp)


class TelegraphProcess:
    """Random telegraph signals of `count` blinking pixels: Markov chains with the two states on and off.

    `on` and `off` are the mean dwell times, frames. Over d frames the correlation falls to exp(-d (1/on + 1/off)).
    Given the states before and after, d frames away, the odds of on are P(on | before) P(after | on) to P(off | before)
    P(after | off). Every BLOCK_FRAMES-th frame is drawn by a bridge, the frames between them together.
    """

    def __init__(self, on: float, off: float, count: int, address: Address) -> None:
        self.blocks = _BlockStarts(on, off, count, address)
        self._kept: tuple[int, Bools] | None = None

    def frame(self, index: int) -> Bools:
        """Return the states at frame `index`, (count,), read only."""
        block, at = divmod(index, BLOCK_FRAMES)
        kept = self._kept  # read once: another thread may replace it
        if kept is None or kept[0] != block:
            kept = self._kept = block, self._draw(block)
        return np.asarray(kept[1][at])

    def _draw(self, block: int) -> Bools:
        """Return the states at the frames of a block and at the first of the next block, (BLOCK_FRAMES + 1, count)."""
        blocks = self.blocks
        states = np.empty((BLOCK_FRAMES + 1, blocks.count), np.bool_)
        states[0], states[-1] = blocks.frame(block), blocks.frame(block + 1)
        for first in range(0, blocks.count, TELEGRAPH_PIXELS):
            self._fill(states[:, first : first + TELEGRAPH_PIXELS], block, first)
        return states

    def _fill(self, states: Bools, block: int, first: int) -> None:
        """Draw the states between the first and the last row of `states`, for the pixels from number `first` on."""
        count = states.shape[1]
        uniform = uniforms(BLOCK_FRAMES * count, *self.blocks.address, "frames", block, first)
        uniform = uniform.reshape(BLOCK_FRAMES, count)
        distance = BLOCK_FRAMES // 2
        while distance:
            known, middle = states[:: 2 * distance], slice(distance, None, 2 * distance)
            states[middle] = self.blocks.midpoint(known[:-1], known[1:], uniform[middle], distance)
            distance //= 2


class _BlockStarts(StationaryBridge[Bools]):
    """Telegraph signals at the first frame of each block, indexed by the block's number."""

    def __init__(self, on: float, off: float, count: int, address: Address) -> None:
        self.frame_decay = 1 / on + 1 / off
        super().__init__(self.frame_decay * BLOCK_FRAMES)
        self.share = on / (on + off)
        self.count = count
        self.address = address

    def anchor(self, index: int) -> Bools:
        return self._uniform(index) < self.share

    def between(self, before: Bools, after: Bools, index: int, distance: int) -> Bools:
        return self.midpoint(before, after, self._uniform(index), distance * BLOCK_FRAMES)

    def midpoint(self, before: Bools, after: Bools, uniform: Floats, frames: int) -> Bools:
        """Return the states `frames` frames after `before` and before `after`, from uniform numbers within 0..1."""
        if_on, either = _odds(self.share, math.exp(-self.frame_decay * frames))
        ends = before.view(np.uint8) + (after.view(np.uint8) << 1)
        return np.asarray(uniform * either[ends] < if_on[ends])

    def _uniform(self, index: int) -> npt.NDArray[np.float64]:
        return uniforms(self.count, *self.address, "block", index)


@lru_cache(maxsize=32)
def _odds(share: float, correlation: float) -> tuple[Floats, Floats]:
    """Return P(on | before) P(after | on), and its sum with P(off | before) P(after | off), (4,) each.

    The four pairs (before, after) are off and off, on and off, off and on, on and on; `share` is the share of time on.
    """
    from_on, from_off = share + (1 - share) * correlation, share * (1 - correlation)
    if_on = np.outer([1 - from_on, from_on], [from_off, from_on]).ravel()
    return if_on, if_on + np.outer([1 - from_off, from_off], [1 - from_off, 1 - from_on]).ravel()


@lru_cache(maxsize=8)
def _telegraph(on: float, off: float, count: int, address: Address) -> TelegraphProcess:
    return TelegraphProcess(on, off, count, address)
