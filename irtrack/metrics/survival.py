"""Survival of tracks: the share not yet lost against time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from irsim.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Survival:
    """Survival curve, a step function: share of tracks held[i] from times[i] on, with its interval low[i] .. high[i].

    Before times[0] all tracks are held. at_risk[i] is the number of tracks neither lost nor ended before times[i].
    """

    times: Floats
    held: Floats
    low: Floats
    high: Floats
    at_risk: np.ndarray

    @property
    def median(self) -> float | None:
        """Time by which half of the tracks are lost; None where fewer than half are lost."""
        reached = np.flatnonzero(self.held <= 0.5)
        return float(self.times[reached[0]]) if len(reached) else None


def kaplan_meier(times: Sequence[float] | Floats, lost: Sequence[bool] | np.ndarray, level: float = 0.95) -> Survival:
    """Return the Kaplan-Meier estimate of the share of tracks not yet lost, against time.

    Kaplan and Meier, J. Am. Stat. Assoc. 53 (1958) 457; variance by Greenwood (1926), the interval on
    the scale log(-log S) (Kalbfleisch and Prentice 1980), which stays within 0..1.

    times   (n,) time of the loss or of the end of each track; any unit
    lost    (n,) bool: True: the track was lost at this time; False: it ended without loss (censored)
    """
    times, lost = np.asarray(times, dtype=np.float64), np.asarray(lost, dtype=bool)
    moments = np.unique(times[lost])
    at_risk = np.array([(times >= moment).sum() for moment in moments], dtype=np.int64)
    losses = np.array([(lost & (times == moment)).sum() for moment in moments], dtype=np.int64)
    held = np.cumprod(1 - losses / at_risk)
    left = at_risk - losses
    with np.errstate(divide="ignore", invalid="ignore"):
        greenwood = np.cumsum(losses / (at_risk * left))
        reach = NormalDist().inv_cdf((1 + level) / 2) * np.sqrt(greenwood) / np.abs(np.log(held))
        low, high = held ** np.exp(reach), held ** np.exp(-reach)
    none_left = held == 0  # the variance is undefined where no track is held
    low[none_left], high[none_left] = 0.0, 0.0
    return Survival(moments, held, low, high, at_risk)
