"""The camera's fixed pattern in a still picture, told from what is seen there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from irsim.measure.field import Field, Spectrum, periodogram
from irsim.measure.flat_windows import WINDOW_SIDE
from irsim.measure.interval import Measured
from irsim.measure.lines import common_lines, crossed, kinked, lines
from irsim.measure.region import Region
from irsim.measure.unblurred import fit_unblurred
from irsim.types import MEDIAN_TO_SIGMA, Bools, Floats

_LEAST_SIDE = 32
"""Of smaller windows, px, a spectrum tells nothing."""
_UNEVEN = 1.08
"""Rms of sharp changes over their robust sigma above which edges are in them: of a Gaussian field it is 1.00 (give or
take 0.02 in 160 x 128 px), of three real sensors 1.02 to 1.04, of rendered fields, trees and roads 1.1 to 3.3."""
_STEEPEST = 5.9
"""Slope along both axes from which a spectrum is no texture's. The search ends at 6; of rendered grounds and skies of
slopes up to 4 the most is 4.4, of lone smooth things and of what a lens out of focus leaves it is 6."""


@dataclass(frozen=True)
class Pattern:
    """What stays in a picture, in its units.

    spectrum    of the whole picture, texture and all; where that falls more steeply than any texture, without one
    blur        under which it is told, px
    floor       variance of what differs from pixel to pixel
    row, column sigmas of offsets from row to row and from column to column
    quietest    where the floor is told, if not in the whole picture
    across      "rows", "columns": along which edges of the scene go all across
    """

    spectrum: Spectrum
    blur: Measured
    floor: Measured
    row: Measured
    column: Measured
    quietest: Region | None
    across: tuple[str, ...]


def fixed_pattern(picture: Floats, blur: Measured | None, stirred: bool, held: Bools) -> Pattern:
    """Of a picture (rows, columns) that lies under a `blur`, px, if that is known; rows and columns turned even.

    A random field's texture is told from what is white by the spectrum of the whole picture, and from rows and columns
    by its axes. Edges and things of a scene are no such field, and look like both. Where they are seen, pixels are told
    where the picture is quietest, for a detector's pattern is the same everywhere; rows and columns by what all parts
    of the picture have in common, and so, too, where something `stirred` while it was taken, or an edge or a kink goes
    all across. Where things `held` it (rows, columns), it is what is around them, and too quiet.
    """
    powers = periodogram(picture)
    spectrum, told = fit_unblurred(powers, picture.shape, blur)
    sharp = _sharp(picture)
    near = cv2.dilate(held.astype(np.uint8), np.ones((3, 3), np.uint8))[1:-1, 1:-1].astype(np.bool_)
    seen = sharp[~near]
    uneven = float(np.sqrt(np.square(seen).mean())) > _UNEVEN * MEDIAN_TO_SIGMA * float(np.median(seen))
    along = lines(powers, spectrum.density, picture.shape)
    across = crossed(picture)
    apart = uneven or stirred
    mixed = {*across, *kinked(powers, spectrum.density, picture.shape)}
    common = common_lines(picture) if apart or mixed else along
    row = common.row if apart or "rows" in mixed else along.row
    column = common.column if apart or "columns" in mixed else along.column
    if spectrum.texture is not None and _smooth(spectrum.texture):
        spectrum = replace(spectrum, texture=None)
    quietest = _quietest(np.where(near, sharp.max(), sharp)) if uneven else None
    if quietest is None:
        return Pattern(spectrum, told, spectrum.floor, row, column, None, across)
    part = picture[quietest.rows, quietest.columns]
    floor = fit_unblurred(periodogram(part), part.shape, blur)[0].floor
    return Pattern(spectrum, told, floor, row, column, quietest, across)


def _smooth(texture: Field) -> bool:
    return min(texture.beta_x.value, texture.beta_y.value) > _STEEPEST


def _sharp(picture: Floats) -> Floats:
    """What the mask [1 -2 1] x [1 -2 1], which passes nothing smooth, makes of a picture, without its outermost pixels;
    absolute values."""
    return np.abs(np.diff(np.diff(picture, n=2, axis=0), n=2, axis=1))


def _quietest(sharp: Floats) -> Region | None:
    """The window, 64 px wide and high or half of the picture, with the least sharp changes; None where it is small.

    By the mean of their absolute values, to which a few strong ones add little.
    """
    rows, columns = sharp.shape
    side = min(WINDOW_SIDE, min(rows, columns) // 2)
    if side < _LEAST_SIDE:
        return None
    means = cv2.boxFilter(sharp, -1, (side, side), anchor=(0, 0))[: rows - side + 1, : columns - side + 1]
    row, column = np.unravel_index(int(np.argmin(means)), means.shape)
    return Region(int(column) + 1, int(row) + 1, side, side)
