"""Local binary patterns, and the picture of grey levels and patterns of which joint histograms are taken.

    LBP riu2(8, 1) = sum_p s(g_p - g_c - offset)  where at most two of the eight signs in a circle change, else 9

T. Ojala, M. Pietikainen, T. Maenpaa, "Multiresolution gray-scale and rotation invariant texture classification with
local binary patterns", IEEE TPAMI 24(7), 2002, eq. 9 to 11: the neighbours g_p lie on a circle of radius 1 px, those on
the diagonals are interpolated. The offset keeps noise on flat ground from making patterns (M. Heikkila, M. Pietikainen,
"A texture-based method for modeling the background and detecting moving objects", IEEE TPAMI 28(4), 2006, eq. 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from irsim.types import Image
from irtrack.features.frequency import FrequencyHighPass
from irtrack.features.highpass import HighPass
from irtrack.features.quantiser import Quantiser

PATTERNS = 10
"""Number of patterns: 0 to 8 signs in one run, or more than one run."""
DIAGONAL = 0.70711
"""Coordinate of a diagonal neighbour, px, with five decimals."""

STRIP = 16_384
"""Number of pixels of a strip of rows coded at once: it fits the processor's cache, so that coding takes a third of the
time."""

Codes = npt.NDArray[np.uint8]


def uniform_patterns(image: npt.NDArray[np.generic], offset: float) -> Codes:
    """Return the pattern 0 .. 9 of each pixel, (rows, columns); edge pixels are repeated beyond the frame."""
    wide = np.pad(image, 1, mode="edge")
    rows, strip = image.shape[0], max(STRIP // image.shape[1], 1)
    return np.concatenate([_coded(wide[top : top + strip + 2], offset) for top in range(0, rows, strip)])


def _coded(strip: npt.NDArray[np.generic], offset: float) -> Codes:
    """Return the patterns of a strip of rows less its rim of 1 px."""
    wide = strip.astype(np.float64)
    rows, columns = wide.shape[0] - 2, wide.shape[1] - 2

    def moved(down: int, right: int) -> npt.NDArray[np.float64]:
        part: npt.NDArray[np.float64] = wide[1 + down : 1 + down + rows, 1 + right : 1 + right + columns]
        return part

    def between(down: int, right: int) -> npt.NDArray[np.float64]:
        """Return the picture at (down, right) times `DIAGONAL` px, by bilinear interpolation."""
        top, left = min(down, 0), min(right, 0)
        dr, dc = (DIAGONAL if step > 0 else 1 - DIAGONAL for step in (down, right))
        upper = (1 - dc) * moved(top, left) + dc * moved(top, left + 1)
        lower = (1 - dc) * moved(top + 1, left) + dc * moved(top + 1, left + 1)
        value: npt.NDArray[np.float64] = (1 - dr) * upper + dr * lower
        return value

    least = moved(0, 0) + offset
    circle = ((0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1))
    signs = [((between if down and right else moved)(down, right) >= least).view(np.uint8) for down, right in circle]
    changes = sum((one ^ before for one, before in zip(signs, signs[-1:] + signs[:-1], strict=True)), np.uint8(0))
    codes: Codes = np.where(changes <= 2, sum(signs, np.uint8(0)), np.uint8(PATTERNS - 1))
    return codes


@dataclass(frozen=True, slots=True, eq=False)
class TexturePicture:
    """Function of a frame to the joint bins of grey level and pattern, 10 b(I) + LBP, as an 8-bit picture.

    levels  quantiser of at most 25 grey levels;  offset  least excess of a neighbour, counts
    before  high-pass that comes first, or None
    """

    levels: Quantiser
    offset: float
    before: HighPass | FrequencyHighPass | None = None

    @property
    def joint(self) -> Quantiser:
        """Quantiser of the picture, with a bin for each of its values."""
        count = self.levels.bins * PATTERNS
        return Quantiser(0.0, float(count), count)

    def __call__(self, image: Image) -> Codes:
        picture = image if self.before is None else self.before(image)
        codes: Codes = (self.levels(picture) * PATTERNS + uniform_patterns(picture, self.offset)).astype(np.uint8)
        return codes

    def view(self, image: Image) -> Codes:
        """Return the whole picture, as for `HighPass.view`."""
        return self(image)
