"""Normalised cross-correlation of a template with a search region, and its peak.

r = sum (I - mean I)(T - mean T) / sqrt(sum (I - mean I)^2 sum (T - mean T)^2)
                    (Lewis, "Fast Normalized Cross-Correlation", Vision Interface 1995, eq. 2)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from irsim.types import Floats, Image
from irtrack.features.window import Reach, Window, region


def ncc(region: Image | Floats, template: Floats) -> Floats:
    """Return the coefficient r, -1 .. 1, at every position of the template (h, w) within the region (H, W).

    The result is (H-h+1, W-w+1); element [0, 0] has the template at the top-left corner of the region. Where the window
    or the template is constant, r is undefined and given as 0.
    """
    if float(np.ptp(template)) == 0.0:
        return np.zeros((region.shape[0] - template.shape[0] + 1, region.shape[1] - template.shape[1] + 1))
    # The mean level is subtracted first: float32 sums of 16-bit counts would otherwise lose the contrast.
    level = float(template.mean())
    scores = cv2.matchTemplate(
        (region - level).astype(np.float32), (template - level).astype(np.float32), cv2.TM_CCOEFF_NORMED
    )
    return np.clip(np.nan_to_num(scores, nan=0.0, posinf=0.0, neginf=0.0), -1.0, 1.0)


def peak(scores: Floats, default: tuple[float, float] | None = None) -> tuple[tuple[float, float], float]:
    """Return the position (x, y) of the highest score, refined to a fraction of a pixel, and this score.

    default   position to return where all scores are equal, as for a template without structure

    Each axis is refined by the parabola through the peak and its neighbours; a peak on the edge is not refined.
    """
    if default is not None and float(np.ptp(scores)) == 0.0:
        return default, float(scores.flat[0])
    row, column = np.unravel_index(int(np.argmax(scores)), scores.shape)
    y, x = int(row), int(column)
    top = float(scores[y, x])
    dx = _vertex(float(scores[y, x - 1]), top, float(scores[y, x + 1])) if 0 < x < scores.shape[1] - 1 else 0.0
    dy = _vertex(float(scores[y - 1, x]), top, float(scores[y + 1, x])) if 0 < y < scores.shape[0] - 1 else 0.0
    return (x + dx, y + dy), top


def best_distractor(scores: Floats, corner: tuple[int, int], window: Window) -> float:
    """Return the score of the best false match: the highest of the windows that do not overlap the one at `corner`.

    The score is 0 where no such window fits, or none scores above 0.
    """
    apart = np.ones(scores.shape, bool)
    x, y = corner
    apart[max(y - window.rows + 1, 0) : y + window.rows, max(x - window.columns + 1, 0) : x + window.columns] = False
    return max(float(scores[apart].max(initial=0.0)), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """Target in a first frame: window, pixels (rows, columns) in counts, and the best distractor's score."""

    window: Window
    pixels: Floats
    distractor: float

    @classmethod
    def of(cls, image: Image, window: Window, corner: tuple[int, int], reach: Reach) -> Patch:
        """Return the patch of a window at `corner`; distractors are searched within `reach`."""
        pixels = window.cut(image, corner).astype(np.float64)
        left, top, around = region(image, window, corner, reach)
        distractor = best_distractor(ncc(around, pixels), (corner[0] - left, corner[1] - top), window)
        return cls(window, pixels, distractor)

    def search(self, image: Image, center: tuple[float, float], reach: Reach) -> tuple[tuple[float, float], float]:
        """Return the centre of the best match within `reach` of a centre, px, and its score."""
        corner = self.window.corner(center)
        left, top, around = region(image, self.window, corner, reach)
        (x, y), score = peak(ncc(around, self.pixels), (corner[0] - left, corner[1] - top))
        return self.window.center((left + x, top + y)), score

    def blended(self, image: Image, center: tuple[float, float], rate: float) -> Patch:
        """Return the patch blended with the share `rate` of the window at a centre, px, inside the image."""
        corner = self.window.corner(center)
        x = min(max(corner[0], 0), image.shape[1] - self.window.columns)
        y = min(max(corner[1], 0), image.shape[0] - self.window.rows)
        return replace(self, pixels=(1 - rate) * self.pixels + rate * self.window.cut(image, (x, y)))


def _vertex(before: float, top: float, after: float) -> float:
    """Return the position of the maximum of the parabola through (-1, before), (0, top), (1, after)."""
    curvature = before - 2 * top + after
    return 0.5 * (before - after) / curvature if curvature < 0 else 0.0
