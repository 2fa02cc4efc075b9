"""Features of patches by which a classifier tells real pictures from rendered ones, in four families.

Each patch is standardised by its own mean and standard deviation first: gain and level of the display do not tell.
Spectra: bands of the periodogram. Wavelets: marginals of the Haar transform, as in E. P. Simoncelli, "Modeling the
joint statistics of images in the wavelet domain", Proc. SPIE 3813, 1999.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from irsim.calibration.patches import Patches
from irsim.types import Floats

_BANDS = np.geomspace(1, 24, 9)
"""Limits of the bands of the spectrum, cycles per patch."""
_QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
_LEVELS = 3
_TINY = 1e-6


def patch_features(patches: Patches) -> Mapping[str, Floats]:
    """Return the features (n, f) of patches (n, 3, side, side) by family: level, spectrum, wavelet, time."""
    values = patches.astype(np.float32)
    middle = values[:, 1]
    spread = np.maximum(middle.std(axis=(1, 2)), 0.5)[:, np.newaxis, np.newaxis]
    scaled = (middle - middle.mean(axis=(1, 2), keepdims=True)) / spread
    found = {
        "level": _level(scaled, patches[:, 1]),
        "spectrum": _spectrum(scaled),
        "wavelet": _wavelet(scaled),
        "time": _time(values, spread),
    }
    return {family: np.nan_to_num(columns, posinf=0.0, neginf=0.0) for family, columns in found.items()}


def _level(scaled: Floats, grey: Patches) -> Floats:
    """Return shape of the histogram and its steps: moments, quantiles, number of grey levels, equal neighbours."""
    flat = scaled.reshape(len(scaled), -1)
    levels = [len(np.unique(each)) for each in grey]
    return np.column_stack(
        [
            (flat**3).mean(axis=1),
            _log_kurtosis(flat),
            np.quantile(flat, _QUANTILES, axis=1).T,
            np.log(levels),
            (grey[:, :, 1:] == grey[:, :, :-1]).mean(axis=(1, 2)),
            (grey[:, 1:] == grey[:, :-1]).mean(axis=(1, 2)),
        ]
    )


def _spectrum(pictures: Floats) -> Floats:
    """Return log power in bands over all directions and in strips along x and y."""
    side = pictures.shape[-1]
    window = np.outer(np.hanning(side), np.hanning(side))
    power = np.square(np.abs(np.fft.rfft2(pictures * window))).reshape(len(pictures), -1) + 1e-3
    fx, fy = np.meshgrid(np.fft.rfftfreq(side) * side, np.fft.fftfreq(side) * side)
    radius, columns = np.hypot(fx, fy).ravel(), []
    for kept in (np.ones(radius.shape, bool), np.abs(fy.ravel()) <= 1, np.abs(fx.ravel()) <= 1):
        for low, high in pairwise(_BANDS):
            columns.append(np.log(power[:, kept & (radius >= low) & (radius < high)].mean(axis=1)))
    return np.column_stack(columns)


def _wavelet(pictures: Floats) -> Floats:
    """Return log energy, log kurtosis and mean over root mean square of Haar coefficients, three scales and
    directions."""
    rest, columns = pictures, []
    for _ in range(_LEVELS):
        a, b, c, d = rest[:, ::2, ::2], rest[:, ::2, 1::2], rest[:, 1::2, ::2], rest[:, 1::2, 1::2]
        for detail in (a - b + c - d, a + b - c - d, a - b - c + d):
            flat = detail.reshape(len(detail), -1)
            rms = np.sqrt(np.square(flat).mean(axis=1)) + _TINY
            columns += [np.log(rms + 1e-3), _log_kurtosis(flat), np.abs(flat).mean(axis=1) / rms]
        rest = (a + b + c + d) / 4
    return np.column_stack(columns)


def _time(values: Floats, spread: Floats) -> Floats:
    """Return size, distribution, texture and correlation of the changes between neighbouring frames."""
    first, second = (np.asarray(values[:, k + 1] - values[:, k]) for k in range(2))
    flat, after = (each.reshape(len(each), -1) for each in (first, second))
    centred = first - first.mean(axis=(1, 2), keepdims=True)
    sigma = flat.std(axis=1)
    along = [
        (a * b).mean(axis=(1, 2)) / np.maximum(sigma**2, 1e-2)
        for a, b in ((centred[:, :, 1:], centred[:, :, :-1]), (centred[:, 1:], centred[:, :-1]))
    ]
    bands = _spectrum(centred / np.maximum(sigma, 0.1)[:, np.newaxis, np.newaxis])[:, : len(_BANDS) - 1]
    product = ((flat - flat.mean(axis=1, keepdims=True)) * (after - after.mean(axis=1, keepdims=True))).mean(axis=1)
    return np.column_stack(
        [
            np.log(sigma + 0.02),
            np.log((sigma + 0.02) / spread[:, 0, 0]),
            np.log((after.std(axis=1) + 0.02) / (sigma + 0.02)),
            (flat == 0).mean(axis=1),
            _log_kurtosis(flat),
            *along,
            product / (sigma * after.std(axis=1) + 1e-2),
            bands,
        ]
    )


def _log_kurtosis(flat: Floats) -> Floats:
    centred = flat - flat.mean(axis=1, keepdims=True)
    variance = np.square(centred).mean(axis=1)
    found: Floats = np.log((centred**4).mean(axis=1) / np.maximum(variance**2, 1e-9) + 1e-2)
    return found
