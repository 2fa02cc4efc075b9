"""Base of all detectors: parameters, and the chain from a filter's response to detections.

    frame -> response -> z = (response - median) / robust deviation -> maxima above a threshold -> centre, size, score

Frames are mirrored at their edges. The centre of a detection on an edge pixel is not refined across that edge.
"""

from __future__ import annotations

from abc import abstractmethod
from math import pi
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from irsim.config.base import Part
from irsim.types import Floats, Frame, Image
from irtrack.detectors.peaks import FWHM, Picture, Places, maxima, measured, robust_scale, vertices
from irtrack.errors import InputError
from irtrack.types import Detections

PARABOLA = 0.53
"""Standard deviation of the normal kernel with the slope noise of a parabola through three pixels, (4 pi)^(-1/4) px."""
INTERPOLATION = 0.05
"""Error of a peak located by a parabola through three pixels, px, for a normal curve of standard deviation 1 px."""


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
    """Detector by a filter's response.

    The variance of a position is that of the peak of a normal curve of deviation s and amplitude SCR in unit white
    noise, smoothed by f: slope variance over squared curvature (S. Kay, "Estimation Theory", 1993, section 3.8),

        var = (s^2 + f^2)^4 / (8 pi s^4 f^4 SCR^2)  px^2,    at f = s the Cramer-Rao bound 2 / (pi SCR^2) (Winick 1986)

    with s from the measured size, f from the filter, and the SCR from the picture around the target.
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

    def scale(self, response: Picture) -> tuple[float, float]:
        """Return the response without a target (its median) and its standard deviation."""
        return robust_scale(response)

    def negative(self, picture: Picture) -> Picture:
        """Return the inverted picture, in which cold targets are hot."""
        return -picture

    @abstractmethod
    def respond(self, memory: Any, picture: Picture) -> tuple[Any, Picture | None]:
        """Return the memory after a frame, and its response (rows, cols), high at hot targets; None before the first
        response."""

    def step(self, state: Any, frame: Frame) -> tuple[Any, Detections]:
        picture = checked_picture(frame)
        memory, response = self.respond(state, picture) if self.polarity != "cold" or self.is_linear else (None, None)
        found = []
        if self.polarity != "cold" and response is not None:
            found.append(self._found(response, picture))
        if self.polarity != "hot":
            cold = self.negative(picture)
            if not self.is_linear:
                response = self.respond(state, cold)[1]
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


class SingleFrameDetector(FilterDetector):
    """Detector by a filter without memory."""

    @abstractmethod
    def response(self, picture: Picture) -> Picture:
        """Return the response (rows, cols), high at hot targets."""

    def respond(self, memory: None, picture: Picture) -> tuple[None, Picture]:
        return None, self.response(picture)


def checked_picture(frame: Frame) -> Picture:
    """Return the image as float32, counts; InputError where no detector can use it."""
    image = frame.image
    if image.ndim != 2 or image.size == 0 or image.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"frame {frame.index}: an image of shape {image.shape}, {image.dtype}; "
            "allowed: (rows, cols) of uint8 or uint16"
        )
    return image.astype(np.float32, order="C")


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
