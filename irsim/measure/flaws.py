"""How many bad pixels there are, and what they do."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from irsim.measure.around import around
from irsim.measure.defects import RESTLESS, Defects, stirred
from irsim.measure.given import Values
from irsim.measure.interval import LEVEL, Measured
from irsim.measure.own_level import high_is_away
from irsim.measure.telegraph import telegraph
from irsim.measure.two_levels import TwoLevels, two_levels
from irsim.types import Bools, Floats

_MANY = 10
"""Blinking pixels from which the law of their jumps can be read."""
_LEAST_SEEN = 0.25
"""Share of the blinking pixels that must be seen for the law to say how many more there are: jumps that end just above
the least that is seen speak of no law, and would make any number."""
_ALIKE = 2.0
"""Standard errors by which the relative scatter of jumps beyond the least may fall short of 1, an exponential law's:
about 1/sqrt(n) for n of them."""
_FEW = 100
"""Pixels, less than which tell of no share."""
_UNEVEN = 1.5
"""By how much fewer clusters of uneven size tell than as many of one size: 1 + the square of their variation."""


@dataclass(frozen=True)
class Flaws:
    """Bad pixels of a recording. Heights are in its units, times in its frames; None where there is no such pixel.

    dead, hot, blinking     shares of the pixels of which it can be told; of blinking ones among those where the scene
                            does not change by more than noise, and with those whose jump is too small to be told or
                            that stayed still: up to 1 where nobody knows how many these are
    cluster                 mean number of bad pixels that touch
    dead_level              at which dead pixels stand, in the median
    hot_height              of hot pixels above what is around them, in the mean
    jump                    of blinking pixels, in the mean, either way: of all, by an exponential law, which is how
                            `irsim.camera.detectors` draws them, or of those that are seen, where they are few or do
                            not follow that law
    on_frames, off_frames   mean time away from their own level, and on it. Where nobody can tell which is their own, it
                            is taken to be that on which they are longer, and the interval of either holds both
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

    @property
    def shares(self) -> dict[str, Measured]:
        """By what the pixels do."""
        return {"dead": self.dead, "hot": self.hot, "blinking": self.blinking}


def flaws(frames: Values, passed: Floats, bad: Defects, noise: float) -> Flaws:
    """Of frames (T, rows, columns), with those bad pixels and a temporal noise of sigma `noise`; so many frame periods
    of the recording `passed` from each to the next (T - 1,)."""
    level = frames.mean(axis=0, dtype=np.float64)
    heights = (level - around(level))[bad.hot]
    still = ~stirred(frames, noise)
    told = bad.blinking & still
    seen = two_levels(frames[:, told].astype(np.float64))
    jumps = _jumps(seen, noise) if told.any() else None
    times = telegraph(seen.high, passed, high_is_away(level, told, seen), _least_share(seen, noise))
    judged = int(bad.judged.sum())
    blinking = _share(told, int((bad.judged & still).sum()))
    for share in (each.seen for each in (jumps, times) if each is not None):
        blinking = _with_unseen(blinking, share)
    return Flaws(
        dead=_share(bad.dead, judged),
        hot=_share(bad.hot, judged),
        blinking=blinking,
        cluster=_cluster(bad.dead | bad.hot | bad.blinking),
        dead_level=float(np.median(level[bad.dead])) if bad.dead.any() else None,
        hot_height=_mean(heights) if heights.size else None,
        jump=jumps.mean if jumps else None,
        on_frames=times.on if times else None,
        off_frames=times.off if times else None,
    )


def _with_unseen(share: Measured, seen: Measured) -> Measured:
    """The share of all, from that of those that are seen, and the share of them that is."""
    high = min(share.high / seen.low, 1.0) if seen.low else 1.0
    return Measured(min(share.value / seen.value, 1.0), min(share.low / seen.high, 1.0), high, bound=share.bound)


def _least_share(blinking: TwoLevels, noise: float) -> Floats:
    """(pixels,) the share p of the time that each has to be on either level to change as much as those that are found:
    jump^2 p (1 - p) + noise^2 = (RESTLESS noise)^2. A half where it would never."""
    asked = (RESTLESS**2 - 1) * (noise / (blinking.upper - blinking.lower).clip(noise)) ** 2
    return np.asarray((1 - np.sqrt((1 - 4 * asked).clip(0))) / 2)


@dataclass(frozen=True)
class _Jumps:
    """Mean jump of the blinking pixels, and the share of them whose jump is high enough to be seen."""

    mean: Measured
    seen: Measured


def _jumps(blinking: TwoLevels, noise: float) -> _Jumps:
    """Of pixels that blink.

    Exponential jumps are seen from some height on, so that their mean is what the seen ones exceed it by, and the share
    of the others follows. Of a few, or of jumps that are alike, those that are seen are told as they are, and the law
    says only how many more there may be at most; of jumps hardly higher than that, it says nothing.
    """
    jumps = blinking.upper - blinking.lower
    often = blinking.high.mean(axis=0)
    share = float(np.minimum(often, 1 - often).mean())
    least = min(RESTLESS * noise / np.sqrt(share * (1 - share)), float(jumps.min()))
    beyond = _mean(jumps - least)
    seen = beyond.map(lambda mean: math.exp(-least / mean) if mean else 0.0)
    scatter = float(np.std(jumps - least)) / beyond.value if beyond.value else 0.0
    extends = seen.value >= _LEAST_SEEN
    if extends and len(jumps) >= _MANY and scatter >= 1 - _ALIKE / math.sqrt(len(jumps)):
        return _Jumps(beyond, seen)
    as_seen = _mean(jumps)
    return _Jumps(replace(as_seen, low=min(beyond.low, as_seen.low)), Measured(1.0, seen.low if extends else 0.0, 1.0))


def _share(mask: Bools, judged: int) -> Measured:
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
