"""Whether intervals hold what is true as often as they say."""

from __future__ import annotations

from scipy.stats import binom

from irsim.measure.interval import Measured


def held(found: list[Measured], true: float) -> None:
    """A 95 % interval holds at least so often that less is 1 in 10^4."""
    count = sum(x.low <= true <= x.high for x in found)
    assert count >= binom.ppf(1e-4, len(found), 0.95), (count, true, found[:3])
