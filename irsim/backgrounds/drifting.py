"""A cloud layer that changes: painted now and then, mixed and moved in between."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import cv2
import numpy as np

from irsim.backgrounds.base import Gaze
from irsim.backgrounds.chart import NODES, PLACES, Chart
from irsim.backgrounds.fields import STEPS
from irsim.backgrounds.texture import repeated_px
from irsim.types import Floats

NARROW = 0.02
"""A field whose corner lies at most this far out, as (tan of the angle to the axis)^2, turns like a flat
picture within 2 %: there a layer that changes anyway is moved as a whole. Wider ones are looked up pixel
by pixel, at ten times the cost."""

STRAIGHT = 0.02
"""Largest displacement of a corner by roll or zoom, px, that is not looked up."""

AROUND = 16
"""How much more than a frame sees is cut out of a texture, to each side, px: the next frames see much the same."""

Paint = Callable[[float], tuple[Floats, Floats]]
"""Time in periods -> a layer's transmittance and emission, square and periodic, float32."""


class Padded:
    """A square, periodic texture, repeated past its edges by `margin` px so that a frame needs no wrap.

    What was last seen of it is kept apart: a picture whose rows lie side by side is read in half the time.
    """

    def __init__(self, texture: Floats, margin: int) -> None:
        self.side = texture.shape[0]
        repeated = cv2.copyMakeBorder(texture, 0, margin, 0, margin, cv2.BORDER_WRAP)
        self.whole: Floats = np.asarray(repeated, np.float32)
        self._near, self._corner = self.whole[:0, :0], (0, 0)

    def window(self, column: int, row: int, width: int, height: int) -> Floats:
        """(height, width) of it from a column and a row on."""
        left, top = column - self._corner[0], row - self._corner[1]
        rows, columns = self._near.shape
        if not (0 <= left <= columns - width and 0 <= top <= rows - height):
            left, top = min(column, AROUND), min(row, AROUND)
            self._corner = column - left, row - top
            self._near = self.whole[row - top : row + height + AROUND, column - left : column + width + AROUND].copy()
        return self._near[top : top + height, left : left + width]


class Drifting:
    """What is seen of a layer that evolves with the period `period_s` and drifts by (right, down) px/s."""

    def __init__(self, name: str, range_m: float, paint: Paint, period_s: float, drift_px_s: tuple[float, float]):
        self.name = name
        self.range_m = range_m
        self._paint = paint
        self._period_s = period_s
        self._drift = drift_px_s
        self._states: dict[int, tuple[Padded, Padded]] = {}

    def light(self, gaze: Gaze) -> tuple[Floats, Floats]:
        """(transmittance, emission) of a frame, each (rows, cols) float32."""
        steps = gaze.time / self._period_s * STEPS
        first = int(np.floor(steps))
        share = steps - first
        self._states = {k: self._state(k, gaze.chart.geometry.size) for k in (first, first + 1)}
        look = _look(gaze.chart, self._drift[0] * gaze.time, self._drift[1] * gaze.time)
        early, late = self._states[first], self._states[first + 1]
        transmittance, emission = (look(before, after, share) for before, after in zip(early, late, strict=True))
        return transmittance, emission

    def _state(self, number: int, frame: tuple[int, int]) -> tuple[Padded, Padded]:
        if number in self._states:
            return self._states[number]
        transmittance, emission = self._paint(number / STEPS)
        margin = repeated_px(frame)
        return Padded(transmittance, margin), Padded(emission, margin)


Look = Callable[[Padded, Padded, float], Floats]


def _look(chart: Chart, right: float, down: float) -> Look:
    """How to see two padded periodic textures, mixed (share of the second), that have drifted by (right, down) px."""
    width, height = chart.geometry.size
    corner = np.hypot(width, height) / 2
    if (corner * chart.geometry.ifov_rad) ** 2 > NARROW:
        return _pixelwise(chart.spread(chart.u - right), chart.spread(chart.v - down))
    u, v, forward, side = _middle(chart)
    u, v = u - right, v - down
    if np.hypot(forward - 1, side) * corner > STRAIGHT:
        x, y = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
        return _pixelwise(u + forward * x - side * y, v + side * x + forward * y)

    def move(before: Padded, after: Padded, share: float) -> Floats:
        left, top = (u - (width - 1) / 2) % before.side, (v - (height - 1) / 2) % before.side
        column, row = int(left), int(top)
        early, late = (texture.window(column, row, width + 1, height + 1) for texture in (before, after))
        mixed = cv2.addWeighted(early, 1 - share, late, share, 0)
        middle = ((width - 1) / 2 + left - column, (height - 1) / 2 + top - row)
        return np.asarray(cv2.getRectSubPix(mixed, (width, height), middle))

    return move


def _pixelwise(columns: Floats, rows: Floats) -> Look:
    def look(before: Padded, after: Padded, share: float) -> Floats:
        period = before.side
        x, y = ((at - np.floor(at.min() / period) * period).astype(np.float32) for at in (columns, rows))
        mixed = cv2.addWeighted(before.whole, 1 - share, after.whole, share, 0)
        return np.asarray(cv2.remap(mixed, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP))

    return look


@lru_cache(maxsize=4)
def _middle(chart: Chart) -> tuple[float, float, float, float]:
    """(u, v) at the frame's middle, and how (du, dv) follow a step right there: (forward, side).

    A camera rolled clockwise by r with IFOVs s times the map's sees forward = s cos r and side = s sin r.
    """
    at, slope = _middle_weights()
    u, v = (float(at @ part @ at) for part in (chart.u, chart.v))
    width, height = chart.geometry.size
    # By elevation alone: azimuth has another scale away from the first elevation.
    side = float(at @ chart.v @ slope) / (width / 2 - 0.5)
    forward = float(slope @ chart.v @ at) / (height / 2 - 0.5)
    return u, v, forward, side


@lru_cache
def _middle_weights() -> tuple[Floats, Floats]:
    """Weights (NODES,) of the nodes' values that give a polynomial's value and slope at 0."""
    powers = np.vander(PLACES, NODES, increasing=True)
    inverse = np.linalg.inv(powers)
    return inverse[0], inverse[1]
