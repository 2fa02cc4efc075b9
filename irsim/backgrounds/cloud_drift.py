"""Layer of an evolving cloud: states at discrete times, mixed for the times in between and shifted with the wind."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.backgrounds.base import AirBefore, ViewDirection, apply_air, blend_over
from irsim.backgrounds.chart import PLACES, Chart, centre_weights
from irsim.backgrounds.cloud_evolution import STEPS, CloudState, Words, units_of
from irsim.backgrounds.panorama import Sphere, from_origin, is_outside, transparent
from irsim.backgrounds.texture import repeated_px
from irsim.types import Floats, Slices

NARROW = 0.02
"""Greatest squared tangent of the angle from the optical axis to a corner at which a rotation of the camera shifts the
whole image equally, within 2 %. In such narrow fields of view, evolving layers are shifted as a whole; in wider ones
they are sampled pixel by pixel, at ten times the cost."""

STRAIGHT = 0.02
"""Largest displacement of a corner by roll or zoom, px, that is neglected."""

WHOLE = 32768
"""Sum of the integer weights with which words of `CloudState` are mixed; integer arithmetic is exact and fast."""

Shift = float | Floats
"""Displacement along an axis, px: uniform, or (NODES, NODES) at the nodes of a chart."""

Weights = tuple[int, int, int, int]

StateAt = Callable[[float], CloudState]
"""Function from a time, in periods, to a layer's state at this time."""

StateMixer = Callable[[CloudState, CloudState, float], tuple[Floats, Floats]]
"""Function from two states and the share, 0..1, of the second to the transmittance and emission of their mixture."""


class EvolvingCloud:
    """Cloud layer that evolves with the period `period_s` and drifts by (right, down) px/s."""

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
        self.state_at = state_at
        self._surface = Sphere(range_m)
        self._period_s = period_s
        self._drift = drift_px_s
        self._states: dict[int, CloudState] = {}

    def light(self, view_direction: ViewDirection) -> tuple[Floats, Floats]:
        """Return (transmittance, emission) of a frame, each (rows, cols) float32."""
        if is_outside(view_direction, self._surface):
            return transparent(view_direction)
        return _mixer(view_direction.chart, *self._shift(view_direction))(*self._around(view_direction.time))

    def blend(
        self,
        under: Floats,
        light: Floats,
        view_direction: ViewDirection,
        behind: Sequence[Slices],
        air: AirBefore | None = None,
    ) -> list[Floats]:
        """Blend as in `SemiTransparentLayer.blend`. air: the air before the cloud, as in `apply_air`."""
        outside = is_outside(view_direction, self._surface)
        first = _first_pixel(view_direction.chart, *self._shift(view_direction)) if COMPILED and not outside else None
        if first is None or light.dtype != np.float32:
            through, emission = self.light(view_direction)
            arriving = emission if air is None else apply_air(through, emission, air)
            return blend_over(under, light, through, arriving, behind)
        early, late, share = self._around(view_direction.time)
        shares, down, passed, emitted = _windows(early, late, share, first, view_direction.chart.geometry.size)
        kernels.veil(under, *shares, down, *early.units, light, *passed, *emitted, *(air or ()))
        patches = []
        for down_to, across_to in behind:
            patch = np.empty((down_to.stop - down_to.start, across_to.stop - across_to.start), np.float32)
            here = slice(down_to.start, down_to.stop + 1), slice(across_to.start, across_to.stop + 1)
            kernels.moved(*shares, down, early.units[0], patch, *(state[here] for state in passed))
            patches.append(patch)
        return patches

    def _shift(self, view_direction: ViewDirection) -> tuple[Shift, Shift]:
        """Return the displacement to the right and down, px, by the wind and by the camera's motion."""
        right, down = self._drift[0] * view_direction.time, self._drift[1] * view_direction.time
        if not any(view_direction.place):
            return right, down
        across, along = view_direction.chart.uv - from_origin(view_direction, self._surface).chart.uv
        if max(np.ptp(across), np.ptp(along)) <= STRAIGHT:
            return right + float(across.mean()), down + float(along.mean())
        return right + across, down + along

    def _around(self, time: float) -> tuple[CloudState, CloudState, float]:
        """Return the states before and after a time, and the share, 0..1, of the later one in their mixture."""
        steps = time / self._period_s * STEPS
        first = math.floor(steps)
        known = self._states  # read once: another thread may replace it
        if first in known and first + 1 in known:
            return known[first], known[first + 1], steps - first
        states = self._states = {k: known.get(k) or self.state_at(k / STEPS) for k in (first, first + 1)}
        return states[first], states[first + 1], steps - first


def _is_narrow(chart: Chart) -> bool:
    return (math.hypot(*chart.geometry.size) / 2 * chart.geometry.ifov_rad) ** 2 <= NARROW


def _first_pixel(chart: Chart, right: Shift, down: Shift) -> tuple[float, float] | None:
    """Return the position (u, v) of the frame's first pixel in a layer displaced by (right, down) px; None if the layer
    cannot be shifted as a whole."""
    if isinstance(right, np.ndarray) or isinstance(down, np.ndarray) or not _is_narrow(chart):
        return None
    width, height = chart.geometry.size
    u, v, forward, side = _centre(chart)
    if math.hypot(forward - 1, side) * math.hypot(width, height) / 2 > STRAIGHT:
        return None
    return u - right - (width - 1) / 2, v - down - (height - 1) / 2


def integer_weights(late: float, right: float) -> Weights:
    """Return the weights, of sum WHOLE, of a word and its right neighbour in the early state, then in the late state.

    late, right: shares 0..1 of the late state and of the right neighbour.
    """
    of_late = round(late * WHOLE)
    right_of_early, right_of_late = round((WHOLE - of_late) * right), round(of_late * right)
    return WHOLE - of_late - right_of_early, right_of_early, of_late - right_of_late, right_of_late


def _mixer(chart: Chart, right: Shift, down: Shift) -> StateMixer:
    """Return the function that samples and mixes two states displaced by (right, down) px."""
    width, height = chart.geometry.size
    first = _first_pixel(chart, right, down)
    if first is None and not _is_narrow(chart):
        return _pixelwise(chart.at_pixels(chart.u - right), chart.at_pixels(chart.v - down), chart)
    if first is None:
        u, v, forward, side = _centre(chart)
        at_nodes = isinstance(right, np.ndarray)
        ends = [(length - 1) / 2 for length in (width, height)]
        x, y = np.meshgrid(*(PLACES * end if at_nodes else np.arange(2 * end + 1) - end for end in ends))
        places: list[Floats] = [u - right + forward * x - side * y, v - down + side * x + forward * y]
        columns, rows = map(chart.at_pixels, places) if at_nodes else places
        return _pixelwise(columns, rows, chart)

    def mix(before: CloudState, after: CloudState, share: float) -> tuple[Floats, Floats]:
        shares, beyond, *fields = _windows(before, after, share, first, (width, height))
        passed, emitted = (
            _weighted(early, shares[:2], beyond, unit) + _weighted(late, shares[2:], beyond, unit)
            for (early, late), unit in zip(fields, before.units, strict=True)
        )
        return passed, emitted

    return mix


def _windows(
    early: CloudState, late: CloudState, share: float, first: tuple[float, float], size: tuple[int, int]
) -> tuple[Weights, float, tuple[Words, Words], tuple[Words, Words]]:
    """Return the weights of words, the shift down in fractions of a row, and windows of both states.

    The windows, of transmittance and of emission, begin at the position `first` and are a row and a column larger than
    the frame, whose `size` is (columns, rows).
    """
    u, v = (place % early.side for place in first)
    window = int(u), int(v), size[0] + 1, size[1] + 1
    passed, emitted = zip(early.window(*window), late.window(*window), strict=True)
    return integer_weights(share, u - int(u)), v - int(v), passed, emitted


def _weighted(state: Words, shares: tuple[int, int], down: float, unit: float) -> Floats:
    """Return a state's share of the mixture, interpolated bilinearly `down` px below the first row of its window."""
    kernel = np.outer((1 - down, down), shares) * (unit / WHOLE)
    return np.asarray(cv2.filter2D(units_of(state), cv2.CV_32F, kernel, anchor=(0, 0)), np.float32)[:-1, :-1]


def _pixelwise(columns: Floats, rows: Floats, chart: Chart) -> StateMixer:
    (left, right), (top, bottom) = ((int(np.floor(at.min())), int(np.floor(at.max()))) for at in (columns, rows))
    x, y = (columns - left).astype(np.float32), (rows - top).astype(np.float32)
    most = repeated_px(chart.geometry.size)

    def mix(before: CloudState, after: CloudState, share: float) -> tuple[Floats, Floats]:
        width, height = (min(length + 2, before.side + most) for length in (right - left, bottom - top))
        windows = (state.window(left, top, width, height) for state in (before, after))
        mixed = (
            cv2.addWeighted(units_of(early), (1 - share) * unit, units_of(late), share * unit, 0, dtype=cv2.CV_32F)
            for early, late, unit in zip(*windows, before.units, strict=True)
        )
        passed, emitted = (cv2.remap(field, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP) for field in mixed)
        return np.asarray(passed, np.float32), np.asarray(emitted, np.float32)

    return mix


@lru_cache(maxsize=4)
def _centre(chart: Chart) -> tuple[float, float, float, float]:
    """Return (u, v) at the frame's centre, and their changes (forward, side) there for one pixel to the right.

    A camera rolled clockwise by r, with IFOVs s times the map's, has forward = s cos r and side = s sin r.
    """
    at, slope = centre_weights()
    u, v = (float(at @ part @ at) for part in (chart.u, chart.v))
    width, height = chart.geometry.size
    # From elevations only, as the scale of azimuth differs away from the first elevation.
    side = float(at @ chart.v @ slope) / (width / 2 - 0.5)
    forward = float(slope @ chart.v @ at) / (height / 2 - 0.5)
    return u, v, forward, side
