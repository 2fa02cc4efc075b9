"""A cloud layer that changes: painted now and then, mixed and moved in between."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.backgrounds.base import AirBefore, ViewDirection, in_air, veiled
from irsim.backgrounds.chart import PLACES, Chart, at_middle
from irsim.backgrounds.evolving import STEPS
from irsim.backgrounds.parallax import Sphere, is_left_behind, seen_from, unhidden
from irsim.backgrounds.texture import repeated_px
from irsim.backgrounds.tiles import Tiled, Words, counted
from irsim.types import Floats, Slices

NARROW = 0.02
"""A field whose corner lies at most this far out, as (tan of the angle to the axis)^2, turns like a flat
picture within 2 %: there a layer that changes anyway is moved as a whole. Wider ones are looked up pixel
by pixel, at ten times the cost."""

STRAIGHT = 0.02
"""Largest displacement of a corner by roll or zoom, px, that is not looked up."""

Shift = float | Floats
"""How far something has gone along an axis, px: all of it alike, or (NODES, NODES) at the nodes of a chart."""

StateAt = Callable[[float], Tiled]
"""Time in periods -> a layer's state at that time."""


class Drifting:
    """What is seen of a layer that evolves with the period `period_s` and drifts by (right, down) px/s."""

    def __init__(
        self,
        name: str,
        range_m: float,
        state_at: StateAt,
        period_s: float,
        drift_px_s: tuple[float, float],
    ) -> None:
        self.name = name
        self.range_m = range_m
        self._shell = Sphere(range_m)
        self._state_at = state_at
        self._period_s = period_s
        self._drift = drift_px_s
        self._states: dict[int, Tiled] = {}

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        """(transmittance, emission) of a frame, each (rows, cols) float32."""
        if is_left_behind(view_direction, self._shell):
            return unhidden(view_direction)
        return _look(view_direction.chart, *self._gone(view_direction))(*self._around(view_direction.time))

    def veil(
        self,
        under: Floats,
        light: Floats,
        view_direction: ViewDirection,
        behind: Sequence[Slices],
        air: AirBefore | None = None,
    ) -> list[Floats]:
        """See `SemiTransparentLayer`. air: what is before it, by which its emission becomes that of `in_air`."""
        lost = is_left_behind(view_direction, self._shell)
        first = _first(view_direction.chart, *self._gone(view_direction)) if COMPILED and not lost else None
        if first is None or light.dtype != np.float32:
            through, emission = self.light(view_direction)
            return veiled(under, light, through, emission if air is None else in_air(through, emission, air), behind)
        early, late, share = self._around(view_direction.time)
        shares, down, passed, emitted = _seen(early, late, share, first, view_direction.chart.geometry.size)
        kernels.veil(under, *shares, down, *early.units, light, *passed, *emitted, *(air or ()))
        patches = []
        for down_to, across_to in behind:
            patch = np.empty((down_to.stop - down_to.start, across_to.stop - across_to.start), np.float32)
            here = slice(down_to.start, down_to.stop + 1), slice(across_to.start, across_to.stop + 1)
            kernels.moved(*shares, down, early.units[0], patch, *(state[here] for state in passed))
            patches.append(patch)
        return patches

    def _gone(self, view_direction: ViewDirection) -> tuple[Shift, Shift]:
        """How far it has gone to the right and down, px: with the wind, and as the camera is carried past it."""
        right, down = self._drift[0] * view_direction.time, self._drift[1] * view_direction.time
        if not any(view_direction.place):
            return right, down
        across, along = view_direction.chart.uv - seen_from(view_direction, self._shell).chart.uv
        if max(np.ptp(across), np.ptp(along)) <= STRAIGHT:
            return right + float(across.mean()), down + float(along.mean())
        return right + across, down + along

    def _around(self, time: float) -> tuple[Tiled, Tiled, float]:
        """The states before and after a time, and the share of the one after."""
        steps = time / self._period_s * STEPS
        first = math.floor(steps)
        known = self._states  # once: another thread may put its own there
        if first in known and first + 1 in known:
            return known[first], known[first + 1], steps - first
        states = self._states = {k: known.get(k) or self._state_at(k / STEPS) for k in (first, first + 1)}
        return states[first], states[first + 1], steps - first


def _is_narrow(chart: Chart) -> bool:
    return (math.hypot(*chart.geometry.size) / 2 * chart.geometry.ifov_rad) ** 2 <= NARROW


def _first(chart: Chart, right: Shift, down: Shift) -> tuple[float, float] | None:
    """The place (u, v) of the frame's first pixel in a layer that has gone (right, down) px; None where it is not moved
    as a whole."""
    if isinstance(right, np.ndarray) or isinstance(down, np.ndarray) or not _is_narrow(chart):
        return None
    width, height = chart.geometry.size
    u, v, forward, side = _middle(chart)
    if math.hypot(forward - 1, side) * math.hypot(width, height) / 2 > STRAIGHT:
        return None
    return u - right - (width - 1) / 2, v - down - (height - 1) / 2


def _within(place: float) -> tuple[int, float]:
    """The whole px of a place, and how far it lies beyond."""
    whole = int(place)
    return whole, place - whole


WHOLE = 32768
"""What the shares of words sum to: sums of words times whole numbers are exact, and quick."""


Shares = tuple[int, int, int, int]


def _shares(late: float, right: float) -> Shares:
    """What counts of a word and of the one right of it in the early state, then in the late one, of WHOLE: `late` and
    `right`, 0 to 1, are the late state's share and that of what lies on the right."""
    of_late = round(late * WHOLE)
    right_of_early, right_of_late = round((WHOLE - of_late) * right), round(of_late * right)
    return WHOLE - of_late - right_of_early, right_of_early, of_late - right_of_late, right_of_late


Seeing = Callable[[Tiled, Tiled, float], tuple[Floats, Floats]]


def _look(chart: Chart, right: Shift, down: Shift) -> Seeing:
    """How to see two states, mixed (share of the second), that have gone (right, down) px."""
    width, height = chart.geometry.size
    first = _first(chart, right, down)
    if first is None and not _is_narrow(chart):
        return _pixelwise(chart.spread(chart.u - right), chart.spread(chart.v - down), chart)
    if first is None:
        u, v, forward, side = _middle(chart)
        at_nodes = isinstance(right, np.ndarray)
        ends = [(length - 1) / 2 for length in (width, height)]
        x, y = np.meshgrid(*(PLACES * end if at_nodes else np.arange(2 * end + 1) - end for end in ends))
        places: list[Floats] = [u - right + forward * x - side * y, v - down + side * x + forward * y]
        columns, rows = map(chart.spread, places) if at_nodes else places
        return _pixelwise(columns, rows, chart)

    def move(before: Tiled, after: Tiled, share: float) -> tuple[Floats, Floats]:
        shares, beyond, *fields = _seen(before, after, share, first, (width, height))
        passed, emitted = (
            _beside(early, shares[:2], beyond, unit) + _beside(late, shares[2:], beyond, unit)
            for (early, late), unit in zip(fields, before.units, strict=True)
        )
        return passed, emitted

    return move


def _seen(
    early: Tiled, late: Tiled, share: float, first: tuple[float, float], size: tuple[int, int]
) -> tuple[Shares, float, tuple[Words, Words], tuple[Words, Words]]:
    """What a frame of a size (columns, rows) sees of two states from a place (u, v) on: what counts of their words, how
    far its pixels lie below a row, px, and windows of both, a row and a column larger: of what passes and is emitted.
    """
    (column, right), (row, down) = (_within(place % early.side) for place in first)
    window = column, row, size[0] + 1, size[1] + 1
    passed, emitted = zip(early.window(*window), late.window(*window), strict=True)
    return _shares(share, right), down, passed, emitted


def _beside(state: Words, shares: tuple[int, int], down: float, unit: float) -> Floats:
    """What a state, a row and a column larger than what is seen, has to do with it: `down` px from its first row on."""
    kernel = np.outer((1 - down, down), shares) * (unit / WHOLE)
    return np.asarray(cv2.filter2D(counted(state), cv2.CV_32F, kernel, anchor=(0, 0)), np.float32)[:-1, :-1]


def _pixelwise(columns: Floats, rows: Floats, chart: Chart) -> Seeing:
    (left, width), (top, height) = (_stretch(at) for at in (columns, rows))
    x, y = (columns - left).astype(np.float32), (rows - top).astype(np.float32)
    most = repeated_px(chart.geometry.size)

    def look(before: Tiled, after: Tiled, share: float) -> tuple[Floats, Floats]:
        within = (min(length, before.side + most) for length in (width, height))
        passed, emitted = (
            cv2.remap(field, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
            for field in _mixed(before, after, share, left, top, *within)
        )
        return np.asarray(passed), np.asarray(emitted)

    return look


def _stretch(places: Floats) -> tuple[int, int]:
    """The first of the pixels that places lie between, and how many there are to the last."""
    first = int(np.floor(places.min()))
    return first, int(np.floor(places.max())) + 2 - first


def _mixed(
    before: Tiled, after: Tiled, share: float, column: int, row: int, width: int, height: int
) -> Iterator[Floats]:
    """Windows of the transmittance and the emission, float32."""
    fields = (state.window(column, row, width, height) for state in (before, after))
    for early, late, unit in zip(*fields, before.units, strict=True):
        of_early, of_late = (1 - share) * unit, share * unit
        yield np.asarray(cv2.addWeighted(counted(early), of_early, counted(late), of_late, 0, dtype=cv2.CV_32F))


@lru_cache(maxsize=4)
def _middle(chart: Chart) -> tuple[float, float, float, float]:
    """(u, v) at the frame's middle, and how (du, dv) follow a step right there: (forward, side).

    A camera rolled clockwise by r with IFOVs s times the map's sees forward = s cos r and side = s sin r.
    """
    at, slope = at_middle()
    u, v = (float(at @ part @ at) for part in (chart.u, chart.v))
    width, height = chart.geometry.size
    # By elevation alone: azimuth has another scale away from the first elevation.
    side = float(at @ chart.v @ slope) / (width / 2 - 0.5)
    forward = float(slope @ chart.v @ at) / (height / 2 - 0.5)
    return u, v, forward, side
