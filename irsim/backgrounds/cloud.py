"""How a cloud looks, pixel by pixel: thickness, warmth and the sun's light become transmittance and emission."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim._native import COMPILED, kernels
from irsim.backgrounds.periodic import enlarged, wrapped_blur
from irsim.physics.radiometry import radiance
from irsim.rng import lookup
from irsim.types import Band, Floats

EXTREME = 6.0
"""Standard deviations of warmth that the table of light covers; what is beyond, once in 1e9, is as at its end."""

ENTRIES = 2**16
"""Of that table: 16-bit words are looked up fastest. A step is 0.18 mK for each K of standard deviation."""

STEP = (ENTRIES - 1) / (2 * EXTREME)
"""Entries of it for each standard deviation."""


@dataclass(frozen=True, eq=False)
class Look:
    """What a cloud's pixels are made by."""

    edge: float
    """Thickness above which there is cloud."""
    depth: float
    """Optical depth for each unit of thickness above it."""
    glow: Floats
    """(ENTRIES,) float32: in-band radiance, W/m2/sr, of warmth from -EXTREME to EXTREME."""
    sunlit: float
    """What full sunlight adds to it where the cloud is thin, W/m2/sr."""

    @classmethod
    def of(cls, edge: float, depth: float, kelvin: tuple[float, float, float], band: Band) -> Look:
        """kelvin: the cloud's temperature, its standard deviation, and what the sun adds."""
        mean, spread, sunlit = kelvin
        warm = np.maximum(mean + spread * np.linspace(-EXTREME, EXTREME, ENTRIES), 1.0)
        dark, lit = radiance(band, np.array([mean, mean + sunlit]))
        return cls(edge, depth, radiance(band, warm).astype(np.float32), float(lit - dark))

    @property
    def brightest(self) -> float:
        """What none of it exceeds, W/m2/sr."""
        return float(self.glow.max()) + self.sunlit

    def paint(self, thickness: Floats, warmth: Floats, lit: Floats | None) -> tuple[Floats, Floats]:
        """Transmittance and emission, before optics, (rows, cols) float32 each.

        thickness, warmth: parts of fields of mean 0 and variance 1; lit: see `Relief.lit`, None without sun."""
        if COMPILED:
            return self._painted(np.ascontiguousarray(thickness), np.ascontiguousarray(warmth), lit)
        above = np.maximum(thickness - np.float32(self.edge), 0)
        transmittance = np.exp(np.float32(-self.depth) * above)
        places = warmth * np.float32(STEP) + np.float32((ENTRIES - 1) / 2)
        np.clip(np.rint(places, out=places), 0, ENTRIES - 1, out=places)
        light = lookup(self.glow, places.astype(np.uint16))
        if lit is not None:
            light += np.float32(self.sunlit) * np.clip(lit, 0, 1) * np.exp(-above)
        light *= 1 - transmittance
        return transmittance, light

    def _painted(self, thickness: Floats, warmth: Floats, lit: Floats | None) -> tuple[Floats, Floats]:
        """What `paint` does, compiled."""
        passed, emitted = np.empty_like(thickness), np.empty_like(thickness)
        sun = None if lit is None else np.ascontiguousarray(lit)
        table = self.glow, STEP, (ENTRIES - 1) / 2
        kernels.cloud(thickness, warmth, sun, self.edge, self.depth, self.sunlit, *table, passed, emitted)
        return passed, emitted


@dataclass(frozen=True, eq=False)
class Relief:
    """The sun's light on a cloud whose thickness is its height: the cosine of a Lambertian surface lit from the side;
    steeper than twice the rms slope is as bright as can be."""

    falling: Floats
    """(rows / coarse, columns / coarse) float32: how steeply it falls off towards the sun."""
    coarse: int

    @classmethod
    def of(cls, slope: Floats, coarse: int) -> Relief:
        """Of a `slope` towards the sun, in any unit, of a thickness that was made `coarse` times smaller."""
        rms = cv2.norm(slope) / math.sqrt(slope.size)  # of differences all around, whose mean is 0
        return cls(slope / np.float32(2 * rms + 1e-12), coarse)

    def lit(self, rows: slice, columns: slice) -> Floats:
        """The share of the sun's light on a part of the large picture, float32, which may reach past the edges: below 0
        it is none, above 1 all of it."""
        return enlarged(self.falling, self.coarse, rows, columns)


def slope_to_sun(thickness: Floats, sigma_px: float, sun_deg: float) -> Floats:
    """How steeply a periodic thickness (rows, columns) falls off towards the sun, float32; that of a sum is the sum of
    those of its parts. What is smaller than sigma_px casts no light; sun_deg: clockwise from up."""
    smooth = wrapped_blur(thickness, sigma_px)
    angle = np.radians(sun_deg)
    across = np.roll(smooth, -1, axis=1) - np.roll(smooth, 1, axis=1)
    down = np.roll(smooth, -1, axis=0) - np.roll(smooth, 1, axis=0)
    return np.asarray(float(np.cos(angle)) * down - float(np.sin(angle)) * across)  # the sun is at (sin, -cos), y down
