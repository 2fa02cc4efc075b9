"""A detector in electrons that answers to light and is noisy as one of which no more than that is known."""

from __future__ import annotations

import math

from irsim.camera.response import NETD_K, Electrons, Setting
from irsim.physics.radiometry import radiance
from irsim.types import Band, Curve

LARGEST_PITCH_UM, LARGEST_WELL_ME = 1000.0, 10_000.0
"""What a detector's `pitch_um` and `well_me` may be at most."""


def electrons_like(curve: Curve, band: Band, bits: int, rate_hz: float, sigma: float) -> Electrons:
    """A detector of which that is the curve, in a camera of so many bits and frames a second.

    Its NETD is that of shot noise alone, and one sigma of it is `sigma` counts, above 0, at 300 K: c counts of sigma s
    are (c / s)^2 electrons. It is more counts where no well or no pixel holds so many electrons.
    """
    nominal = Electrons(pitch_um=1.0, integration_ms=min(10.0, 500 / rate_hz), read_noise_e=0.0)
    per_um2 = nominal.response(Setting(band, bits, 0.0, (0.0, 0.0))).noise ** 2  # electrons at NETD_K
    linear, root, zero = curve
    light, offset = float(radiance(band, NETD_K)), max(zero, 0.0)
    counts = linear * light + root * math.sqrt(light)
    room = 2**bits - 1 - offset
    gain = min(counts / sigma**2, LARGEST_WELL_ME * 1e6 / room, LARGEST_PITCH_UM**2 * per_um2 / counts)
    pitch_um = min(math.sqrt(counts * gain / per_um2), LARGEST_PITCH_UM)  # not above by rounding
    well_me = min(gain * room * 1e-6, LARGEST_WELL_ME)
    return nominal.model_copy(update={"pitch_um": pitch_um, "well_me": well_me, "offset": offset})
