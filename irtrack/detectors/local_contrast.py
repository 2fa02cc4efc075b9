"""Detectors by the contrast of a patch with its eight neighbours: `lcm`, `mpcm`."""

from __future__ import annotations

from typing import Annotated, ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.config.base import Several
from irsim.types import Floats
from irtrack._native import COMPILED, kernels
from irtrack.detectors.base import Score, Side, SingleFrameDetector
from irtrack.detectors.peaks import THINNED, WHOLE, Picture, Places, robust_scale, squares, vertices

Sides = Annotated[Several[Side], Field(min_length=1, max_length=8)]
"""Sides of the patches of each scale, px."""


class LCM(SingleFrameDetector):
    """Local contrast measure L^2 / max m_i, the largest over scales.

    C. Chen, H. Li, Y. Wei, T. Xia, Y. Tang, "A local contrast method for small infrared target detection", IEEE TGRS
    52(1), 2014, eq. 4 and algorithm 2: L is the largest pixel of the middle patch, m_i the means of its eight
    neighbours. Computed at every pixel, as in the paper; the centre is that of the brightest pixel of the patch, since
    the measure is flat around it. Means below one count are taken as one count. Cold targets are sought in the picture
    mirrored about the middle of its range.
    """

    source: ClassVar[str] = "Chen, Li, Wei, Xia, Tang 2014"
    is_linear: ClassVar[bool] = False

    threshold: Score = 8.0
    """Least score z of a detection, robust standard deviations of the response."""
    sides: Sides = (3, 5, 7)
    """Sides of the patches of each scale, px, odd (the paper: 3, 5, 7, 9)."""

    @property
    def reach(self) -> int:
        return max(self.sides)

    def negative(self, picture: Picture) -> Picture:
        turned: Picture = picture.max() + picture.min() - picture
        return turned

    def response(self, picture: Picture) -> Picture:
        largest = np.zeros_like(picture)
        for side in self.sides:
            peak = cv2.dilate(picture, np.ones((side, side), np.uint8))
            add_local_contrast(wide_mean(picture, side), side, largest, peak)  # type: ignore[arg-type]  # OpenCV's stubs know no element types
        return largest

    def located(
        self, response: Picture, picture: Picture, rows: Places, columns: Places
    ) -> tuple[Places, Places, Floats]:
        half = max(self.sides) // 2
        highest = squares(picture, rows, columns, half).reshape(len(rows), -1).argmax(axis=1)
        down, across = np.divmod(highest, 2 * half + 1)
        rows = np.clip(rows + down - half, 0, picture.shape[0] - 1)
        columns = np.clip(columns + across - half, 0, picture.shape[1] - 1)
        return rows, columns, vertices(picture, rows, columns)


class MPCM(SingleFrameDetector):
    """Multiscale patch-based contrast, the least product of differences to opposite neighbours.

    Y. Wei, X. You, H. Li, "Multiscale patch-based contrast measure for small infrared target detection", Pattern
    Recognition 58, 2016, eq. 3 to 6: d_i = mean of the middle patch - mean of neighbour i; min over i = 1..4 of
    d_i d_(i+4), the largest over scales. The measure is set to 0 where a difference is negative, as two negative
    differences have a positive product. The response is its square root, in counts. z is the response over the robust
    deviation of the smallest patch's mean from the means on its left and right, since most values of the measure are 0
    and have no deviation.
    """

    source: ClassVar[str] = "Wei, You, Li 2016"
    is_linear: ClassVar[bool] = False

    threshold: Score = 4.5
    """Least score z of a detection; lower than for other detectors, since z is the least of eight differences."""
    sides: Sides = (3, 5, 7)
    """Sides of the patches of each scale, px, odd (the paper: 3, 5, 7, 9)."""

    @property
    def smoothing(self) -> float:
        """Standard deviation of a uniform square as large as the smallest patch, px."""
        return min(self.sides) / 12**0.5

    @property
    def reach(self) -> int:
        return max(self.sides)

    def response(self, picture: Picture) -> Picture:
        least = min(self.sides)
        largest = np.zeros_like(picture)
        for side in self.sides:
            mean = wide_mean(picture, side)
            add_patch_contrast(mean, side, largest)
            if side == least:
                left, middle, right = (mean[least:-least, k * least : k * least + picture.shape[1]] for k in range(3))
                some = (slice(None, None, THINNED),) * 2 if picture.size > WHOLE else (slice(None),) * 2
                difference: Picture = middle[some] - np.float32(0.5) * (left[some] + right[some])
                _, deviation = robust_scale(difference)
        response: Picture = np.sqrt(largest, out=largest)
        response *= np.float32(1 / deviation)
        return response

    def scale(self, response: Picture) -> tuple[float, float]:
        return 0.0, 1.0


def wide_mean(picture: Picture, side: int) -> Picture:
    """Return the mean of the patch at each pixel, (rows + 2 side, cols + 2 side), mirrored beyond the edges."""
    mean = cv2.blur(picture, (side, side), borderType=cv2.BORDER_REFLECT_101)
    return cv2.copyMakeBorder(mean, side, side, side, side, cv2.BORDER_REFLECT_101)  # type: ignore[return-value]  # OpenCV's stubs know no element types


def add_patch_contrast(mean: Picture, side: int, largest: Picture) -> None:
    """Update the maximum `largest` (rows, cols) by min_i d_i d_(i+4), counts^2, or 0 where a neighbour is brighter."""
    if COMPILED:
        kernels.patch_contrast(mean, side, largest)
        return
    middle, *around = _patches(mean, side)
    differences = [middle - neighbour for neighbour in around]
    least = np.minimum.reduce([differences[i] * differences[i + 4] for i in range(4)])
    hot = np.minimum.reduce(differences[:4]) > 0  # the product of two negative differences is positive, too
    np.maximum(largest, np.where(hot, least, np.float32(0)), out=largest)


def add_local_contrast(mean: Picture, side: int, largest: Picture, peak: Picture) -> None:
    """Update the maximum `largest` (rows, cols) by peak^2 / max m_i, counts, with max m_i at least 1 count."""
    if COMPILED:
        kernels.local_contrast(mean, side, largest, peak)
        return
    _, *around = _patches(mean, side)
    np.maximum(largest, peak * peak / np.maximum(np.maximum.reduce(around), 1), out=largest)


def _patches(mean: Picture, side: int) -> list[Picture]:
    """Return the means (rows, cols) of the middle patches and of their eight neighbours, i and i + 4 opposite."""
    rows, columns = mean.shape[0] - 2 * side, mean.shape[1] - 2 * side
    half = ((0, 1), (1, 1), (1, 0), (1, -1))
    places = [(0, 0), *half, *((-down, -right) for down, right in half)]
    corners = [(side * (1 + down), side * (1 + right)) for down, right in places]
    return [mean[top : top + rows, left : left + columns] for top, left in corners]
