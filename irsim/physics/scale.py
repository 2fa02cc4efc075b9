"""What counts stand for, of a camera or of a recording: the light that gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.physics.radiometry import radiance
from irsim.types import Band, Curve, Floats


@dataclass(frozen=True, slots=True)
class Scale:
    """The noiseless count of in-band radiance L, W/m2/sr: linear L + root sqrt(L) + zero.

    A detector that is stated by two black bodies has no root. One that counts photons has: hotter bodies give less
    of them per watt (`irsim.camera.sensor.ElectronSensor`).
    """

    linear: float
    root: float
    zero: float

    @classmethod
    def between(cls, band: Band, range_k: tuple[float, float], bits: int) -> Scale:
        """Even in radiance between the black bodies, K, of count 0 and of full scale."""
        dark, bright = (float(radiance(band, kelvin)) for kelvin in range_k)
        linear = (2**bits - 1) / (bright - dark)
        return cls(linear, 0.0, -linear * dark)

    @classmethod
    def known(cls, curve: Curve | None, band: Band, range_k: tuple[float, float], bits: int) -> Scale:
        """That of a camera's own curve (linear, root, zero) where it is known, or else between two black bodies."""
        return cls.between(band, range_k, bits) if curve is None else cls(*curve)

    def light(self, counts: Floats) -> Floats:
        """In-band radiance, W/m2/sr, that gives counts (any shape, float32 or float64).

        Of a curve with a root, 0 for counts that no light gives: sqrt(L) of linear L + root sqrt(L) = c is
        2 c / (root + sqrt(root^2 + 4 linear c)).
        """
        if not self.root:
            return counts * counts.dtype.type(1 / self.linear) - counts.dtype.type(self.zero / self.linear)
        kind = counts.dtype.type
        above = np.maximum(counts - kind(self.zero), kind(0))
        over = kind(self.root) + np.sqrt(kind(self.root**2) + kind(4 * self.linear) * above)
        light: Floats = (2 * above / over) ** 2
        return light

    def rise(self, before: Floats, after: Floats) -> Floats:
        """Counts by which one light, W/m2/sr, 0 or more, gives more than another (any shape); 0 for the same light."""
        kind = after.dtype.type
        rise: Floats = (after - before) * kind(self.linear)
        if self.root:
            rise += kind(self.root) * (np.sqrt(np.maximum(after, kind(0))) - np.sqrt(before))
        return rise

    def slope(self, light: float) -> float:
        """Counts per W/m2/sr at a light above 0."""
        return float(self.linear + self.root / (2 * np.sqrt(light)))
