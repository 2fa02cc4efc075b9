"""Mounts that shake with a known spectrum: lines of a vibration, and random shaking."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from irsim.config.base import Several
from irsim.config.quantities import NotNegative, Positive
from irsim.geometry.context import SceneContext
from irsim.motion.base import Pointing
from irsim.motion.shaking import shaking
from irsim.rng import stream
from irsim.types import Floats

Line = Annotated[tuple[Positive, NotNegative, NotNegative], Field(strict=False)]
Node = Annotated[tuple[Positive, NotNegative], Field(strict=False)]

_WAVES = 64
"""Sinusoids per axis."""


class Vibration(Pointing):
    """Lines of an engine, a rotor or a cooler: sinusoids of given frequency and size, random phase.

    Lines above half the frame rate are seen at their aliased frequency, as a camera with a short
    integration time sees them.
    """

    lines: Annotated[Several[Line], Field(min_length=1)] = ((12.0, 0.5, 0.5),)
    """List of [Hz, amplitude in azimuth px, amplitude in elevation px], px at zoom 1."""

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        hertz, *amplitudes = np.array(self.lines).T
        phases = stream(context.seed, self.name, "vibration").uniform(0, 2 * np.pi, (2, len(hertz)))
        seconds = np.asarray(frames, dtype=np.float64)[:, None, None] / context.rate_hz
        waves = np.array(amplitudes) * np.sin(2 * np.pi * hertz * seconds + phases)
        turned = context.geometry.ifov_rad * waves.sum(axis=-1)
        return np.concatenate([turned, np.zeros_like(turned[:, :1])], axis=1)


class Shake(Pointing):
    """Random shaking whose spectrum is given: of the density that it is to have, only the shape counts.

    A sum of sinusoids of equal power with random phases, one from each of equally powerful slices of the spectrum.
    """

    rms_px: NotNegative = 0.5
    """Root mean square of each axis, px at zoom 1: an angle, which a zoom shows larger."""
    spectrum: Annotated[Several[Node], Field(min_length=2)] = ((0.1, 1.0), (2.0, 1.0), (15.0, 0.02))
    """List of [Hz, power density]: straight lines between these, nothing outside."""

    @model_validator(mode="after")
    def _has_power(self) -> Shake:
        if any(b[0] <= a[0] for a, b in pairwise(self.spectrum)):
            raise PydanticCustomError(
                "shake", "the frequencies do not rise; allowed: rising ones", {"at": ("spectrum",)}
            )
        if not any(density for _, density in self.spectrum):
            raise PydanticCustomError(
                "shake", "there is no power in it; allowed: a density above 0", {"at": ("spectrum",)}
            )
        return self

    def turns(self, frames: Floats, context: SceneContext) -> Floats:
        rng = stream(context.seed, self.name, "shake")
        slices = (np.arange(_WAVES) + rng.random((2, _WAVES))) / _WAVES
        hertz, phases = self._frequencies(slices), rng.uniform(0, 2 * np.pi, (2, _WAVES))
        return shaking(self.rms_px, 2 * np.pi * hertz, phases, frames, context)

    def _frequencies(self, shares: Floats) -> Floats:
        """Hz below which lie `shares` 0..1 of the power: the inverse of the spectrum's integral."""
        hertz, density = np.array(self.spectrum).T
        width = np.diff(hertz)
        power = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2 * width))
        wanted = shares * power[-1]
        span = np.clip(np.searchsorted(power, wanted, side="right") - 1, 0, len(width) - 1)
        low, slope, rest = density[span], np.diff(density)[span] / width[span], wanted - power[span]
        # low x + slope x^2 / 2 = rest, in a form that holds at slope 0 and at low 0.
        root = np.sqrt(np.maximum(low**2 + 2 * slope * rest, 0.0))
        return np.asarray(hertz[span] + 2 * rest / np.maximum(low + root, 1e-300))
