"""A path of random turns that stays in the picture."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.kinds import LARGEST, Degrees, Number, Pair, PixelSpeed
from irsim.motion.arcs import chord
from irsim.motion.base import PixelPath
from irsim.rng import stream
from irsim.stage import Stage
from irsim.types import Floats

_BAND = 0.35
"""Width of the band inside `keep_in_px` where steering sets in, as a share of the shorter side."""
_STEER = 2.5
"""How much tighter than a half-circle that just fits the band the steering may turn. It sets in softly
and lags: with 2.5 the path stayed in its box in 75 runs of 600 frames at 1 to 6 px per frame."""

Turns = Annotated[float, Field(ge=1, le=LARGEST)]


class Manoeuvre(PixelPath):
    """Coordinated turns at constant speed: now and then a new turn rate is drawn, and the rate eases
    towards it. Near the edge of `keep_in_px` it steers back, harder than `turn_deg` where it must (up to
    1 rad per frame: a box of a few frames' way is too small to stay in).
    `turn_deg: 0` flies straight until it has to steer."""

    start: Pair
    """[x, y] at frame 0, px."""
    speed: PixelSpeed = 2.0
    """Px per frame."""
    heading_deg: Degrees = 0.0
    """Direction at frame 0, degrees: 0 right, 90 down."""
    turn_deg: Annotated[float, Field(ge=0, le=90)] = 3.0
    """Sharpest random turn, degrees per frame; rates are drawn evenly from both sides."""
    hold_frames: Turns = 30.0
    """Mean length of one turn, frames."""
    ease_frames: Turns = 5.0
    """Time constant with which the turn rate follows, frames."""
    keep_in_px: Annotated[tuple[Number, Number, Number, Number], Field(strict=False)] | None = None
    """[left, top, right, bottom] that it stays in, px; the frame less a tenth on each side where not given."""

    @model_validator(mode="after")
    def _box_is_open(self) -> Manoeuvre:
        if self.keep_in_px is not None:
            left, top, right, bottom = self.keep_in_px
            if left >= right or top >= bottom:
                raise PydanticCustomError(
                    "keep_in_px",
                    "the box is empty; allowed: [left, top, right, bottom] that rise",
                    {"at": ("keep_in_px",)},
                )
        return self

    def pixels(self, frames: Floats, stage: Stage, name: str) -> Floats:
        frames = np.asarray(frames, dtype=np.float64)
        whole = np.maximum(np.floor(frames), 0).astype(np.int64)
        x, y, heading, rate = self._states(int(whole.max(initial=0)) + 1, stage, name)[whole].T
        # Within a frame the turn rate holds: an arc, whose chord is exact at fractions too.
        return np.stack([x, y], axis=-1) + chord(self.speed, heading, rate, frames - whole)

    def _states(self, count: int, stage: Stage, name: str) -> Floats:
        """(count, 4) at frames 0 ..: x, y (px), heading (rad), turn rate until the next (rad per frame)."""
        columns, rows = stage.geometry.size
        inset = (0.1 * columns, 0.1 * rows, 0.9 * columns, 0.9 * rows)
        left, top, right, bottom = self.keep_in_px or inset
        band = _BAND * min(right - left, bottom - top)
        sharpest = math.radians(self.turn_deg)
        hardest = max(sharpest, min(_STEER * 2 * self.speed / band, 1.0))
        middle = ((left + right) / 2, (top + bottom) / 2)
        draws = stream(stage.seed, name, "path").random((count, 2)).tolist()
        x, y = self.start
        heading, rate, wanted = math.radians(self.heading_deg), 0.0, 0.0
        states = []
        for frame, (chance, drawn) in enumerate(draws):
            if frame == 0 or chance < 1 / self.hold_frames:
                wanted = sharpest * (2 * drawn - 1)
            # Look ahead by the easing, so that steering sets in before the edge is near.
            ahead_x = x + self.speed * self.ease_frames * math.cos(heading)
            ahead_y = y + self.speed * self.ease_frames * math.sin(heading)
            room = min(ahead_x - left, right - ahead_x, ahead_y - top, bottom - ahead_y)
            steer = min(max(1 - room / band, 0.0), 1.0)
            off = math.remainder(math.atan2(middle[1] - y, middle[0] - x) - heading, 2 * math.pi)
            back = min(max(off / self.ease_frames, -hardest), hardest)
            rate += ((1 - steer) * wanted + steer * back - rate) / self.ease_frames
            states.append((x, y, heading, rate))
            chord = self.speed * (math.sin(rate / 2) / (rate / 2) if rate else 1.0)
            x += chord * math.cos(heading + rate / 2)
            y += chord * math.sin(heading + rate / 2)
            heading += rate
        return np.array(states)
