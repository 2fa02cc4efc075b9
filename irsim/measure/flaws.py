"""How many bad pixels there are, and what they do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.measure.defects import RESTLESS, Defects, around, stirred
from irsim.measure.interval import LEVEL, Measured
from irsim.measure.region import Values
from irsim.types import Bools, Floats

_MANY = 10
"""Blinking pixels from which the law of their jumps can be read."""
_FEW = 100
"""Pixels, less than which tell of no share."""
_UNEVEN = 1.5
"""By how much fewer clusters of uneven size tell than as many of one size: 1 + the square of their variation."""


@dataclass(frozen=True)
class Flaws:
    """Bad pixels of a recording. Heights are in its units, times in its frames; None where there is no such pixel.

    dead, hot, blinking     shares of the pixels; of blinking ones with those whose jump is too small to be told, and
                            among those where the scene does not change by more than noise
    cluster                 mean number of bad pixels that touch
    dead_level              at which dead pixels stand, in the median
    hot_height              of hot pixels above what is around them, in the mean
    jump                    of blinking pixels, in the mean, either way
    on_frames, off_frames   mean time away from their own level, and at it
    """

    dead: Measured
    hot: Measured
    blinking: Measured
    cluster: float
    dead_level: float | None
    hot_height: Measured | None
    jump: Measured | None
    on_frames: Measured | None
    off_frames: Measured | None


def flaws(frames: Values, taken_at: Floats, bad: Defects, noise: float) -> Flaws:
    """Of frames (T, rows, columns), taken at (T,) frame periods of the recording, with those bad pixels and a temporal
    noise of sigma `noise`."""
    level = frames.mean(axis=0, dtype=np.float64)
    heights = (level - around(level))[bad.hot]
    hidden = stirred(frames, noise)
    told = bad.blinking & ~hidden
    jump, on, off, seen = _blinks(frames[:, told], np.diff(taken_at), noise)
    blinking = _share(told, bad.judged * float(1 - hidden.mean()))
    return Flaws(
        dead=_share(bad.dead, bad.judged),
        hot=_share(bad.hot, bad.judged),
        blinking=blinking.map(lambda share: share / seen),
        cluster=_cluster(bad.all),
        dead_level=float(np.median(level[bad.dead])) if bad.dead.any() else None,
        hot_height=_mean(heights) if heights.size else None,
        jump=jump,
        on_frames=on,
        off_frames=off,
    )


def _blinks(
    series: Values, passed: Floats, noise: float
) -> tuple[Measured | None, Measured | None, Measured | None, float]:
    """(jump, frames on, frames off, share of the blinking pixels that is seen) of series (T, pixels) and the frames
    (T - 1,) that `passed` from each to the next.

    Each is cut half-way between its ends, and is on where it is seldom. Exponential jumps are seen from
    some height on, so that their mean is what the seen ones exceed it by, and the share of the others
    follows; of a few pixels nobody can say so, and they are taken as they are.
    """
    if series.shape[1] == 0:
        return None, None, None, 1.0
    values = series.astype(np.float64)
    high = values > (values.max(axis=0) + values.min(axis=0)) / 2
    on = np.where(high.mean(axis=0) > 0.5, ~high, high)
    means = [np.where(state, values, 0).sum(axis=0) / state.sum(axis=0).clip(1) for state in (on, ~on)]
    jumps = np.abs(means[0] - means[1])
    share = float(on.mean())
    least = min(RESTLESS * noise / np.sqrt(share * (1 - share)), float(jumps.min())) if jumps.size >= _MANY else 0.0
    beyond = _mean(jumps - least)
    ends = [int((state[:-1] & ~state[1:]).sum()) for state in (on, ~on)]
    away, home = (
        _rate(float(passed @ state[:-1].sum(axis=1)), count) for state, count in zip((on, ~on), ends, strict=True)
    )
    return beyond, away, home, float(np.exp(-least / max(beyond.value, 1e-9)))


def _rate(total: float, events: int) -> Measured | None:
    """Mean time between events, from how many there were in a total of time; None where there was none."""
    if not events:
        return None
    low, high = _poisson(events)
    return Measured(total / events, total / high, total / max(low, 1e-3))


def _share(mask: Bools, judged: float) -> Measured:
    """Of so many pixels that were judged, those in a mask; clusters of them count once for the interval."""
    from scipy.ndimage import label

    if judged < _FEW:
        return Measured(0.0, 0.0, 1.0, bound=True)
    share = float(mask.sum()) / judged
    clusters = int(label(mask)[1])
    if not clusters:
        return Measured(0.0, 0.0, _poisson(0)[1] / judged)
    low, high = _poisson(clusters / _UNEVEN)
    return Measured(share, share * low * _UNEVEN / clusters, share * high * _UNEVEN / clusters)


def _cluster(mask: Bools) -> float:
    from scipy.ndimage import label

    return float(mask.sum() / max(int(label(mask)[1]), 1)) if mask.any() else 1.0


def _poisson(count: float) -> tuple[float, float]:
    """Interval of the mean of a Poisson number (F. Garwood, Biometrika 28, 1936)."""
    from scipy.stats import chi2

    low = float(chi2.ppf((1 - LEVEL) / 2, 2 * count)) / 2 if count else 0.0
    return low, float(chi2.ppf((1 + LEVEL) / 2, 2 * count + 2)) / 2


def _mean(values: Floats) -> Measured:
    """Mean of numbers above 0 that scatter as an exponential does, at least."""
    low, high = _poisson(len(values))
    mean = float(values.mean())
    return Measured(mean, mean * low / len(values), mean * high / len(values))
