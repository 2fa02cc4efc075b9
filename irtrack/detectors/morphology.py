"""Detectors by order statistics of a pixel's neighbourhood: `threshold`, `tophat`, `max_mean`, `max_median`."""

from __future__ import annotations

from typing import ClassVar

import cv2
import numpy as np
from pydantic import Field

from irsim.types import Counts
from irtrack._native import COMPILED, kernels
from irtrack.detectors.base import Score, SingleFrameDetector
from irtrack.detectors.peaks import Picture

DIRECTIONS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""(down, right) px of the four lines through a pixel: row, column and both diagonals."""

STRIP = 25_000
"""Number of pixels of a strip of rows filtered at once: it fits the processor's cache, so that filtering takes a
quarter of the time."""


class Threshold(SingleFrameDetector):
    """Threshold on the frame itself, unfiltered: pixels a number of robust standard deviations above its median.

    The likelihood-ratio test of a known level in white normal noise (S. Kay, "Detection Theory", 1998, example 3.2);
    the deviation is Hampel's. A baseline: any gradient of the background is clutter to this detector.
    """

    source: ClassVar[str] = "Kay 1998, example 3.2"

    def response(self, picture: Picture) -> Picture:
        return picture


class TopHat(SingleFrameDetector):
    """White top-hat: the frame less its opening by a square, in which smaller hot targets vanish.

    V. Tom, T. Peli, M. Leung, J. Bondaryk, "Morphology-based algorithm for point target detection in infrared
    backgrounds", Proc. SPIE 1954, 1993, section 2: f - (f eroded, then dilated). Pixels outside the frame are left
    out of minima and maxima.
    """

    source: ClassVar[str] = "Tom, Peli, Leung, Bondaryk 1993"
    is_linear: ClassVar[bool] = False

    threshold: Score = 6.0
    """Least score z of a detection, robust standard deviations of the response."""
    radius: int = Field(default=3, ge=1, le=50)
    """Half side of the square, px; targets of 2 radius + 1 px and more on both axes are background."""

    @property
    def reach(self) -> int:
        return self.radius + 1

    def response(self, picture: Picture) -> Picture:
        square = np.ones((2 * self.radius + 1,) * 2, np.uint8)
        return cv2.morphologyEx(picture, cv2.MORPH_TOPHAT, square)  # type: ignore[return-value]  # OpenCV's stubs know no element types


class MaxMean(SingleFrameDetector):
    """The frame less the largest of the means along four lines through each pixel.

    S. Deshpande, M. Er, R. Venkateswarlu, P. Chan, "Max-mean and max-median filters for detection of small targets",
    Proc. SPIE 3809, 1999, section 2: a line has 2 radius + 1 pixels, its middle one among them. Edges of clouds lie
    along a line and are predicted; a small target is not.
    """

    source: ClassVar[str] = "Deshpande, Er, Venkateswarlu, Chan 1999"
    is_linear: ClassVar[bool] = False

    radius: int = Field(default=3, ge=1, le=10)
    """Pixels of a line on each side of its middle."""

    @property
    def reach(self) -> int:
        return self.radius + 1

    def response(self, picture: Picture) -> Picture:
        side = 2 * self.radius + 1
        diagonal = np.eye(side, dtype=np.float32) / side
        largest = cv2.blur(picture, (side, 1), borderType=cv2.BORDER_REFLECT_101)
        for mean in (
            cv2.blur(picture, (1, side), borderType=cv2.BORDER_REFLECT_101),
            cv2.filter2D(picture, cv2.CV_32F, diagonal),
            cv2.filter2D(picture, cv2.CV_32F, np.ascontiguousarray(diagonal[::-1])),
        ):
            largest = cv2.max(largest, mean, largest)
        return np.subtract(picture, largest, dtype=np.float32)


class MaxMedian(SingleFrameDetector):
    """The frame less the largest of the medians along four lines through each pixel.

    Deshpande et al. 1999, as `max_mean` with medians; the median keeps edges and bends of clouds in the background.
    """

    source: ClassVar[str] = "Deshpande, Er, Venkateswarlu, Chan 1999"
    is_linear: ClassVar[bool] = False

    threshold: Score = 6.0
    """Least score z of a detection, robust standard deviations of the response."""
    radius: int = Field(default=3, ge=1, le=5)
    """Pixels of a line on each side of its middle; a target of more than `radius` px along a line is background."""

    @property
    def reach(self) -> int:
        return self.radius + 1

    def response(self, picture: Picture) -> Picture:
        levels = (picture - picture.min()).astype(np.uint16)  # 16 bits hold whole counts and take half the time of 32
        reach, (rows, columns) = self.radius, picture.shape
        wide = cv2.copyMakeBorder(levels, reach, reach, reach, reach, cv2.BORDER_REFLECT_101)
        background = np.empty_like(levels)
        if COMPILED:
            kernels.line_medians(wide, reach, background)
            return np.asarray(np.subtract(levels, background, dtype=np.float32))
        strip = max(STRIP // columns, 1)
        for top in range(0, rows, strip):
            of_strip = wide[top : top + min(strip, rows - top) + 2 * reach]
            background[top : top + strip] = self._background(of_strip, columns)
        residual: Picture = np.subtract(levels, background, dtype=np.float32)
        return residual

    def _background(self, wide: Counts, columns: int) -> Counts:
        """Return the largest of the four medians at each pixel of a strip with a rim of `radius` px."""
        reach, rows = self.radius, wide.shape[0] - 2 * self.radius
        largest = np.zeros((rows, columns), np.uint16)
        for down, right in DIRECTIONS:
            corners = [(reach + k * down, reach + k * right) for k in range(-reach, reach + 1)]
            line = [wide[top : top + rows, left : left + columns] for top, left in corners]
            np.maximum(largest, _median(line), out=largest)
        return largest


def _median(line: list[Counts]) -> Counts:
    """Return the median of an odd number of pictures, pixel by pixel, by forgetful selection.

    A. Paeth, "Median finding on a 3x3 grid", Graphics Gems, 1990: among a little more than half of the values, the
    least and the greatest cannot be the median, so a further value replaces them.
    """
    start = len(line) // 2 + 2
    held = _without_ends(line[:start])
    for value in line[start:]:
        held = _without_ends([*held, value])
    return held[0]


def _without_ends(values: list[Counts]) -> list[Counts]:
    """Return the values, sorted partly, without the least and the greatest."""
    least, rest = values[0], []
    for value in values[1:]:
        rest.append(np.maximum(least, value))
        least = np.minimum(least, value)
    greatest, inner = rest[0], []
    for value in rest[1:]:
        inner.append(np.minimum(greatest, value))
        greatest = np.maximum(greatest, value)
    return inner
