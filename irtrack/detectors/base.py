"""Base of all detectors: parameters, and the chain from a filter's response to detections.

    frame -> response -> z = (response - median) / robust deviation -> maxima above a threshold -> centre, size, score

Frames are mirrored at their edges. The centre of a detection on an edge pixel is a whole pixel across the edge.
"""

from __future__ import annotations

from abc import abstractmethod
from math import pi
from typing import Annotated, Any, ClassVar, Literal

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.config.base import Part
from irsim.types import MEDIAN_TO_SIGMA, Floats, Frame, Image
from irtrack._native import COMPILED, kernels
from irtrack.errors import InputError
from irtrack.types import Detections

Picture = npt.NDArray[np.float32]
Places = npt.NDArray[np.intp]

MEAN_TO_SIGMA = 1.2533
"""Standard deviation of a normal distribution over its mean absolute deviation, sqrt(pi / 2)."""
LEAST_DEVIATION = 0.05
"""Least deviation of a response, counts: that of rounding, .29, after smoothing over a point's image."""
THINNED = 4
"""Step of the rows and columns sampled for median and deviation: 4800 of 320x240 px give both to 2 %."""
WHOLE = 16_384
"""Pixels up to which a frame is not thinned."""
MANY = 2
"""Comparisons a pixel of the frame: with fewer, the squares of the pixels above the threshold are compared one by one,
in less time than the whole frame's maxima take."""
CLOSING = 8
"""Comparisons a pixel of the frame, up to which a closing is computed around its places alone."""
TIED = 2
"""Rank of a maximum with an equal one in its square."""
ROUNDING = 0.2887
"""Standard deviation of rounding to whole counts, counts."""
FWHM = 2.3548
"""Full width at half maximum of a normal curve over its standard deviation, sqrt(8 ln 2)."""
PARABOLA = 0.53
"""Smoothing by a parabola through three pixels, px: the normal kernel of equal slope noise, (4 pi)^(-1/4)."""
INTERPOLATION = 0.05
"""Error of the vertex of a parabola through three pixels of a normal curve of standard deviation 1 px, px."""


def _odd(side: int) -> int:
    if side % 2 == 0:
        raise PydanticCustomError("even", "{side} is even; allowed: odd numbers", {"side": side})
    return side


Side = Annotated[int, Field(ge=3, le=63), AfterValidator(_odd)]
"""Side of a square with a middle pixel, px."""
Width = Annotated[float, Field(ge=0.3, le=10)]
"""Standard deviation of a point's image, px."""
Score = Annotated[float, Field(ge=0, le=1e6)]


class DetectorPart(Part):
    """Detector whose fields are its parameters; subclasses have `step` (see `irtrack.types.Detector`)."""

    task: ClassVar[str] = "detect"
    source: ClassVar[str]
    """Authors and year of the method."""

    @abstractmethod
    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        """Return the memory after a frame, and its detections."""

    def detect(self, frame: Frame | Image) -> Detections:
        """Return the detections of a single frame, or of an image (rows, cols)."""
        if isinstance(frame, np.ndarray):
            frame = Frame(frame, 0, 0.0, 8 * frame.itemsize)
        return self.step(None, frame)[1]


class FilterDetector(DetectorPart):
    """Detector by a filter's response; subclasses have `response`, or `respond` where they keep a memory.

    The variance of a position is that of the peak of a normal curve of deviation s and amplitude SCR in unit white
    noise, smoothed by f: slope variance over squared curvature (S. Kay, "Estimation Theory", 1993, section 3.8),

        var = (s^2 + f^2)^4 / (8 pi s^4 f^4 SCR^2)  px^2,    at f = s the Cramer-Rao bound 2 / (pi SCR^2) (Winick 1986)

    with s of the measured size, f of the filter, and SCR of the picture around the target.
    """

    is_linear: ClassVar[bool] = True
    """True: the response to a cold target is the negative of that to a hot one."""
    scale_invariant: ClassVar[bool] = True
    """True: counts times a factor give the same detections, since the threshold is in units of the noise."""

    threshold: Score = 5.0
    """Least score z of a detection, robust standard deviations of the response."""
    polarity: Literal["hot", "cold", "both"] = "hot"
    """Targets brighter than their surroundings, darker, or both."""
    most: int = Field(default=100, ge=1, le=100_000)
    """Largest number of detections in a frame; the highest scores stay."""
    separation: int = Field(default=2, ge=1, le=100)
    """Half side of the square in which a detection is the only maximum, px."""

    @property
    def smoothing(self) -> float:
        """Standard deviation of the filter's smoothing, px; it enters the variance of positions."""
        return PARABOLA

    @property
    def reach(self) -> int:
        """Half side of the square in which a target's size is measured; its edge is the local background, px."""
        return 4

    def response(self, picture: Picture) -> Picture:
        """Return the response (rows, cols), high at hot targets; unused by subclasses with their own `respond`."""
        raise NotImplementedError

    def scale(self, response: Picture) -> tuple[float, float]:
        """Return the response without a target (its median) and its standard deviation."""
        return robust_scale(response)

    def negative(self, picture: Picture) -> Picture:
        """Return the picture in which cold targets are hot."""
        return -picture

    def respond(self, memory: Any, picture: Picture) -> tuple[Any, Picture | None]:
        """Return the memory after a frame and its response; None where there is no response yet."""
        return None, self.response(picture)

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        picture = checked_picture(frame)
        memory, response = self.respond(state, picture) if self.polarity != "cold" or self.is_linear else (None, None)
        found = []
        if self.polarity != "cold" and response is not None:
            found.append(self._found(response, picture))
        if self.polarity != "hot":
            cold = self.negative(picture)
            if not self.is_linear:
                response = self.response(cold)
            elif response is not None:
                response = -response
            if response is not None:
                found.append(self._found(response, cold))
        return memory, _strongest(found, self.most)

    def _found(self, response: Picture, picture: Picture) -> Detections:
        """Return the detections of a response to a picture whose targets are hot."""
        middle, deviation = self.scale(response)
        rows, columns = maxima(response, self.separation, middle + self.threshold * deviation, self.most)
        scores = (response[rows, columns].astype(np.float64) - middle) / deviation
        if len(rows) == 0:
            return Detections(np.empty((0, 2)), np.empty((0, 2)), scores, np.empty((0, 2, 2)))
        rows, columns, centers = self.located(response, picture, rows, columns)
        sizes, scr = measured(picture, rows, columns, self.reach)
        s, f = np.maximum(sizes / FWHM, 0.5), self.smoothing
        spread = (s**2 + f**2) ** 4 / (8 * pi * s**4 * f**4)
        covariances = np.zeros((len(rows), 2, 2))
        covariances[:, (0, 1), (0, 1)] = np.minimum(
            spread / np.maximum(scr, 1.0)[:, None] ** 2 + INTERPOLATION**2, float(self.reach) ** 2
        )
        return Detections(centers, sizes, scores, covariances)

    def located(
        self, response: Picture, picture: Picture, rows: Places, columns: Places
    ) -> tuple[Places, Places, Floats]:
        """Return the pixels (n,), (n,) and centres (n, 2) px of the maxima of a response."""
        return rows, columns, vertices(response, rows, columns)


def checked_picture(frame: Frame) -> Picture:
    """Return the image as float32, counts; InputError where no detector can use it."""
    image = frame.image
    if image.ndim != 2 or image.size == 0 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"frame {frame.index}: an image of shape {image.shape}, {image.dtype}; "
            "allowed: (rows, cols) of uint8 or uint16"
        )
    return image.astype(np.float32, order="C")


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

    `TIED` where another one is as high; at the frame's edge, whose pixels are repeated, it always is.
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
    """Return the place nearest to the middle of each group of places (n,), which rise; the first of equally near ones.

    Places are of one group where their morphological closing by the square of `separation` px on all sides connects
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
    """Return the centres (n, 2) px of maxima, by a parabola along each axis; whole at an edge."""
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


def _strongest(found: list[Detections], most: int) -> Detections:
    """Return the detections of both polarities, the highest scores first."""
    if len(found) == 1:
        return found[0]
    if not found:
        return Detections(np.empty((0, 2)), np.empty((0, 2)), np.empty(0), np.empty((0, 2, 2)))
    both = Detections(
        np.concatenate([each.centers for each in found]),
        np.concatenate([each.sizes for each in found]),
        np.concatenate([each.scores for each in found]),
        np.concatenate([each.covariances for each in found if each.covariances is not None]),
    )
    return both.take(np.argsort(-both.scores, kind="stable")[:most])
