"""How long tracks hold: the share still held against time, when many end before they are lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from irsim.types import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Survival:
    """A step function: from times[i] on, the share held[i], with its interval low[i] .. high[i].

    Before times[0] all are held. at_risk[i] is the number of tracks watched just before times[i].
    """

    times: Floats
    held: Floats
    low: Floats
    high: Floats
    at_risk: np.ndarray

    @property
    def median(self) -> float | None:
        """The time by which half are lost; None where so many never are."""
        reached = np.flatnonzero(self.held <= 0.5)
        return float(self.times[reached[0]]) if len(reached) else None


def kaplan_meier(times: Sequence[float] | Floats, lost: Sequence[bool] | np.ndarray, level: float = 0.95) -> Survival:
    """The share of tracks still held against time.

    Kaplan and Meier, J. Am. Stat. Assoc. 53 (1958) 457; variance by Greenwood (1926), the interval on
    the scale log(-log S) (Kalbfleisch and Prentice 1980), which stays within 0..1.

    times   (n,) when each track was lost, or ended; any unit
    lost    (n,) bool: was it lost then? Else it was held to its end (censored)
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
    none_left = held == 0  # no variance is known there
    low[none_left], high[none_left] = 0.0, 0.0
    return Survival(moments, held, low, high, at_risk)
