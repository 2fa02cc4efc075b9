"""A way that is gone on and stopped on by turns."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from irsim.kinds import LARGEST, Degrees, NotNegative, Pair, PixelSpeed
from irsim.motion.base import PixelPath
from irsim.motion.straight import unit
from irsim.rng import stream
from irsim.stage import Stage
from irsim.types import Floats


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
    vary: Annotated[float, Field(ge=0, le=0.9)] = 0.0
    """Each length is drawn evenly from (1 - vary) to (1 + vary) times the given one."""
    ease_frames: NotNegative = 6.0
    """Time it takes to come to rest or to full speed, frames; at most half a go."""

    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        times, speeds = self._speeds(float(frames.max(initial=0.0)), stage, name)
        ways = np.append(0.0, np.cumsum((speeds[1:] + speeds[:-1]) / 2 * np.diff(times)))
        leg = np.clip(np.searchsorted(times, frames, side="right") - 1, 0, len(times) - 2)
        part, span = frames - times[leg], times[leg + 1] - times[leg]
        gain = np.where(frames < 0, 0.0, (speeds[leg + 1] - speeds[leg]) / span)
        way = ways[leg] + speeds[leg] * part + gain * part**2 / 2
        return np.asarray(np.asarray(self.start) + way[:, None] * unit(self.heading_deg))

    def _speeds(self, last: float, stage: Stage, name: str) -> tuple[Floats, Floats]:
        """Frames and speeds between which the speed changes evenly, beyond frame `last`."""
        shortest = (1 - self.vary) * (self.go_frames + self.stop_frames)
        count = int(last / shortest) + 2
        drawn = 1 + self.vary * (2 * stream(stage.seed, name, "path").random((count, 2)) - 1)
        goes, stops = drawn.T * np.array([[self.go_frames], [self.stop_frames]])
        begins = np.append(0.0, np.cumsum(goes + stops))[:-1]
        ease = np.maximum(np.minimum(self.ease_frames, goes / 2), 1e-6)
        times = np.stack([begins, begins + ease, begins + goes - ease, begins + goes], axis=1)
        speeds = np.tile([0.0, self.speed, self.speed, 0.0], (count, 1))
        speeds[0, 0] = self.speed
        # A stop of no length would end a go where the next begins: its two ends are a moment apart.
        return np.maximum.accumulate(times.ravel() + 1e-9 * np.arange(times.size)), speeds.ravel()
