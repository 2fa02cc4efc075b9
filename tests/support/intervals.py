"""Whether intervals hold what is true as often as they say, and are no wider than they need be."""

from __future__ import annotations

import numpy as np
from scipy.stats import binom

from irsim.calibration.statistics import Estimate


def held(found: list[Estimate], true: float, *, widest: float | None = None) -> None:
    """A 95 % interval holds at least so often that less is 1 in 10^4; half of them are no wider than `widest` times
    the true value: what was measured and about a third more. Without it, something else has to hold the width."""
    least = binom.ppf(1e-4, len(found), 0.95)
    assert least > 0, "too few to tell: three intervals may all miss"
    count = sum(x.low <= true <= x.high for x in found)
    assert count >= least, (count, true, found[:3])
    if widest is not None:
        width = np.median([x.high - x.low for x in found])
        assert width <= widest * abs(true), (width, true, found[:3])
