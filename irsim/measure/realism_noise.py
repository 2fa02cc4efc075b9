"""Whether a recording's noise is like that of a real infrared camera."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping

from irsim.errors import InputError
from irsim.measure.figures import Figures
from irsim.measure.interval import Measured
from irsim.measure.realism import Bounds, Judged, Verdict

_FACTOR = 2.0
"""By which sensors of one sort differ: the pixel pattern of one uncooled camera is 2.5 to 6.4 over eight clips."""
_WHITE = 0.05
"""Lag-1 correlation, either way, up to which noise is white: cooled cameras show 0.01."""
_MEMORY = 0.15
"""By how much the lag-1 correlation of uncooled cameras differs with their rate: 0.74 to 0.90 at 9 Hz."""


BEYOND = "95 % interval (all but correlation: in units of a pixel's noise)"
"""What stands behind the values, as the head of its column."""


def _wide(low: float, high: float) -> Bounds:
    return low / _FACTOR, high * _FACTOR


CAMERAS: dict[str, dict[str, Bounds]] = {
    "cooled": {
        "correlation": (-_WHITE, _WHITE),
        "pixel": _wide(0.37, 0.40),
        "column": _wide(0.04, 0.085),
        "row": _wide(0.10, 0.12),
        "level": _wide(0.19, 0.21),
    },
    "uncorrected": {
        "correlation": (-_WHITE, _WHITE),
        "pixel": _wide(4.7, 4.8),
        "column": _wide(0.78, 0.91),
        "row": _wide(8.8, 15.8),
    },
    "uncooled": {
        "correlation": (0.74 - _MEMORY, min(0.90 + _MEMORY, 1.0)),
        "pixel": _wide(0.7, 4.6),
        "column": _wide(0.17, 1.0),
        "row": _wide(0.11, 0.93),
    },
}
"""Lag-1 correlation of a pixel's noise, and fixed patterns and the frame's level in units of the pixel's noise.

From raw counts of a cooled LWIR camera after correction and a cooled MWIR one without (samples of pyradi), and
of a Lepton 3, uncooled, over eight clips (python-cptv): measured by the project, here and by 3-D noise terms.
"""


def noise_figures(found: Figures) -> dict[str, Measured]:
    """The figures of `CAMERAS` of a recording. InputError where they cannot be told."""
    if found.pixel is None or found.row is None or found.column is None or found.level is None:
        raise InputError("its noise cannot be judged, for the scene moves; allowed: a still camera")
    unit = found.noise.value
    if not unit:
        raise InputError("its noise cannot be judged, for there is none above the rounding to whole counts")
    return {
        "correlation": _correlation(found.white, found.memory, found.memory_frames),
        "pixel": found.pixel.map(lambda sigma: sigma / unit),
        "column": found.column.map(lambda sigma: sigma / unit),
        "row": _with_turns(found.row, found.even_rows).map(lambda sigma: sigma / unit),
        "level": found.level.map(lambda sigma: sigma / unit),
    }


def _correlation(white: Measured, memory: Measured | None, frames: Measured | None) -> Measured:
    """Lag-1 correlation of noise with a part that forgets in so many `frames`: what share that is, and what is left of
    it. The ends are those of all three at once."""
    if memory is None or frames is None:
        return Measured(0.0, 0.0, 0.0)

    def left(remembered: float, forgot: float, lasts: float) -> float:
        return remembered**2 / (remembered**2 + forgot**2) * math.exp(-1 / lasts) if remembered else 0.0

    return Measured(
        left(memory.value, white.value, frames.value),
        left(memory.low, white.high, frames.low),
        left(memory.high, white.low, frames.high),
    )


def _with_turns(row: Measured, even: Measured | None) -> Measured:
    """Sigma of rows with what even ones lie above odd ones, halved, which may be below 0."""
    if even is None:
        return row
    near, far = sorted((abs(even.low), abs(even.high)))
    least = 0.0 if even.low < 0 < even.high else near
    return Measured(math.hypot(row.value, even.value), math.hypot(row.low, least), math.hypot(row.high, far))


def check_sort(camera: object) -> None:
    """InputError where there is no such sort of camera."""
    if not (isinstance(camera, str) and camera in CAMERAS):
        raise InputError(f"camera {reprlib.repr(camera)}: no such sort of camera; allowed: {', '.join(CAMERAS)}")


def judge_sorts(found: Figures, camera: str | None = None) -> Judged:
    """Noise beside all sorts of camera. InputError where there is no sort `camera`, or noise cannot be told."""
    if camera is not None:
        check_sort(camera)
    values = noise_figures(found)
    figures = {name: f"{each.value:8.2f}  {_interval(each)}" for name, each in values.items()}
    return Judged(figures, {sort: _beside(values, sort) for sort in CAMERAS}, camera, BEYOND)


def _beside(values: Mapping[str, Measured], sort: str) -> tuple[Verdict, ...]:
    return tuple(
        Verdict(name, values[name].value, low, high, (values[name].low, values[name].high))
        for name, (low, high) in CAMERAS[sort].items()
    )


def _interval(value: Measured) -> str:
    """From where to where, or what it means that it has no width."""
    if value.low == value.high:
        return "none: taken for this, for nothing else was found"
    low, high = f"{value.low:.2f}", f"{value.high:.2f}"
    return f"{low} to {high}" if low != high else "known to better than 0.01"
