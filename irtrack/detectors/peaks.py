"""Maxima of a response: robust scale, places, centres and sizes, and the background around them.

Frames are mirrored at their edges. The Python equivalents of the C kernels are here.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import MEDIAN_TO_SIGMA, Floats
from irtrack._native import COMPILED, kernels

Picture = npt.NDArray[np.float32]
Places = npt.NDArray[np.intp]

MEAN_TO_SIGMA = 1.2533
"""Standard deviation of a normal distribution over its mean absolute deviation, sqrt(pi / 2)."""
LEAST_DEVIATION = 0.05
"""Least deviation of a response, counts: that of rounding, .29, after smoothing over a point's image."""
THINNED = 4
"""Step of the rows and columns sampled for median and deviation: 4800 of 320x240 px give both to 2 %."""
WHOLE = 16_384
"""Largest number of pixels of a frame that is not subsampled."""
MANY = 2
"""Number of comparisons per pixel of the frame below which comparing the square of each pixel above the threshold is
faster than a maximum filter of the whole frame."""
CLOSING = 8
"""Largest number of comparisons per pixel of the frame at which a closing is computed around its places alone."""
TIED = 2
"""Mark of a pixel, in the result of `highest`, that is as high as another pixel of its square."""
ROUNDING = 0.2887
"""Standard deviation of rounding to whole counts, counts."""
FWHM = 2.3548
"""Full width at half maximum of a normal curve over its standard deviation, sqrt(8 ln 2)."""


def thinned(values: Picture) -> Picture:
    """Return a sample of a frame's pixels, (n,)."""
    return (values if values.size <= WHOLE else values[::THINNED, ::THINNED]).ravel()


def median(values: Picture) -> float:
    """Return the median of values (n,), the upper one of an even number, in a third of the time of `numpy.median`."""
    least = values.min()
    if 2 * np.count_nonzero(values == least) > len(values):  # numpy's selection is slow where many are equal
        return float(least)
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def robust_scale(response: Picture) -> tuple[float, float]:
    """Return median and robust standard deviation of a response.

    The deviation comes from the median distance from the median (Hampel 1974), or the mean distance where that is 0.
    """
    some = thinned(response)
    middle = median(some)
    distances = np.abs(some - np.float32(middle))
    deviation = MEDIAN_TO_SIGMA * median(distances) or MEAN_TO_SIGMA * float(distances.mean())
    return middle, max(deviation, LEAST_DEVIATION)


def maxima(heights: Picture, separation: int, least: float, most: int) -> tuple[Places, Places]:
    """Return rows (n,) and columns (n,) of the highest maxima above `least`, the highest first.

    A maximum is the highest pixel within `separation` px; of touching ones, as in a saturated target, the middle one.
    """
    above = np.flatnonzero(heights > least)
    side, columns = 2 * separation + 1, heights.shape[1]
    if len(above) * side**2 > MANY * heights.size:
        largest = cv2.dilate(heights, np.ones((side, side), np.uint8))
        above = above[heights.ravel()[above] == largest.ravel()[above]]
    ranks = highest(heights, above, separation)
    above = above[ranks > 0]
    values = heights.ravel()[above]
    if (ranks == TIED).any() and (np.diff(np.sort(values)) == 0).any():
        above = merged(heights, above, separation)
        values = heights.ravel()[above]
    above = above[np.argsort(-values, kind="stable")[:most]]
    return above // columns, above % columns


def highest(heights: Picture, places: Places, reach: int) -> npt.NDArray[np.uint8]:
    """Return 0 for each place (n,) where a pixel of the square of `reach` px on all sides is higher, else 1.

    `TIED` where another pixel is as high, which is always so at the frame's edge, where pixels are repeated.
    """
    ranks = np.empty(len(places), np.uint8)
    if COMPILED:
        kernels.highest(heights, places, reach, ranks)
        return ranks
    rows, columns = np.divmod(places, heights.shape[1])
    around, own = squares(heights, rows, columns, reach), heights.ravel()[places, None, None]
    ranks[:] = (around <= own).all(axis=(1, 2)) * np.where((around == own).sum(axis=(1, 2)) > 1, TIED, 1)
    return ranks


def squares(picture: Picture, rows: Places, columns: Places, reach: int) -> Picture:
    """Return the squares (n, 2 reach + 1, 2 reach + 1) of pixels around places; edge pixels are repeated."""
    steps = np.arange(-reach, reach + 1)
    down = np.clip(rows[:, None] + steps, 0, picture.shape[0] - 1)
    across = np.clip(columns[:, None] + steps, 0, picture.shape[1] - 1)
    found: Picture = picture.ravel()[down[:, :, None] * picture.shape[1] + across[:, None, :]]
    return found


def merged(heights: Picture, places: Places, separation: int) -> Places:
    """Return the place nearest to the middle of each group of places (n,), in ascending order; the first of equally
    near ones.

    Places belong to one group where their morphological closing by the square of `separation` px on all sides connects
    them.
    """
    side, shape = 2 * separation + 1, heights.shape
    if COMPILED and len(places) * side**4 < CLOSING * heights.size:
        found = np.empty(len(places), np.bool_)
        kernels.merge_places(heights, places, separation, found.view(np.uint8))
        return places[found]
    mask = np.zeros(shape, np.uint8)
    mask.ravel()[places] = 1
    joined = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((side, side), np.uint8))
    groups = cv2.connectedComponents(joined, connectivity=8)[1].ravel()[places]
    rows, columns = np.divmod(places, shape[1])
    count = np.bincount(groups)
    middles = [np.bincount(groups, weights=axis)[groups] / count[groups] for axis in (rows, columns)]
    distances = (rows - middles[0]) ** 2 + (columns - middles[1]) ** 2
    order = np.lexsort((places, distances, groups))
    first = np.r_[True, np.diff(groups[order]) > 0]
    return np.sort(places[order][first])


def vertices(heights: Picture, rows: Places, columns: Places) -> Floats:
    """Return the centres (n, 2) px of maxima, by a parabola along each axis, not refined across an edge."""
    if COMPILED:
        centers = np.empty((len(rows), 2))
        kernels.vertices(heights, rows * heights.shape[1] + columns, centers)
        return centers
    at = heights[rows, columns].astype(np.float64)
    centers = np.stack([columns, rows], axis=1).astype(np.float64)
    last = heights.shape[0] - 1, heights.shape[1] - 1
    left, right = heights[rows, np.maximum(columns - 1, 0)], heights[rows, np.minimum(columns + 1, last[1])]
    up, down = heights[np.maximum(rows - 1, 0), columns], heights[np.minimum(rows + 1, last[0]), columns]
    for axis, (before, after, inner) in enumerate(
        ((left, right, (columns > 0) & (columns < last[1])), (up, down, (rows > 0) & (rows < last[0])))
    ):
        bend = np.minimum(before - 2 * at + after, -1e-9)
        centers[:, axis] += inner * np.clip(0.5 * (before.astype(np.float64) - after) / bend, -0.5, 0.5)
    return centers


def measured(picture: Picture, rows: Places, columns: Places, reach: int) -> tuple[Floats, Floats]:
    """Return sizes (n, 2) px and SCR (n,) of hot targets at pixels of a picture.

    The size is the full width at half maximum along row and column, at least 1 px, above the median on the edge of the
    square of `reach` px on all sides. SCR is the peak's height over the standard deviation on that edge.
    """
    if COMPILED:
        edge, sizes = np.empty((len(rows), 8 * reach), np.float32), np.empty((len(rows), 2))
        height = np.empty(len(rows))
        kernels.peak_sizes(picture, rows * picture.shape[1] + columns, reach, edge, sizes, height)
        return sizes, height / np.maximum(edge.std(axis=1), ROUNDING)
    around = squares(picture, rows, columns, reach)
    edge = np.concatenate([around[:, 0], around[:, -1], around[:, 1:-1, 0], around[:, 1:-1, -1]], axis=1)
    level = np.partition(edge, edge.shape[1] // 2, axis=1)[:, edge.shape[1] // 2].astype(np.float64)
    height = picture[rows, columns] - level
    scr = height / np.maximum(edge.std(axis=1), ROUNDING)
    lines = np.stack([around[:, reach], around[:, :, reach]])  # (2, n, 2 reach + 1)
    arms = np.stack([lines[..., reach::-1], lines[..., reach:]]) - level[:, None]  # (2, 2, n, reach + 1), outwards
    half = height / 2
    below = arms[..., 1:] < half[:, None]
    first = np.where(below.any(axis=-1), below.argmax(axis=-1) + 1, reach)
    outer = np.take_along_axis(arms, first[..., None], -1)[..., 0]
    inner = np.take_along_axis(arms, first[..., None] - 1, -1)[..., 0]
    fraction = np.clip((inner - half) / np.maximum(inner - outer, 1e-6), 0, 1)
    sizes = np.maximum((first - 1 + fraction).sum(axis=0).T, 1.0)
    return sizes, scr
