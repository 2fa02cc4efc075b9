"""Detectability of targets: the squared deflection d^2 = s' V^-1 s of the ideal matched filter of one frame.

    s = counts that the target adds         V = D + C
    D = temporal noise of each pixel        C = covariance of the clutter, by its power spectrum

An observer that knows s, V and the place finds the target with Pd = Q(Q^-1(Pfa) - d), the largest of all tests in
normal noise (Neyman-Pearson; S. Kay, "Detection Theory", 1998, eq. 4.16). d^2 is also the Fisher information of the
target's amplitude in units of its true value.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.special import ndtr, ndtri

from irsim.camera.noise_base import NoiseVariance
from irsim.render.moments import Exact, Moments
from irsim.scenario.model import Scenario
from irsim.types import Slices

SEGMENT_PX = 48
"""Least side of the segments of which power spectra are the mean, and of the region in which V is inverted, px."""
RIM_PX = 16
"""Width of the region around a target's signature, px: clutter there predicts the clutter under the target."""
SEGMENTS = 4
"""Side of the local region whose clutter is measured, in sides of a segment: 49 segments overlap by a half."""
NEGLIGIBLE = 1e-6
"""Share of the signature's largest value below which a pixel is not part of it."""
TOLERANCE, STEPS = 1e-8, 500
"""Relative residual at which conjugate gradients stop, and their largest number of steps."""


class Clutter(NamedTuple):
    """Noise and clutter around a target.

    region     rows and columns of the frame
    variance   (rows, cols) of the noise, counts²; spectrum  (rows, cols) of the clutter, see `whitened`
    """

    region: Slices
    variance: Exact
    spectrum: Exact


class Detectability:
    """d^2 of the targets of a scenario, frame by frame.

    The clutter is the noiseless background without any target. Its covariance is that of a stationary field: the mean
    power spectrum of overlapping segments with a Hann window (Welch 1967) in a square of four segments around the
    target; a segment has 48 px, or 32 px more than the target. Leakage between frequencies lowers d by 1 % in f^-3
    clutter. The noise is temporal: fixed patterns count as known, and so does an offset that is common to the whole
    frame. Noise that is correlated along rows or columns counts as white. Pixels that do not respond, dead or
    saturated, carry no information. Of an occluded target the visible part counts.

    InputError for a recorded background, whose noise is unknown (when d^2 is computed).
    """

    def __init__(self, scenario: Scenario) -> None:
        self._moments = Moments(scenario)
        self._background = lru_cache(maxsize=1)(Moments(scenario, [each.id for each in scenario.targets]).mean)
        self._sensor = scenario.camera.signal_chain(scenario.seed, scenario.is_on)
        self._scenario = scenario
        self._noise = lru_cache(maxsize=1)(self._temporal_variance)

    def d2(self, index: int, target: str) -> float:
        """Return d^2 of a target in the arriving frame `index`; 0 where it adds nothing to the frame.

        InputError where there is no such target; IndexError where no frame of that index arrives.
        """
        signature = self._moments.contribution(index, target)
        found = self.clutter(index, signature)
        return 0.0 if found is None else deflection(signature[found.region], found.variance, found.spectrum)

    def clutter(self, index: int, signature: Exact) -> Clutter | None:
        """Return noise and clutter around a signature (rows, cols) of the frame; None where it is 0 everywhere."""
        held = np.abs(signature) > NEGLIGIBLE * np.abs(signature).max(initial=0.0)
        if not held.any():
            return None
        rows, columns = (np.flatnonzero(held.any(axis=axis)) for axis in (1, 0))
        lines = [
            ((int(line[0]), int(line[-1]) + 1), count)
            for line, count in zip((rows, columns), signature.shape, strict=True)
        ]
        sides = [min(max(SEGMENT_PX, stop - first + 2 * RIM_PX), count) for (first, stop), count in lines]
        both = list(zip(lines, sides, strict=True))
        near = tuple(_around(span, side, count) for (span, count), side in both)
        local = tuple(_around(span, SEGMENTS * side, count) for (span, count), side in both)
        spectrum = clutter_spectrum(self._background(index)[local], (sides[0], sides[1]))
        return Clutter((near[0], near[1]), self._noise(index)[near], spectrum)

    def _temporal_variance(self, index: int) -> Exact:
        """Return the variance of each pixel less that of the frame's common offset, counts²."""
        sensor = self._sensor
        frame = sensor.frame_context(sensor.shown(self._scenario.arrivals[index]), (1, 1))
        common = NoiseVariance.total(each.variance_terms(frame, False) for each in sensor.noises).frame
        offset = common * (sensor.response.noise / sensor.response.gain) ** 2
        return self._moments.variance(index, fixed=False) - offset


def _around(span: tuple[int, int], side: int, count: int) -> slice:
    """Return a span of `side` pixels about the middle of a span, moved into a line of `count` pixels; the whole line if
    that is shorter."""
    first = min(max((sum(span) - side) // 2, 0), max(count - side, 0))
    return slice(first, min(first + side, count))


def clutter_spectrum(background: Exact, sides: tuple[int, int]) -> Exact:
    """Return the power spectrum (sides) of a background (rows, cols), counts²: eigenvalues of its covariance.

    Each segment less its weighted mean; the power at frequency 0, lost with the mean, is taken as the largest of its
    neighbours. The eigenvalues of white noise are its variance.
    """
    window = np.outer(*(np.sin(np.pi * (np.arange(side) + 0.5) / side) ** 2 for side in sides))
    steps = [max(side // 2, 1) for side in sides]
    segments = np.lib.stride_tricks.sliding_window_view(background, sides)[:: steps[0], :: steps[1]]
    segments = segments.reshape(-1, *sides)
    means = (segments * window).sum(axis=(1, 2), keepdims=True) / window.sum()
    found = fft.fft2((segments - means) * window)
    power: Exact = (found.real**2 + found.imag**2).mean(axis=0) / (window**2).sum()
    power[0, 0] = max(power[0, 1 % sides[1]], power[1 % sides[0], 0], power[0, 0])
    return power


def deflection(signature: Exact, variance: Exact, spectrum: Exact) -> float:
    """Return d^2 = s' V^-1 s of a signature s (rows, cols), counts; see `whitened`."""
    s = np.where(np.isfinite(variance), signature, 0.0)
    return float(np.vdot(s, whitened(signature, variance, spectrum)))


def whitened(signature: Exact, variance: Exact, spectrum: Exact) -> Exact:
    """Return V^-1 s (rows, cols) of a signature s, counts.

    variance   (rows, cols) counts², of noise that is independent from pixel to pixel; infinite where a pixel carries
               nothing
    spectrum   (rows, cols) counts², eigenvalues of the clutter's covariance, which is periodic in the region

    By conjugate gradients, preconditioned by the inverse for the mean variance.
    """
    responds = np.isfinite(variance)
    if not responds.any():
        return np.zeros_like(signature)
    own = np.where(responds, variance, 0.0)
    half = spectrum[:, : spectrum.shape[1] // 2 + 1]
    inverse = 1 / (half + max(float(own[responds].mean()), np.finfo(float).tiny))

    def filtered(x: Exact, transfer: Exact) -> Exact:
        return np.asarray(responds * fft.irfft2(fft.rfft2(x) * transfer, s=x.shape))

    s = np.where(responds, signature, 0.0)
    x, residual = np.zeros_like(s), s
    step = solved = filtered(residual, inverse)
    energy = float(np.vdot(residual, solved))
    least = TOLERANCE**2 * energy
    for _ in range(STEPS):
        if energy <= least:
            break
        image = own * step + filtered(step, half)
        length = energy / float(np.vdot(step, image))
        x, residual = x + length * step, residual - length * image
        solved = filtered(residual, inverse)
        energy, last = float(np.vdot(residual, solved)), energy
        step = solved + energy / last * step
    return x


def detection_probability(d2: npt.ArrayLike, pfa: npt.ArrayLike) -> Exact:
    """Return Pd = Q(Q^-1(Pfa) - d) of the ideal matched filter."""
    return np.asarray(ndtr(np.sqrt(d2) + ndtri(pfa)), np.float64)
