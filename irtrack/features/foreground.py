"""How likely each pixel shows the target and not what is behind it, and where enough such pixels stand together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from irsim.types import Floats, Image
from irtrack.features.background import Grid, Hole, LaidFrame
from irtrack.features.quantise import MARGIN, levels_between

BINS = 32
"""Grey levels of the histograms: those of Cheng et al. 2006, section 3."""
ANYTHING = 0.05
"""Share of pixels that follow neither distribution, spread evenly over all greys: no pixel is ever sure."""


@dataclass(frozen=True, slots=True, eq=False)
class Greys:
    """Densities of greys, (bins,) per count over low .. high: of the target, and of what surrounded it at first."""

    low: float
    high: float
    target: Grid
    ring: Grid

    @classmethod
    def of(cls, image: Image, hole: Hole, kernel: Floats) -> Greys:
        """By a first frame: the target's part, weighted by a kernel (rows, columns) of the frame, and its ring."""
        rows, columns = hole
        picture = image.astype(np.float32)
        low, high = levels_between(picture, picture[hole])
        margin = max(MARGIN * (high - low), (BINS - high + low) / 2)  # a bin is a count at least
        around = np.zeros(picture.shape, np.float32)
        tall, wide = rows.stop - rows.start, columns.stop - columns.start
        around[max(rows.start - tall, 0) : rows.stop + tall, max(columns.start - wide, 0) : columns.stop + wide] = 1
        around[hole] = 0
        empty = np.zeros(BINS, np.float32)
        blank = cls(low - margin, high + margin, empty, empty)
        return replace(blank, target=blank._density(picture, kernel), ring=blank._density(picture, around))

    def foreground(self, laid: LaidFrame) -> Grid:
        """(rows, columns) probability that a pixel shows the target, the target and what is behind it equally likely.

        Where the backdrop was never seen, it may be any grey that surrounds it.
        """
        even = np.float32(ANYTHING / (self.high - self.low))
        squares = np.minimum((laid.picture - laid.mean) ** 2 / laid.variance, 60)
        behind = np.exp(-0.5 * squares) / np.sqrt(np.float32(2 * np.pi) * laid.variance)
        place = np.clip((laid.picture - self.low) * (BINS / (self.high - self.low)) - 0.5, 0, BINS - 1)
        cell = np.minimum(place.astype(np.intp), BINS - 2)
        part = (place - cell).astype(np.float32)
        target = (1 - part) * self.target[cell] + part * self.target[cell + 1]
        unknown = ~laid.known
        ring = (1 - part[unknown]) * self.ring[cell[unknown]] + part[unknown] * self.ring[cell[unknown] + 1]
        behind[unknown] = np.maximum(behind[unknown], ring)
        likely, unlikely = (1 - ANYTHING) * target + even, (1 - ANYTHING) * behind + even
        probability: Grid = (likely / (likely + unlikely)).astype(np.float32)
        return probability

    def learned(self, laid: LaidFrame, foreground: Grid, part: Hole, rate: float) -> Greys:
        """The target's greys after a frame, by those pixels of a part of it that are likely the target's."""
        density = self._density(laid.picture[part], foreground[part])
        if foreground[part].sum() < 3:
            return self
        return replace(self, target=self.target + np.float32(rate) * (density - self.target))

    def _density(self, picture: Grid, weights: Floats | Grid) -> Grid:
        """(bins,) per count, smoothed over neighbouring bins; even where there are no weights."""
        cells = np.clip((picture - self.low) * (BINS / (self.high - self.low)), 0, BINS - 1).astype(np.intp)
        counts = np.bincount(cells.ravel(), np.asarray(weights, np.float64).ravel(), BINS)
        counts = counts / counts.sum() if counts.sum() > 0 else np.full(BINS, 1 / BINS)
        smooth = cv2.GaussianBlur(counts[None].astype(np.float32), (0, 0), 1.0, borderType=cv2.BORDER_REFLECT)[0]
        density: Grid = smooth * np.float32(BINS / (self.high - self.low))
        return density


def gathered(foreground: Grid, deviations: tuple[float, float]) -> Grid:
    """Mean of what is more likely target than not, 2 p - 1, about each pixel; none beyond the frame.

    Weighted by a normal kernel of deviations (x, y) px.
    """
    x, y = deviations
    return cv2.GaussianBlur(  # type: ignore[return-value]  # OpenCV's stubs know no element types
        np.maximum(2 * foreground - 1, 0), (0, 0), sigmaX=x, sigmaY=y, borderType=cv2.BORDER_CONSTANT
    )


def peaks(heights: Grid, reach: tuple[int, int], least: float, most: int) -> tuple[Floats, Floats]:
    """Centres (n, 2) px and heights (n,) of the places that none within reach (x, y) px passes; the highest first.

    Between pixels by parabolas along each axis.
    """
    tops = cv2.dilate(heights, np.ones((2 * reach[1] + 1, 2 * reach[0] + 1), np.uint8))
    rows, columns = np.nonzero((heights == tops) & (heights > least))
    order = np.argsort(-heights[rows, columns], kind="stable")[:most]
    rows, columns = rows[order], columns[order]
    y, x = np.clip(rows, 1, heights.shape[0] - 2), np.clip(columns, 1, heights.shape[1] - 2)
    at = heights[y, x].astype(np.float64)
    centers = np.stack([columns, rows], axis=1).astype(np.float64)
    sides = (heights[y, x - 1], heights[y, x + 1]), (heights[y - 1, x], heights[y + 1, x])
    for axis, (before, after) in enumerate(sides):
        bend = np.minimum(before - 2 * at + after, -1e-9)
        centers[:, axis] += np.clip(0.5 * (before - after) / bend, -0.5, 0.5)
    return centers, heights[rows, columns].astype(np.float64)
