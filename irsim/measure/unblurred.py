"""Texture and white floor where the blur is not known exactly: told for every blur that it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from irsim.measure.field import Field, Spectrum, fit_field
from irsim.measure.interval import Measured
from irsim.types import Floats

USUAL_BLUR = Measured(0.6, 0.4, 0.8)
"""Sigma, px, where no point is seen: 0.42 F lambda / pitch is a Gaussian's, and cameras are built with F lambda / pitch
from 1 to 2, where diffraction alone cuts off at the pixels' own limit (G. C. Holst, "Imaging system performance based
upon F lambda / d", Opt. Eng. 46, 2007)."""
_STEP = 0.1
"""Px between the blurs that are tried; more where these would be more than `_MOST_TRIED`."""
_DOUBT = 0.1
"""What is thought of an unseen blur before, px: the usual one, give or take this."""
_PREFERRED = 3.0
"""Log likelihood that another blur than the seen one has to gain: half as much again as a 95 % interval allows."""
_MOST_TRIED = 9


def fit_unblurred(periodogram: Floats, shape: tuple[int, int], blur: Measured | None) -> tuple[Spectrum, Measured]:
    """As `fit_field` finds them, and the blur, of a picture (rows, columns) whose sharpest thing has a `blur`, or in
    which no thing tells it (None).

    What was seen has a size of its own, so that the lens may be as sharp as usual ones are. Each interval is the hull
    of those at all blurs that may be. The blur is the seen one, unless a power law is clearly likelier under another
    one; where none was seen, that of the usual ones under which it is likeliest. For the blur's interval that counts
    for nothing, since a real scene need not follow one.
    """
    low, high = min(USUAL_BLUR.low, blur.low if blur else math.inf), blur.high if blur else USUAL_BLUR.high
    steps = min(math.ceil(round((high - low) / _STEP, 6)), _MOST_TRIED)
    tried: Floats = np.linspace(low, high, steps + 1).round(4)
    if blur is None:
        doubts = np.square((tried - USUAL_BLUR.value) / _DOUBT) / 2
    else:
        tried = np.append(tried, blur.value)
        doubts = _PREFERRED * (tried != blur.value)
    spectra = [fit_field(periodogram, shape, float(psf_px)) for psf_px in tried]
    likeliest = int(np.argmin([spectrum.loss for spectrum in spectra] + doubts))
    taken = Measured(float(tried[likeliest]), low, high)
    return _hull(spectra[likeliest], spectra), taken


def _hull(middle: Spectrum, spectra: Sequence[Spectrum]) -> Spectrum:
    """`middle` with intervals that hold those of all."""
    floor = _around(middle.floor, [spectrum.floor for spectrum in spectra])
    if middle.texture is None:
        return Spectrum(None, floor, middle.density, middle.loss)
    textures = [spectrum.texture for spectrum in spectra if spectrum.texture is not None]
    values = {
        field.name: _around(getattr(middle.texture, field.name), [getattr(texture, field.name) for texture in textures])
        for field in fields(Field)
    }
    return Spectrum(Field(**values), floor, middle.density, middle.loss)


def _around(middle: Measured, found: Sequence[Measured]) -> Measured:
    return Measured(middle.value, min(one.low for one in found), max(one.high for one in found))
