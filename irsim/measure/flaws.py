"""How many bad pixels there are, and what they do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irsim.measure.around import around
from irsim.measure.defects import RESTLESS, Defects, stirred
from irsim.measure.interval import LEVEL, Measured
from irsim.measure.region import Values
from irsim.measure.telegraph import Telegraph, telegraph
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
    on_frames, off_frames   mean time on one level, where they are seldom, and on the other
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


def flaws(frames: Values, passed: Floats, bad: Defects, noise: float) -> Flaws:
    """Of frames (T, rows, columns), with those bad pixels and a temporal noise of sigma `noise`; so many frame periods
    of the recording `passed` from each to the next (T - 1,)."""
    level = frames.mean(axis=0, dtype=np.float64)
    heights = (level - around(level))[bad.hot]
    hidden = stirred(frames, noise)
    told = bad.blinking & ~hidden
    series = frames[:, told].astype(np.float64)
    high = series > (series.max(axis=0) + series.min(axis=0)) / 2
    jump, seen = _jumps(high, series, noise) if told.any() else (None, 1.0)
    times = telegraph(high, passed)
    blinking = _share(told, bad.judged * float(1 - hidden.mean()))
    return Flaws(
        dead=_share(bad.dead, bad.judged),
        hot=_share(bad.hot, bad.judged),
        blinking=_all_of(blinking.map(lambda share: share / seen), times),
        cluster=_cluster(bad.all),
        dead_level=float(np.median(level[bad.dead])) if bad.dead.any() else None,
        hot_height=_mean(heights) if heights.size else None,
        jump=jump,
        on_frames=times.on if times else None,
        off_frames=times.off if times else None,
    )


def _all_of(share: Measured, times: Telegraph | None) -> Measured:
    """The share of pixels that blink, from that of those that did while they were seen."""
    if times is None:
        return share
    seen = times.seen
    return replace(share, value=share.value / seen.value, low=share.low / seen.high, high=share.high / seen.low)


def _jumps(high: Bools, series: Values, noise: float) -> tuple[Measured, float]:
    """(mean jump, share of the blinking pixels that is seen) of series (T, pixels), which are high or not.

    Exponential jumps are seen from some height on, so that their mean is what the seen ones exceed it by, and the
    share of the others follows; of a few pixels nobody can say so, and they are taken as they are.
    """
    means = [np.where(state, series, 0).sum(axis=0) / state.sum(axis=0).clip(1) for state in (high, ~high)]
    jumps = np.abs(means[0] - means[1])
    often = high.mean(axis=0)
    share = float(np.minimum(often, 1 - often).mean())
    least = min(RESTLESS * noise / np.sqrt(share * (1 - share)), float(jumps.min())) if jumps.size >= _MANY else 0.0
    beyond = _mean(jumps - least)
    return beyond, float(np.exp(-least / max(beyond.value, 1e-9)))


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
