"""Foreground: pixels that differ from a `BackgroundModel` and have the target's grey levels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from irsim.types import Floats, Image
from irtrack.features.background import Grid, Region, RegisteredFrame
from irtrack.features.quantiser import MARGIN, levels_between

BINS = 32
"""Number of grey levels of the histogram, as in Cheng et al. 2006, section 3."""
UNEXPLAINED = 0.05
"""Share of a uniform density mixed into both densities, so that no probability is 0 or 1."""


@dataclass(frozen=True, slots=True, eq=False)
class GreyDensities:
    """Probability densities of grey levels, (bins,) per count over low .. high, of the target and its ring."""

    low: float
    high: float
    target: Grid
    ring: Grid

    @classmethod
    def of(cls, image: Image, region: Region, kernel: Floats) -> GreyDensities:
        """Return the densities in a first frame, with the target weighted by a kernel (rows, columns)."""
        rows, columns = region
        picture = image.astype(np.float32)
        low, high = levels_between(picture, picture[region])
        margin = max(MARGIN * (high - low), (BINS - high + low) / 2)  # a bin is at least one count wide
        around = np.zeros(picture.shape, np.float32)
        tall, wide = rows.stop - rows.start, columns.stop - columns.start
        around[max(rows.start - tall, 0) : rows.stop + tall, max(columns.start - wide, 0) : columns.stop + wide] = 1
        around[region] = 0
        empty = np.zeros(BINS, np.float32)
        blank = cls(low - margin, high + margin, empty, empty)
        return replace(blank, target=blank._density(picture, kernel), ring=blank._density(picture, around))

    def foreground(self, registered: RegisteredFrame) -> Grid:
        """Return the probability (rows, columns) that a pixel shows the target, with a prior of one half.

        Where the background has not been observed, its density is that of the ring in the first frame.
        """
        even = np.float32(UNEXPLAINED / (self.high - self.low))
        squares = np.minimum((registered.picture - registered.mean) ** 2 / registered.variance, 60)
        behind = np.exp(-0.5 * squares) / np.sqrt(np.float32(2 * np.pi) * registered.variance)
        place = np.clip((registered.picture - self.low) * (BINS / (self.high - self.low)) - 0.5, 0, BINS - 1)
        cell = np.minimum(place.astype(np.intp), BINS - 2)
        part = (place - cell).astype(np.float32)
        target = (1 - part) * self.target[cell] + part * self.target[cell + 1]
        unknown = ~registered.known
        ring = (1 - part[unknown]) * self.ring[cell[unknown]] + part[unknown] * self.ring[cell[unknown] + 1]
        behind[unknown] = np.maximum(behind[unknown], ring)
        likely, unlikely = (1 - UNEXPLAINED) * target + even, (1 - UNEXPLAINED) * behind + even
        probability: Grid = (likely / (likely + unlikely)).astype(np.float32)
        return probability

    def updated(self, registered: RegisteredFrame, foreground: Grid, region: Region, rate: float) -> GreyDensities:
        """Return the densities after a frame; that of the target is learned from the foreground in its region."""
        density = self._density(registered.picture[region], foreground[region])
        if foreground[region].sum() < 3:
            return self
        return replace(self, target=self.target + np.float32(rate) * (density - self.target))

    def _density(self, picture: Grid, weights: Floats | Grid) -> Grid:
        """Return the density, (bins,) per count, smoothed over neighbouring bins; uniform where all weights are 0."""
        cells = np.clip((picture - self.low) * (BINS / (self.high - self.low)), 0, BINS - 1).astype(np.intp)
        counts = np.bincount(cells.ravel(), np.asarray(weights, np.float64).ravel(), BINS)
        counts = counts / counts.sum() if counts.sum() > 0 else np.full(BINS, 1 / BINS)
        smooth = cv2.GaussianBlur(counts[None].astype(np.float32), (0, 0), 1.0, borderType=cv2.BORDER_REFLECT)[0]
        density: Grid = smooth * np.float32(BINS / (self.high - self.low))
        return density


def local_foreground(foreground: Grid, deviations: tuple[float, float]) -> Grid:
    """Return the local mean of max(2 p - 1, 0) about each pixel, p the foreground probability; p is 0 beyond the frame.

    The mean is weighted by a normal kernel with standard deviations (x, y) px.
    """
    x, y = deviations
    return cv2.GaussianBlur(  # type: ignore[return-value]  # OpenCV's stubs know no element types
        np.maximum(2 * foreground - 1, 0), (0, 0), sigmaX=x, sigmaY=y, borderType=cv2.BORDER_CONSTANT
    )


def peaks(heights: Grid, reach: tuple[int, int], least: float, most: int) -> tuple[Floats, Floats]:
    """Return centres (n, 2) px and heights (n,) of pixels that are the maximum within `reach` (x, y) px, highest first.

    Centres are refined to a fraction of a pixel by parabolas along each axis.
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
