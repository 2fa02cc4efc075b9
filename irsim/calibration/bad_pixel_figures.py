"""Figures of bad pixels: fractions, heights and dwell times of dead, hot and blinking pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.calibration.bad_pixels import LEAST_JUDGED, BadPixels, around
from irsim.calibration.statistics import Estimate, Values, exponential_mean, poisson
from irsim.types import Bools, Floats

_CLUSTERED = 2.0
"""Number of clustered bad pixels that count as one independent event in the interval of a fraction."""


@dataclass(frozen=True)
class BadPixelFigures:
    """Fractions of bad pixels among the judged ones, heights in counts, and times in frame periods of the recording.

    cluster                 mean number of bad pixels that touch each other
    dead_level              median count of dead pixels
    hot_height              mean height of hot pixels above their neighbours
    jump                    mean step of blinking pixels between their two levels
    on_frames, off_frames   mean dwell times of blinking pixels away from their normal level, and at it
    """

    dead: Estimate
    hot: Estimate
    blinking: Estimate
    cluster: float
    dead_level: float | None
    hot_height: Estimate | None
    jump: Estimate | None
    on_frames: Estimate | None
    off_frames: Estimate | None

    @property
    def shares(self) -> dict[str, Estimate]:
        return {"dead": self.dead, "hot": self.hot, "blinking": self.blinking}

    @property
    def any(self) -> bool:
        return any(share.value for share in self.shares.values())


def bad_pixel_figures(frames: Values, periods: Floats, bad: BadPixels) -> BadPixelFigures:
    """Return the figures of bad pixels in frames (T, rows, columns).

    periods (T - 1,) time from each frame to the next, in frame periods of the recording
    """
    from scipy.ndimage import label

    level = frames.mean(axis=0, dtype=np.float64)
    heights = (level - around(level))[bad.hot]
    judged = int(bad.judged.sum())
    jump = on = off = None
    if bad.blinking.any():
        series = frames[:, bad.blinking].astype(np.float64)
        jump, on, off = _dwell_times(series, around(level)[bad.blinking], periods)
    return BadPixelFigures(
        dead=_share(bad.dead, judged),
        hot=_share(bad.hot, judged),
        blinking=_share(bad.blinking, judged),
        cluster=float(bad.all.sum() / int(label(bad.all)[1])) if bad.all.any() else 1.0,
        dead_level=float(np.median(level[bad.dead])) if bad.dead.any() else None,
        hot_height=exponential_mean(float(heights.sum()), len(heights)) if len(heights) else None,
        jump=jump,
        on_frames=on,
        off_frames=off,
    )


def _dwell_times(series: Floats, normal: Floats, periods: Floats) -> tuple[Estimate, Estimate | None, Estimate | None]:
    """Return the mean step of two-level series (T, pixels), and the mean times off the level near `normal` and on it.

    The estimated mean of an exponential dwell time is the time spent over the number of exits (D. R. Cox, D. Oakes,
    "Analysis of Survival Data", 1984, section 3.2). Changes faster than the frames are missed.
    """
    high = series > (series.max(axis=0) + series.min(axis=0)) / 2
    upper, lower = (np.where(part, series, 0).sum(axis=0) / part.sum(axis=0).clip(1) for part in (high, ~high))
    away = np.where(np.abs(upper - normal) > np.abs(lower - normal), high, ~high)
    times: list[Estimate | None] = []
    for state in (away, ~away):
        exits = int((state[:-1] & ~state[1:]).sum())
        spent = float((state[:-1] * periods[:, None]).sum())
        times.append(exponential_mean(spent, exits) if exits else None)
    return exponential_mean(float((upper - lower).sum()), series.shape[1]), times[0], times[1]


def _share(mask: Bools, judged: int) -> Estimate:
    from scipy.ndimage import label

    if judged < LEAST_JUDGED:
        return Estimate(0.0, 0.0, 1.0, bound=True)
    share, clusters = float(mask.sum()) / judged, int(label(mask)[1])
    if not clusters:
        return Estimate(0.0, 0.0, poisson(0)[1] / judged)
    low, high = (end * _CLUSTERED / clusters for end in poisson(clusters / _CLUSTERED))
    return Estimate(share, share * low, share * high)
