"""Pixels that do not do what the others do."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import Field

from irsim.camera.noise_base import FrameContext, Noise, Ratio, read_only
from irsim.camera.response import Response
from irsim.camera.telegraph import Address, Telegraph
from irsim.camera.variance import Variance
from irsim.config.base import Switches
from irsim.config.quantities import Fraction, Positive
from irsim.rng import stream
from irsim.types import Counts, Floats

Places = npt.NDArray[np.intp]
MOST_BAD = 0.2
"""Share of the pixels that may be dead, hot or blinking, each: clusters of more would cover the picture."""
Share = Annotated[float, Field(ge=0, le=MOST_BAD)]


class BadPixels(Noise):
    """Dead, hot and blinking pixels, in clusters. Real cameras have 0.05 to 0.5 % of them.

    A blinking pixel jumps between two levels at random (random telegraph signal). Heights of hot and
    blinking pixels differ from pixel to pixel: exponential, in blinking ones up or down.
    """

    stationary: ClassVar[bool] = True
    switches: ClassVar[Switches] = {what: (what, 0.0) for what in ("dead", "hot", "blinking")}

    dead: Share = 0.0005
    """Share of pixels that do not answer."""
    hot: Share = 0.0005
    """Share of pixels that lie too high."""
    blinking: Share = 0.001
    """Share of pixels that blink."""
    cluster: Annotated[float, Field(ge=1, le=100)] = 2.0
    """Mean number of pixels that go bad together."""
    dead_level: Fraction = 0.0
    """Where dead pixels stand: 0 is count 0, 1 the highest."""
    hot_ratio: Ratio = 100.0
    """Mean height of hot pixels, in units of the camera's NETD; the lowest lie at half of it."""
    blink_ratio: Ratio = 20.0
    """Mean height of a blinking pixel's jump, exponential, up in half of them and down in the others, in units of the
    camera's NETD."""
    on_s: Positive = 0.5
    """Mean time that a blinking pixel stays away from its own level, s."""
    off_s: Positive = 2.0
    """Mean time that a blinking pixel stays at its own level, s."""

    def add(self, signal: Floats, response: Response, frame_context: FrameContext) -> None:
        blinking, jumps = self._blinking(response, frame_context)
        if blinking.size:
            signal.reshape(-1)[blinking] += jumps * self._telegraph(frame_context, blinking.size).frame(
                frame_context.index
            )

    def steady(self, frame_context: FrameContext) -> Floats | None:
        if not self.hot:
            return None
        return _raised(frame_context.shape, self.hot, self.cluster, frame_context.seed, self.name, self.hot_ratio)

    def replace(self, counts: Counts, response: Response, frame_context: FrameContext) -> None:
        counts.reshape(-1)[self._places("dead", self.dead, frame_context)] = round(self.dead_level * response.full)

    def share(self, frame_context: FrameContext, fixed: bool) -> Variance:
        return Variance()  # the others have nothing of it

    def variance(self, signal: Floats, response: Response, frame_context: FrameContext, fixed: bool) -> Floats | float:
        """Of the pixels where they are: infinite for dead ones; for blinking ones height^2 in their share p of time on,
        p (1 - p) height^2 about their own mean; for hot ones height^2, nothing about their own mean."""
        variance = np.zeros(signal.size)
        on = self.on_s / (self.on_s + self.off_s)
        blinking, jumps = self._blinking(response, frame_context)
        variance[blinking] = (on if fixed else on * (1 - on)) * jumps.astype(np.float64) ** 2
        raised = self.steady(frame_context) if fixed else None
        if raised is not None:
            variance += (raised.ravel().astype(np.float64) * response.noise) ** 2
        variance[self._places("dead", self.dead, frame_context)] = math.inf
        return variance.reshape(signal.shape)

    def _places(self, what: str, share: float, frame_context: FrameContext) -> Places:
        return places(frame_context.shape, share, self.cluster, frame_context.seed, self.name, what)

    def _blinking(self, response: Response, frame_context: FrameContext) -> tuple[Places, Floats]:
        """Where they are, and their jumps in units of the signal."""
        blinking = self._places("blinking", self.blinking, frame_context)
        mean = self.blink_ratio * response.noise
        return blinking, _jumps(frame_context.seed, self.name, "jumps", blinking.size, mean)

    def _telegraph(self, frame_context: FrameContext, count: int) -> Telegraph:
        address = frame_context.seed, "noise", self.name, "telegraph"
        return _telegraph(self.on_s * frame_context.rate_hz, self.off_s * frame_context.rate_hz, count, address)


@lru_cache(maxsize=16)
def _jumps(seed: int, name: str, what: str, count: int, mean: float = 1.0) -> Floats:
    """Exponential numbers of that mean, each with a sign of its own, float32."""
    drawn = stream(seed, "noise", name, what).random((2, count))
    jumps = mean * (np.where(drawn[0] < 0.5, -1.0, 1.0) * -np.log1p(-drawn[1]))
    return read_only(jumps.astype(np.float32))


@lru_cache(maxsize=4)
def _raised(shape: tuple[int, int], share: float, cluster: float, seed: int, name: str, mean: float) -> Floats:
    """Heights of hot pixels where they are, 0 elsewhere: exponential, of half the mean, above half the mean."""
    hot = places(shape, share, cluster, seed, name, "hot")
    raised = np.zeros(shape, np.float32)
    raised.reshape(-1)[hot] = mean * (0.5 + 0.5 * np.abs(_jumps(seed, name, "hot heights", hot.size)))
    return read_only(raised)


@lru_cache(maxsize=16)
def places(shape: tuple[int, int], share: float, cluster: float, seed: int, name: str, what: str) -> Places:
    """Flat indices of round(share * pixels) different pixels, in clusters of `cluster` on average.

    A cluster grows by neighbours (of four) of its pixels; its size is geometric.
    """
    rows, columns = shape
    wanted = round(share * rows * columns)
    draws = stream(seed, "noise", name, what)
    found: dict[int, None] = {}
    while len(found) < wanted:
        size = min(int(draws.geometric(1 / cluster)), wanted - len(found))
        members = [(int(draws.integers(rows)), int(draws.integers(columns)))]
        while len(members) < size:
            row, column = members[int(draws.integers(len(members)))]
            down, right = ((0, 1), (0, -1), (1, 0), (-1, 0))[int(draws.integers(4))]
            beside = (min(max(row + down, 0), rows - 1), min(max(column + right, 0), columns - 1))
            if beside not in members:
                members.append(beside)
        found.update(dict.fromkeys(row * columns + column for row, column in members))
    return np.array(list(found), np.intp)


@lru_cache(maxsize=8)
def _telegraph(on: float, off: float, count: int, address: Address) -> Telegraph:
    return Telegraph(on, off, count, address)
