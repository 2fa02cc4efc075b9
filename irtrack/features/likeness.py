"""Likeness of places in a picture to a target: correlation with its first and its slowly learned patch.

s = max over both patches of r exp(-ln^2(a) / 2 s_a^2), r Lewis's coefficient (`irtrack.features.correlation`), a the
amplitude of the patch in the picture, r sd(window) / sd(patch): a place must have the target's contrast, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from irtrack.features.background import Grid, Region

AMPLITUDE_SD = 0.7
"""Standard deviation of the logarithm of a target's contrast about that of its patch: a factor of two."""
LEAST = 0.02
"""Least likeness, so that its logarithm is finite."""
LEAST_CONTRAST = 0.3
"""Least standard deviation of a patch, counts: that of rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Likeness:
    """First and learned patch (rows, columns), counts, odd sides; `reach`: half their sides (x, y), px."""

    first: Grid
    recent: Grid

    @classmethod
    def of(cls, picture: Grid, center: tuple[float, float], reach: tuple[int, int]) -> Likeness:
        """Return the likeness to the patch about a centre, interpolated."""
        patch = cut(picture, center, reach)
        return cls(patch, patch)

    @property
    def reach(self) -> tuple[int, int]:
        return self.first.shape[1] // 2, self.first.shape[0] // 2

    def map(self, picture: Grid, region: Region) -> Grid:
        """Return s (rows, columns) of a region of a picture; beyond its edges the picture is mirrored."""
        x, y = self.reach
        padded = _padded(picture, region, (x, y))
        side = self.first.shape[::-1]
        best: Grid | None = None
        deviation: Grid | None = None
        for patch in (self.first,) if self.recent is self.first else (self.first, self.recent):
            contrast = max(float(patch.std()), LEAST_CONTRAST)
            r = cv2.matchTemplate(padded, patch, cv2.TM_CCOEFF_NORMED)
            if deviation is None:
                deviation = _deviation(padded, side, (x, y))
            # The coefficient of a window without structure is undefined.
            r = np.where(deviation > LEAST_CONTRAST / 2, np.clip(r, LEAST, 1.0), np.float32(LEAST))
            s = r * np.exp(np.log(r * deviation / contrast + 1e-6) ** 2 * np.float32(-0.5 / AMPLITUDE_SD**2))
            best = s if best is None else np.maximum(best, s)
        assert best is not None
        found: Grid = np.maximum(best, np.float32(LEAST))
        return found

    def learned(self, picture: Grid, center: tuple[float, float], rate: float) -> Likeness:
        """Return the likeness after a share `rate` of the patch about a centre entered the learned patch."""
        new = cut(picture, center, self.reach)
        return replace(self, recent=self.recent + np.float32(rate) * (new - self.recent))


def cut(picture: Grid, center: tuple[float, float], reach: tuple[int, int]) -> Grid:
    """Return the patch (2 y + 1, 2 x + 1) of half sides (x, y) px about a centre, bilinear; edge pixels are
    repeated."""
    size = (2 * reach[0] + 1, 2 * reach[1] + 1)
    return cv2.getRectSubPix(picture, size, center)  # type: ignore[return-value]  # OpenCV's stubs know no element types


def _padded(picture: Grid, region: Region, reach: tuple[int, int]) -> Grid:
    """Return a region with `reach` (x, y) px more on each side, less its mean, beside which float32 sums would lose the
    contrast."""
    spans, borders = [], []
    for span, length, more in zip(region, picture.shape, reach[::-1], strict=True):
        low, high = span.start - more, span.stop + more
        spans.append(slice(max(low, 0), min(high, length)))
        borders += [max(-low, 0), max(high - length, 0)]
    part: Grid = picture[spans[0], spans[1]]
    part = part - part.mean()
    if any(borders):
        top, bottom, left, right = borders
        part = cv2.copyMakeBorder(part, top, bottom, left, right, cv2.BORDER_REFLECT)  # type: ignore[assignment]  # OpenCV's stubs know no element types
    return part


def _deviation(padded: Grid, side: tuple[int, ...], reach: tuple[int, int]) -> Grid:
    mean = cv2.boxFilter(padded, cv2.CV_32F, side)
    square = cv2.sqrBoxFilter(padded, cv2.CV_32F, side)
    x, y = reach
    inner = (slice(y, padded.shape[0] - y), slice(x, padded.shape[1] - x))
    found: Grid = np.sqrt(np.maximum(square - mean * mean, 1e-6))[inner]
    return found
