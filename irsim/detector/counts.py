"""From radiance to counts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from irsim.radiometry import Band, radiance, slope
from irsim.types import Floats

NETD_K = 300.0
"""Background temperature at which a camera's NETD is stated, K."""


@dataclass(frozen=True)
class Response:
    """A linear detector: counts = gain (radiance - dark), from 0 to full.

    gain in counts per W/m2/sr; dark, the radiance of count 0, W/m2/sr; full, the highest count;
    noise, sigma of one NETD in counts.
    """

    gain: float
    dark: float
    full: int
    noise: float


@lru_cache
def response(netd_mk: float, band: Band, range_k: tuple[float, float], bits: int) -> Response:
    """The detector whose count 0 is a black body of range_k[0] and whose full scale is one of range_k[1].

    NETD is the change of temperature at 300 K that changes the mean count by one sigma:
    sigma = NETD dL/dT gain.
    """
    dark, bright = (float(radiance(band, temperature)) for temperature in range_k)
    full = 2**bits - 1
    gain = full / (bright - dark)
    return Response(gain, dark, full, netd_mk * 1e-3 * slope(band, NETD_K) * gain)


def expose(
    light: Floats,
    patterns: Iterable[Floats],
    netd_mk: float,
    band: Band,
    range_k: tuple[float, float],
    bits: int,
) -> npt.NDArray[np.uint16]:
    """(rows, cols) uint16 counts of `light` (rows, cols) float32, in-band radiance in W/m2/sr.

    `patterns` are the frame's noise terms in units of NETD, float32, broadcastable to the light.
    Counts are rounded to the nearest (halves to even) and clipped to the depth of `bits`: they
    saturate and never wrap around.
    """
    detector = response(netd_mk, band, range_k, bits)
    counts = cv2.addWeighted(light, detector.gain, light, 0, -detector.gain * detector.dark)
    for pattern in patterns:
        if pattern.shape == counts.shape:
            cv2.scaleAdd(pattern, detector.noise, counts, dst=counts)
        else:
            np.add(counts, pattern * np.float32(detector.noise), out=counts)
    np.rint(counts, out=counts)
    np.clip(counts, 0, detector.full, out=counts)
    return counts.astype(np.uint16)
