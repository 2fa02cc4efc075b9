"""Ways that are gone on and stopped on by turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.config.quantities import LARGEST, TOP_SPEED, Degrees, NotNegative, Pair, PixelSpeed, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.base import PixelPath
from irsim.motion.headed import HeadedPath, frames_of
from irsim.motion.straight import unit
from irsim.rng import stream
from irsim.types import Floats

Share = Annotated[float, Field(ge=0, le=0.9)]


@dataclass(frozen=True)
class Stops:
    """The pace of what goes and stops by turns, in any unit of length.

    speed  while it goes, length per frame
    go     frames of a go, with getting under way and coming to rest; the first begins at full speed
    stop   frames of a stop
    ease   frames in which it comes to rest or to full speed; at most half a go
    vary   each length is drawn evenly from (1 - vary) to (1 + vary) times the given one
    """

    speed: float
    go: float
    stop: float
    ease: float
    vary: float

    def way(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """(n,) how far it has gone since frame 0, at frame numbers (n,)."""
        frames = np.asarray(frames, dtype=np.float64)
        times, speeds = self.paces(float(frames.max(initial=0.0)), context, name)
        ways = np.append(0.0, np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times)))
        leg = np.clip(np.searchsorted(times, frames, side="right") - 1, 0, len(times) - 2)
        part, span = frames - times[leg], times[leg + 1] - times[leg]
        gain = np.where(frames < 0, 0.0, (speeds[leg + 1] - speeds[leg]) / span)
        return np.asarray(ways[leg] + speeds[leg] * part + gain * part**2 / 2)

    def paces(self, last: float, context: SceneContext, name: str) -> tuple[Floats, Floats]:
        """Frames and speeds between which the speed changes evenly, beyond frame `last`."""
        shortest = (1 - self.vary) * (self.go + self.stop)
        count = int(last / shortest) + 2
        drawn = 1 + self.vary * (2 * stream(context.seed, name, "path").random((count, 2)) - 1)
        goes, stops = drawn.T * np.array([[self.go], [self.stop]])
        begins = np.append(0.0, np.cumsum(goes + stops))[:-1]
        ease = np.maximum(np.minimum(self.ease, goes / 2), 1e-6)
        times = np.stack([begins, begins + ease, begins + goes - ease, begins + goes], axis=1)
        speeds = np.tile([0.0, self.speed, self.speed, 0.0], (count, 1))
        speeds[0, 0] = self.speed
        # A stop of no length would end a go where the next begins: its two ends are a moment apart.
        return np.maximum.accumulate(times.ravel() + 1e-9 * np.arange(times.size)), speeds.ravel()


class StopAndGo(PixelPath):
    """A straight way in the picture that it goes and stops on by turns."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """While it goes, px per frame."""
    heading_deg: Degrees = 0.0
    """Direction, degrees: 0 right, 90 down."""
    go_frames: Annotated[float, Field(ge=1, le=LARGEST)] = 40.0
    """Length of a go, frames, with getting under way and coming to rest; the first begins at full speed."""
    stop_frames: NotNegative = 20.0
    """Length of a stop, frames."""
    vary: Share = 0.0
    """Each length is drawn evenly from (1 - vary) to (1 + vary) times the given one."""
    ease_frames: NotNegative = 6.0
    """Time it takes to come to rest or to full speed, frames; at most half a go."""

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        stops = Stops(self.speed, self.go_frames, self.stop_frames, self.ease_frames, self.vary)
        way = stops.way(frames, context, name)
        return np.asarray(np.asarray(self.start) + way[:, None] * unit(self.heading_deg))


class StopAndGoM(HeadedPath):
    """A straight way in space that it goes and stops on by turns; the speed and the climb are those while it goes."""

    speed_m_s: Annotated[NotNegative, TOP_SPEED] = 10.0
    """Over ground while it goes, metres a second."""
    go_s: Positive = 5.0
    """Length of a go, s, with getting under way and coming to rest; the first begins at full speed. No less than a
    frame."""
    stop_s: NotNegative = 2.0
    """Length of a stop, s."""
    vary: Share = 0.0
    """Each length is drawn evenly from (1 - vary) to (1 + vary) times the given one."""
    ease_s: NotNegative = 2.0
    """Time it takes to come to rest or to full speed, s; at most half a go. 2 s from 10 m/s are 0.5 g, hard braking."""

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        rate_hz = context.rate_hz
        stops = Stops(1.0, frames_of(self.go_s, context), self.stop_s * rate_hz, self.ease_s * rate_hz, self.vary)
        seconds = stops.way(frames, context, name) / rate_hz
        return self.laid(self.speed_m_s * seconds, np.zeros_like(seconds), self.climb_m_s * seconds, context)
