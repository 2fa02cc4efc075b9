"""Paths of random turns: in the picture, in which they stay, and over the ground."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.quantities import LARGEST, TOP_SPEED, Degrees, NotNegative, Number, Pair, PixelSpeed, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.arcs import chord
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import PixelPath, world_to_first
from irsim.motion.headed import HeadedPath, frames_of
from irsim.rng import stream
from irsim.types import Floats

_BAND = 0.35
"""Width of the band inside a box where steering sets in, as a share of the shorter side."""
_STEER = 2.5
"""How much tighter than a half-circle that just fits the band the steering may turn. It sets in softly
and lags: with 2.5 the path stayed in its box in 75 runs of 600 frames at 1 to 6 px per frame."""

Turns = Annotated[float, Field(ge=1, le=LARGEST)]
Edges = Annotated[tuple[Number, Number, Number, Number], Field(strict=False)]
"""(least of the first axis, least of the second, most of the first, most of the second)."""


@dataclass(frozen=True)
class RandomTurns:
    """Coordinated turns at constant speed, in any unit of length; angles from the first axis to the second.

    start     place at frame 0
    speed     length per frame
    heading   rad at frame 0
    sharpest  of the random turns, rad per frame; rates are drawn evenly from both sides
    hold      mean length of a turn, frames
    ease      time constant with which the turn rate follows, frames, at least 1
    box       near the edges of which it steers back, harder than `sharpest` where it must; None: it never does
    """

    start: tuple[float, float]
    speed: float
    heading: float
    sharpest: float
    hold: float
    ease: float
    box: tuple[float, float, float, float] | None

    def places(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """(n, 2) at frame numbers (n,)."""
        frames = np.asarray(frames, dtype=np.float64)
        whole = np.maximum(np.floor(frames), 0).astype(np.int64)
        x, y, heading, rate = _states(self, _rounded_up(int(whole.max(initial=0)) + 1), context.seed, name)[whole].T
        # Within a frame the turn rate holds: an arc, whose chord is exact at fractions too.
        return np.stack([x, y], axis=-1) + chord(self.speed, heading, rate, frames - whole)

    def steering(self) -> Callable[[float, float, float], tuple[float, float]]:
        """From a place and a heading: how much steering counts there, 0..1, and the turn rate that it asks for."""
        if self.box is None:
            return lambda x, y, heading: (0.0, 0.0)
        left, top, right, bottom = self.box
        band = _BAND * min(right - left, bottom - top)
        hardest = max(self.sharpest, min(_STEER * 2 * self.speed / band, 1.0))
        middle = ((left + right) / 2, (top + bottom) / 2)

        def steering(x: float, y: float, heading: float) -> tuple[float, float]:
            # Look ahead by the easing, so that steering sets in before the edge is near.
            ahead_x = x + self.speed * self.ease * math.cos(heading)
            ahead_y = y + self.speed * self.ease * math.sin(heading)
            room = min(ahead_x - left, right - ahead_x, ahead_y - top, bottom - ahead_y)
            steer = min(max(1 - room / band, 0.0), 1.0)
            off = math.remainder(math.atan2(middle[1] - y, middle[0] - x) - heading, 2 * math.pi)
            return steer, min(max(off / self.ease, -hardest), hardest)

        return steering


def _rounded_up(count: int) -> int:
    """The next power of two: who asks for some frames more asks for the same states."""
    return 1 << (count - 1).bit_length()


@lru_cache(maxsize=4)
def _states(turns: RandomTurns, count: int, seed: int, name: str) -> Floats:
    """(count, 4) at frames 0 ..: the two coordinates, heading (rad), turn rate until the next (rad per frame). Kept,
    for places, attitudes and all doubts about them ask for the same."""
    draws = stream(seed, name, "path").random((count, 2)).tolist()
    x, y = turns.start
    heading, rate, wanted = turns.heading, 0.0, 0.0
    steering = turns.steering()
    states = np.empty((count, 4))
    for frame, (chance, drawn) in enumerate(draws):
        if frame == 0 or chance < 1 / turns.hold:
            wanted = turns.sharpest * (2 * drawn - 1)
        steer, back = steering(x, y, heading)
        rate += ((1 - steer) * wanted + steer * back - rate) / turns.ease
        states[frame] = x, y, heading, rate
        chord = turns.speed * (math.sin(rate / 2) / (rate / 2) if rate else 1.0)
        x += chord * math.cos(heading + rate / 2)
        y += chord * math.sin(heading + rate / 2)
        heading += rate
    states.flags.writeable = False
    return states


def _check(box: tuple[float, float, float, float] | None, key: str, names: str) -> None:
    """PydanticCustomError at `key` for a box with nothing in it."""
    if box is not None and (box[0] >= box[2] or box[1] >= box[3]):
        raise PydanticCustomError("box", "the box is empty; allowed: {names} that rise", {"names": names, "at": (key,)})


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
    keep_in_px: Edges | None = None
    """[left, top, right, bottom] that it stays in, px; the frame less a tenth on each side where not given."""

    @model_validator(mode="after")
    def _box_is_open(self) -> Manoeuvre:
        _check(self.keep_in_px, "keep_in_px", "[left, top, right, bottom]")
        return self

    def pixels(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        columns, rows = context.geometry.size
        inset = (0.1 * columns, 0.1 * rows, 0.9 * columns, 0.9 * rows)
        turns = RandomTurns(
            self.start,
            self.speed,
            math.radians(self.heading_deg),
            math.radians(self.turn_deg),
            self.hold_frames,
            self.ease_frames,
            self.keep_in_px or inset,
        )
        return turns.places(frames, context, name)


class ManoeuvreM(HeadedPath):
    """Coordinated turns in level flight at constant speed: now and then a new turn rate is drawn, and the rate eases
    towards it. `turn_g: 0` flies straight until it has to steer back into `keep_in_m`."""

    speed_m_s: Annotated[Positive, TOP_SPEED] = 200.0
    """Over ground, metres a second."""
    turn_g: NotNegative = 3.0
    """Acceleration across its way in the sharpest random turn, in g: its rate is turn_g g / speed. Rates are drawn
    evenly from both sides."""
    hold_s: Positive = 3.0
    """Mean length of one turn, s; no less than a frame."""
    ease_s: NotNegative = 0.5
    """Time constant with which the turn rate follows, s; no less than a frame."""
    keep_in_m: Edges | None = None
    """[west, south, east, north] that it stays in over the ground, m from where the camera first stands: east is to its
    right, north level ahead of it. Near the edge it pulls more than turn_g where it must, up to
    1.5 speed_m_s^2 / shorter side in g: 15 g at 200 m/s in 4 km. Where not given it goes where it will."""

    @model_validator(mode="after")
    def _box_is_open(self) -> ManoeuvreM:
        _check(self.keep_in_m, "keep_in_m", "[west, south, east, north]")
        return self

    def positions(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        east, north, up = self.to_world(np.array(self.start_m), context).tolist()
        box = self.keep_in_m
        # North is the first axis and east the second: headings grow from north to east.
        turns = RandomTurns(
            (north, east),
            self.speed_m_s / context.rate_hz,
            math.radians(self.heading_deg),
            self.turn_g * STANDARD_GRAVITY / self.speed_m_s / context.rate_hz,
            frames_of(self.hold_s, context),
            frames_of(self.ease_s, context),
            box and (box[1], box[0], box[3], box[2]),
        )
        north_m, east_m = turns.places(frames, context, name).T
        return world_to_first(np.stack([east_m, north_m, up + self.climbed(frames, context)], axis=-1), context)
