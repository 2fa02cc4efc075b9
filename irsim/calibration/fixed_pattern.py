"""Fixed pattern of pixels, rows and columns in the mean picture, separated from the scene.

The offsets of a detector's lines are independent of each other and constant along the lines. A scene is neither. For
lines, the mean product of second differences of rows in two parts of the picture gives the variance of whole rows.
Shading over several lines is not measured. For pixels, the white floor of the spectrum is measured; in a picture with
edges, only in its quietest window.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from irsim.calibration.selection import WINDOW_SIDE, Region
from irsim.calibration.statistics import Estimate, chi_square, hull, jackknife, root
from irsim.calibration.texture import Spectrum, fit_texture, periodogram
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

_PARTS = 6
_BENT = 35 / 18
"""1 + 2 (4/6)^2 + 2 (1/6)^2: factor by which differences of neighbours reduce the number of independent lines."""
_OUTSTANDING = (2.6, 3.2, 4.5)
"""Distances, robust sigmas, beyond which a line belongs to the scene, as at a horizon. The interval covers all three
results."""
_SURELY = 6.0
_EDGES = 1.08
"""Ratio of rms to robust sigma of second differences above which the picture has edges. It is 1.00 for a Gaussian
field, 1.02 to 1.04 for three real sensors, and 1.1 to 3.3 for rendered fields, trees and roads."""
_LEAST_SIDE = 32
_BLOCKS = 8


@dataclass(frozen=True)
class FixedPattern:
    """Fixed pattern of a picture, in the picture's units.

    spectrum    spectrum of the whole picture, including texture
    psf         sigma of the blur that is assumed, px
    floor       variance that is independent from pixel to pixel
    row, column sigmas of offsets of rows and of columns
    window      window in which the floor is measured, for a picture with edges, else None
    """

    spectrum: Spectrum
    psf: Estimate
    floor: Estimate
    row: Estimate
    column: Estimate
    window: Region | None


def fixed_pattern(picture: Floats, blur: Estimate | None, filled: Bools) -> FixedPattern:
    """Return the fixed pattern of a picture (rows, columns) whose odd-even offsets have been removed.

    blur    sigma of the sharpest point, px, or None
    filled  mask of pixels that were filled in, which have too little noise
    """
    spectrum, psf = fit_texture(periodogram(picture), picture.shape, blur)
    sharp = np.abs(np.diff(np.diff(picture, n=2, axis=0), n=2, axis=1))
    used = ~cv2.dilate(filled.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)[1:-1, 1:-1]
    seen = sharp[used] if used.any() else sharp
    edges = math.sqrt(float(np.square(seen).mean())) > _EDGES * MEDIAN_TO_SIGMA * float(np.median(seen))
    window = _quietest(np.where(used, sharp, sharp.max())) if edges else None
    floor = spectrum.floor
    if window is not None:
        part = picture[window.rows, window.columns]
        floor = fit_texture(periodogram(part), part.shape, blur)[0].floor
    row, column = line_sigma(picture, edges), line_sigma(picture.T, edges)
    return FixedPattern(spectrum, psf, floor, row, column, window)


def _quietest(sharp: Floats) -> Region | None:
    """Return the window with the least second differences, 64 px or half the picture wide; None in a small one."""
    rows, columns = sharp.shape
    side = min(WINDOW_SIDE, min(rows, columns) // 2)
    if side < _LEAST_SIDE:
        return None
    means = cv2.boxFilter(sharp, -1, (side, side), anchor=(0, 0))[: rows - side + 1, : columns - side + 1]
    row, column = np.unravel_index(int(np.argmin(means)), means.shape)
    return Region(int(column) + 1, int(row) + 1, side, side)


def line_sigma(picture: Floats, edges: bool = False) -> Estimate:
    """Return the sigma of the offsets of whole rows of a picture (rows, columns).

    A row less the mean of its neighbours has 3/2 of the variance of the offsets. In a picture with `edges`, outlying
    rows belong to the scene and are left out with their neighbours.
    """
    bent = _bend(picture)
    parts = np.stack([np.median(part, axis=1) for part in np.array_split(bent, min(_PARTS, bent.shape[1]), axis=1)])
    if not edges:
        return _shared_sigma(parts, math.inf)
    found = [_shared_sigma(parts, sigmas) for sigmas in _OUTSTANDING]
    return hull(found[1], found)


def _shared_sigma(parts: Floats, sigmas: float) -> Estimate:
    """Return the sigma of line offsets that all parts of the picture share, from second differences (parts, rows)."""
    out = _outstanding(parts.mean(axis=0), sigmas)
    widened = out.copy()
    widened[1:] |= out[:-1]
    widened[:-1] |= out[1:]
    kept = parts[:, ~(out if widened.all() else widened)]
    products = [one @ other for k, one in enumerate(kept) for other in kept[k + 2 :]] or [kept[0] @ kept[0]]
    common = float(np.mean(products)) / kept.shape[1]
    power = float(np.square(kept.mean(axis=0)).mean())
    whole = chi_square(power, kept.shape[1] / _BENT)
    if whole.high <= power - common:
        return Estimate(0.0, 0.0, root(whole.high / 1.5))
    return whole.map(lambda variance: root((variance - power + common) / 1.5))


def odd_even(picture: Floats, axis: int) -> Estimate:
    """Return half of the offset of even rows (axis 0) or columns (1) of a picture above odd ones, by a jackknife."""
    bent = _bend(picture.mean(axis=1 - axis))
    above = bent / 2 * np.where(np.arange(1, len(bent) + 1) % 2, -1, 1)
    pairs = above[: len(above) // 2 * 2].reshape(-1, 2)
    kept = pairs[~_outstanding(pairs, _SURELY * (1 + 8 / pairs.size)).any(axis=1)]
    means = (kept if len(kept) > 1 else pairs).mean(axis=1)
    blocks = np.array([block.mean() for block in np.array_split(means, min(_BLOCKS, len(means)))])
    return jackknife(blocks[:, None], lambda mean: mean)[0]


def remove_odd_even(picture: Floats, rows: float, columns: float) -> Floats:
    """Return the picture without the offsets of even and odd lines that `odd_even` found."""
    signs = [np.where(np.arange(length) % 2, -1.0, 1.0) for length in picture.shape]
    evened: Floats = picture - rows * signs[0][:, None] - columns * signs[1]
    return evened


def _bend(levels: Floats) -> Floats:
    """Return each inner line of `levels` (rows, ...) less the mean of its two neighbours."""
    return np.asarray(levels[1:-1] - (levels[:-2] + levels[2:]) / 2)


def _outstanding(levels: Floats, sigmas: float) -> Bools:
    apart = np.abs(levels - np.median(levels))
    far: Bools = apart > sigmas * MEDIAN_TO_SIGMA * np.median(apart)
    return far
