"""Paths of random coordinated turns whose turn rates change smoothly."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from irsim.config.quantities import LARGEST, TOP_SPEED, NotNegative, Number, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.attitude import STANDARD_GRAVITY
from irsim.motion.base import HeadedPath, HeadedPixelPath, frames_of, path_error, world_to_first
from irsim.motion.curves import chord
from irsim.rng import stream
from irsim.types import Floats

_BAND = 0.35
"""Width of the band along the edges in which steering begins, as a share of the shorter side."""
_STEER = 2.5
"""Largest turn rate of steering over the turn rate in a half-circle that fits the band. Steering begins softly and
lags: with 2.5 the path stayed in its box in 75 runs of 600 frames at 1 to 6 px per frame."""

Frames = Annotated[float, Field(ge=1, le=LARGEST)]
Edges = Annotated[tuple[Number, Number, Number, Number], Field(strict=False)]
"""Edges of a box: (least of the first axis, least of the second, most of the first, most of the second)."""


@dataclass(frozen=True)
class RandomTurns:
    """Coordinated turns at constant speed, in any unit of length; angles run from the first axis to the second.

    start     position at frame 0
    speed     distance per frame
    heading   rad at frame 0
    sharpest  largest random turn rate, rad per frame; rates are uniform in ± sharpest
    hold      mean duration of a turn, frames
    ease      time constant with which the turn rate follows, frames, at least 1
    box       region into which the path steers back, faster than `sharpest` if necessary; None: no steering
    """

    start: tuple[float, float]
    speed: float
    heading: float
    sharpest: float
    hold: float
    ease: float
    box: tuple[float, float, float, float] | None

    def places(self, frames: Floats, context: SceneContext, name: str) -> Floats:
        """Return positions (n, 2) at frame numbers (n,)."""
        frames = np.asarray(frames, dtype=np.float64)
        whole = np.maximum(np.floor(frames), 0).astype(np.int64)
        # A power of two: calls for slightly more frames share one cached sequence.
        count = 1 << int(whole.max(initial=0)).bit_length()
        x, y, heading, rate = _states(self, count, context.seed, name)[whole].T
        # Within a frame the turn rate holds: an arc, whose chord is exact at fractions too.
        return np.stack([x, y], axis=-1) + chord(self.speed, heading, rate, frames - whole)

    def steering(self) -> Callable[[float, float, float], tuple[float, float]]:
        """Return a function of position and heading: the weight of steering, 0..1, and its turn rate."""
        if self.box is None:
            return lambda x, y, heading: (0.0, 0.0)
        left, top, right, bottom = self.box
        band = _BAND * min(right - left, bottom - top)
        hardest = max(self.sharpest, min(_STEER * 2 * self.speed / band, 1.0))
        middle = ((left + right) / 2, (top + bottom) / 2)

        def steering(x: float, y: float, heading: float) -> tuple[float, float]:
            # Predict by the time constant, so that steering begins before the edge.
            ahead_x = x + self.speed * self.ease * math.cos(heading)
            ahead_y = y + self.speed * self.ease * math.sin(heading)
            room = min(ahead_x - left, right - ahead_x, ahead_y - top, bottom - ahead_y)
            steer = min(max(1 - room / band, 0.0), 1.0)
            off = math.remainder(math.atan2(middle[1] - y, middle[0] - x) - heading, 2 * math.pi)
            return steer, min(max(off / self.ease, -hardest), hardest)

        return steering


@lru_cache(maxsize=4)
def _states(turns: RandomTurns, count: int, seed: int, name: str) -> Floats:
    """Return (count, 4) at frames 0...: two coordinates, heading (rad), turn rate until the next frame (rad).

    The states are cached, as positions, attitudes and lint all use them.
    """
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


def _check_box(box: tuple[float, float, float, float] | None, key: str, names: str) -> None:
    """Raise PydanticCustomError at `key` if a box is empty."""
    if box is not None and (box[0] >= box[2] or box[1] >= box[3]):
        raise path_error("the box is empty; allowed: {names} that rise", key, names=names)


class Manoeuvre(HeadedPixelPath):
    """Coordinated turns at constant speed, with turn rates drawn at random times and approached smoothly.

    Near the edge of `keep_in_px` the path steers back, faster than `turn_deg` if necessary. The turn rate of steering
    is limited to 1 rad per frame, which is too low for a box that is crossed in a few frames. With `turn_deg: 0` the
    path is straight until it steers.
    """

    turn_deg: Annotated[float, Field(ge=0, le=90)] = 3.0
    """Largest random turn rate, degrees per frame; rates are uniform in ± turn_deg."""
    hold_frames: Frames = 30.0
    """Mean duration of a turn, frames."""
    ease_frames: Frames = 5.0
    """Time constant with which the turn rate approaches the drawn one, frames."""
    keep_in_px: Edges | None = None
    """[left, top, right, bottom] of the region of the path, px. Default: the frame less a tenth on each side."""

    @model_validator(mode="after")
    def _box_is_open(self) -> Manoeuvre:
        _check_box(self.keep_in_px, "keep_in_px", "[left, top, right, bottom]")
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
    """Coordinated turns in level flight at constant speed, with turn rates drawn at random times and approached
    smoothly.

    With `turn_g: 0` the path is straight until it steers back into `keep_in_m`.
    """

    speed_m_s: Annotated[Positive, TOP_SPEED] = 200.0
    """Ground speed, m/s."""
    turn_g: NotNegative = 3.0
    """Lateral acceleration of the sharpest random turn, in g. Turn rates are uniform in ± `turn_g` g / speed."""
    hold_s: Positive = 3.0
    """Mean duration of a turn, s; at least one frame."""
    ease_s: NotNegative = 0.5
    """Time constant with which the turn rate approaches the drawn one, s; at least one frame."""
    keep_in_m: Edges | None = None
    """[west, south, east, north] of the region of the path, m from the first camera position; east is right of it,
    north level ahead. Near the edge the acceleration exceeds `turn_g` if necessary, up to 1.5 times the squared speed
    over the shorter side: 15 g at 200 m/s in 4 km. Default: no limits."""

    @model_validator(mode="after")
    def _box_is_open(self) -> ManoeuvreM:
        _check_box(self.keep_in_m, "keep_in_m", "[west, south, east, north]")
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
        return world_to_first(np.stack([east_m, north_m, up + self.climb(frames, context)], axis=-1), context)


TurnRate = Annotated[float, Field(ge=-90, le=90)]
