"""Which grey levels a texture has, where they are not a Gaussian field's."""

from __future__ import annotations

import numpy as np

from irsim.measure.field import Spectrum
from irsim.types import Floats

_SKEWED = 4.0
"""Standard errors from which a histogram is no Gaussian one."""
_SHARES = 17
"""Values of a histogram."""


def histogram(seen: Floats, spectrum: Spectrum) -> tuple[float, ...]:
    """Values at even shares of those pixels that are `seen` of a picture, where skewness or tails are not a Gaussian
    field's; else none.

    The scatter of both, 6 / n and 24 / n in variance, is that of as many independent values n as the
    spectrum has: (sum S)^2 / sum S^2.
    """
    if spectrum.texture is None:
        return ()
    density = spectrum.density.copy()
    density[0, 0] = 0
    independent = density.sum() ** 2 / np.square(density).sum()
    unit = (seen - seen.mean()) / seen.std()
    skewed = abs(float((unit**3).mean())) / np.sqrt(6 / independent)
    tailed = abs(float((unit**4).mean()) - 3) / np.sqrt(24 / independent)
    if max(skewed, tailed) < _SKEWED:
        return ()
    return tuple(float(value) for value in np.quantile(seen, np.linspace(0.002, 0.998, _SHARES)))
