"""Background model that is compared with a frame in a window only, for trackers that search near a prediction.

The statistics are those of `irtrack.features.background`. Registration works on pictures reduced to a third; the window
is learned in every frame, the rest of the picture in bands, one band a frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil

import cv2
import numpy as np

from irsim.types import Image
from irtrack.features.background import OUTLIER, SHIFT, BackgroundModel, Grid, Region, RegisteredFrame, shifted
from irtrack.features.background import squared_slope as slope2

REDUCTION = 3
"""Largest factor by which pictures are reduced for registration, as in `irtrack.detectors.frame_difference`."""
LEAST_PIXELS = 5000
"""Least number of pixels of a reduced picture. In noise alone, a fit of four parameters lowers the deviation of n
independent samples by 4 / n: for 5,000 smoothed pixels by 1 %, which `BETTER` does not accept. Smaller pictures are not
registered."""
BANDS = 12
"""Number of bands of rows of the picture, of which one is learned in each frame."""
BORDER = 2
"""Margin of a window that cubic interpolation needs, px."""


@dataclass(frozen=True, slots=True, eq=False)
class WindowedBackground:
    """Background model of whole frames, and the number of frames that it has learned."""

    model: BackgroundModel
    count: int = 0

    def register(self, image: Image, align: bool) -> tuple[WindowedBackground, tuple[float, float]]:
        """Return the model moved to a frame (rows, cols), counts, and the scene's shift (dx, dy) since the last frame,
        px; the model as it is if `align` is false."""
        reduction = next((each for each in range(REDUCTION, 0, -1) if image.size >= each**2 * LEAST_PIXELS), 0)
        if not align or reduction == 0:
            return self, (0.0, 0.0)
        before = self.model
        x, y = before.shift
        small = _reduced(before.mean, reduction)
        ones = np.ones_like(small)
        at = (x / reduction, y / reduction)
        coarse = replace(before, mean=small, variance=ones, observations=ones, shift=at)
        fitted = coarse.aligned(_reduced(image.astype(np.float32), reduction))
        shift = (reduction * fitted.shift[0], reduction * fitted.shift[1])
        after = replace(before, shift=shift, gain=fitted.gain, offset=fitted.offset)
        whole = (round(shift[0]), round(shift[1]))
        if any(whole):
            picture = (image.astype(np.float32) - np.float32(after.offset)) / np.float32(after.gain)
            after = after.rolled(whole, picture)
        return replace(self, model=after), (shift[0] - x, shift[1] - y)

    def compare(self, image: Image, region: Region) -> RegisteredFrame:
        """Return a region of a frame and the model there, after `register`."""
        model = self.model
        picture = (image[region].astype(np.float32) - np.float32(model.offset)) / np.float32(model.gain)
        wide, inner = _widened(region, image.shape)
        mean = shifted(model.mean[wide], model.shift)[inner]
        variance = model.variance[region] + np.float32(SHIFT**2) * slope2(mean)
        return RegisteredFrame(picture, mean, variance, model.observations[region] >= 1, model.shift, (0.0, 0.0))

    def learned(
        self,
        image: Image,
        region: Region,
        registered: RegisteredFrame,
        foreground: Grid,
        rate: float,
        target: Region | None,
    ) -> WindowedBackground:
        """Return the model after it learned a region of a frame, and one band of the picture.

        registered, foreground   of the region: `compare`, and the probability of the target's pixels
        rate                     share of the frame that enters the model
        target                   region that is not learned; None: all are
        """
        model, rows = self.model, image.shape[0]
        parts = [(region, registered, foreground)]
        height = ceil(rows / BANDS)
        top = self.count % BANDS * height
        band = (slice(min(top, rows), min(top + height, rows)), slice(0, image.shape[1]))
        if top < rows:
            other = self.compare(image, band)
            moving = (other.picture - other.mean) ** 2 > OUTLIER * other.variance
            parts.insert(0, (band, other, moving.astype(np.float32)))
        mean, variance, observations = model.mean.copy(), model.variance.copy(), model.observations.copy()
        for place, seen, moving_share in parts:
            part = replace(
                model, mean=model.mean[place], variance=model.variance[place], observations=model.observations[place]
            )
            inside = None if target is None else _within(target, place)
            share = rate if place is region else min(rate * BANDS / 3, 1.0)
            part = part.updated(seen, moving_share, share, inside)
            mean[place], variance[place], observations[place] = part.mean, part.variance, part.observations
        after = replace(model, mean=mean, variance=variance, observations=observations)
        return WindowedBackground(after, self.count + 1)


def _reduced(picture: Grid, reduction: int) -> Grid:
    if reduction == 1:
        return picture
    size = picture.shape[1] // reduction, picture.shape[0] // reduction
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)  # type: ignore[return-value]  # OpenCV's stubs know no element types


def _widened(region: Region, shape: tuple[int, ...]) -> tuple[Region, Region]:
    """Return the region with a border, cut at the frame's edges, and the position of the region in it."""
    wide, inner = [], []
    for span, length in zip(region, shape, strict=True):
        first = max(span.start - BORDER, 0)
        wide.append(slice(first, min(span.stop + BORDER, length)))
        inner.append(slice(span.start - first, span.stop - first))
    return (wide[0], wide[1]), (inner[0], inner[1])


def _within(region: Region, place: Region) -> Region:
    """Return the intersection of a region and the region `place`, in coordinates of `place`; empty where they do not
    meet."""
    rows, columns = (
        slice(max(span.start - at.start, 0), max(min(span.stop, at.stop) - at.start, 0))
        for span, at in zip(region, place, strict=True)
    )
    return rows, columns
