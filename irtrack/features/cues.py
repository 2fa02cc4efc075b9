"""Two cues of many windows of different sizes at once: grey levels and gradient orientations.

A target's window is a pattern of places about its centre. A particle of another size sees the same
number of places, farther apart or closer together, each at the nearest pixel: so all particles are
counted in one go.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Floats, Image
from irtrack.features.gradients import Gradient, orientations, sobel
from irtrack.features.quantise import Bins, Quantiser
from irtrack.features.window import Window

_NOTHING = float(np.finfo(np.float64).tiny)
"""Divides an empty histogram, which stays zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """Places about a target's centre, at its first size: x (C,), y (R,) px; kernel (R, C), summing to one."""

    x: Floats
    y: Floats
    kernel: Floats

    @classmethod
    def of(cls, window: Window, most: int) -> Pattern:
        """The window's pixels, or where they are more than about `most`, an even grid of places among them.

        The kernel is g(r) = 1 - r^2 within the ellipse of the window, 0 outside (Li, Li 2014, eq. 4
        is unreadable; it is said to favour places near the centre; this is Epanechnikov's).
        """
        thin = max(1.0, (window.rows * window.columns / most) ** 0.5)
        offset_x, offset_y = window.offsets()
        x, y = _thinned(offset_x[0], thin), _thinned(offset_y[:, 0], thin)
        kernel = 1 - (2 * x / window.columns) ** 2 - (2 * y[:, None] / window.rows) ** 2
        kernel = np.maximum(kernel, 0)
        total = kernel.sum()
        return cls(x, y, kernel / total if total > 0 else np.full(kernel.shape, 1 / kernel.size))


@dataclass(frozen=True, slots=True, eq=False)
class Cue:
    """Histograms of both cues, each summing to one or empty: grey (..., B), gradient (..., B')."""

    grey: Floats
    gradient: Floats

    def like(self, other: Cue) -> tuple[Floats, Floats]:
        """Bhattacharyya coefficients of both cues to those of one other (eq. 8)."""
        return (
            np.minimum(np.sqrt(self.grey) @ np.sqrt(other.grey), 1.0),
            np.minimum(np.sqrt(self.gradient) @ np.sqrt(other.gradient), 1.0),
        )

    def mixed(self, other: Cue, rate: float) -> Cue:
        """(1 - rate) of these and `rate` of others."""
        return Cue((1 - rate) * self.grey + rate * other.grey, (1 - rate) * self.gradient + rate * other.gradient)


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A part of a frame with its corner at (left, top), and what its cues are counted by.

    image, gx, gy  (rows, columns) counts and their Sobel gradients
    inside         (left, top, right, bottom) of the frame, seen from that corner
    """

    left: int
    top: int
    image: Image
    gx: Gradient
    gy: Gradient
    inside: tuple[int, int, int, int]
    quantiser: Quantiser
    edge_bins: int

    @classmethod
    def of(cls, image: Image, part: tuple[int, int, int, int], quantiser: Quantiser, edge_bins: int) -> Field:
        """Of the part (left, top, right, bottom), cut to the frame; at least a pixel is kept."""
        height, width = image.shape
        left, top = min(max(part[0], 0), width - 1), min(max(part[1], 0), height - 1)
        right, bottom = max(min(part[2], width), left + 1), max(min(part[3], height), top + 1)
        gx, gy = sobel(image, left, top, right, bottom)
        inside = (-left, -top, width - left, height - top)
        counts: Image = np.ascontiguousarray(image[top:bottom, left:right])  # type: ignore[assignment]
        return cls(left, top, counts, gx, gy, inside, quantiser, edge_bins)

    @classmethod
    def whole(cls, image: Image, quantiser: Quantiser, edge_bins: int) -> Field:
        """Of the whole frame."""
        return cls.of(image, (0, 0, image.shape[1], image.shape[0]), quantiser, edge_bins)

    def windows(self, pattern: Pattern, centers: Floats, scales: Floats) -> tuple[Cue, Floats]:
        """Cues of windows at `centers` (N, 2) px of `scales` (N, 2) times the first size, and visible shares (N,).

        Grey levels count by the kernel (eq. 3), orientations by their magnitude alone: a kernel that
        fades towards the rim would leave out the very edges. Windows must lie in this part or
        outside the frame; what is outside belongs to no bin.
        """
        x = np.floor(centers[:, :1] + scales[:, :1] * pattern.x + (0.5 - self.left)).astype(np.intp)
        y = np.floor(centers[:, 1:] + scales[:, 1:] * pattern.y + (0.5 - self.top)).astype(np.intp)
        left, top, right, bottom = self.inside
        if x.min() >= left and y.min() >= top and x.max() < right and y.max() < bottom:
            return self._cues(x, y, np.broadcast_to(pattern.kernel, (len(x), *pattern.kernel.shape))), np.ones(len(x))
        cue = Cue(np.zeros((len(x), self.quantiser.bins)), np.zeros((len(x), self.edge_bins)))
        visible = np.zeros(len(x))
        # Stray particles lie far outside, and may be most of them: they cost nothing.
        (met,) = ((x[:, -1] >= left) & (x[:, 0] < right) & (y[:, -1] >= top) & (y[:, 0] < bottom)).nonzero()
        if met.size > 0:
            x, y = x[met], y[met]
            seen = ((y >= top) & (y < bottom))[:, :, None] & ((x >= left) & (x < right))[:, None, :]
            kernel = pattern.kernel * seen
            rows, columns = self.image.shape
            some = self._cues(np.clip(x, 0, columns - 1), np.clip(y, 0, rows - 1), kernel, seen)
            cue.grey[met], cue.gradient[met], visible[met] = some.grey, some.gradient, kernel.sum(axis=(1, 2))
        return cue, visible

    def _cues(self, x: Bins, y: Bins, kernel: Floats, seen: npt.NDArray[np.bool_] | None = None) -> Cue:
        """Of windows (N, R, C) with their places x (N, C), y (N, R), all in this part; `seen`: which count."""
        index = (y * self.image.shape[1])[:, :, None] + x[:, None, :]
        edge, strength = orientations(self.gx.take(index), self.gy.take(index), self.edge_bins)
        grey = _counted(self.quantiser(self.image.take(index)), kernel, self.quantiser.bins)
        return Cue(grey, _counted(edge, strength if seen is None else strength * seen, self.edge_bins))

    def ring(self, box: tuple[float, float, float, float], margin: int) -> Cue:
        """Cues of what lies within `margin` px around a box (cx, cy, w, h); each pixel counts alike."""
        cx, cy, w, h = box
        left, top = floor(cx - w / 2 + 0.5) - self.left, floor(cy - h / 2 + 0.5) - self.top
        right, bottom = left + max(1, round(w)), top + max(1, round(h))
        first_x, first_y = max(left - margin, 0), max(top - margin, 0)
        part = _span(first_y, bottom + margin), _span(first_x, right + margin)
        image = self.image[part][None]
        weights = np.ones(image.shape, np.float32)
        weights[:, _span(top - first_y, bottom - first_y), _span(left - first_x, right - first_x)] = 0
        if image.size == 0:
            return Cue(np.zeros(self.quantiser.bins), np.zeros(self.edge_bins))
        edge, strength = orientations(self.gx[part], self.gy[part], self.edge_bins)
        grey = _counted(self.quantiser(image), weights, self.quantiser.bins)
        return Cue(grey[0], _counted(edge[None], strength * weights[0], self.edge_bins)[0])


def likeness_map(field: Field, window: Window, pattern: Pattern, model: Cue) -> tuple[Floats, Floats]:
    """rho of both cues (rows, columns) for the window with its corner at each pixel where it fits in the field.

    It is what `Field.windows` gives at scale 1, everywhere (of a pattern that leaves out pixels, nearly).
    """
    rows, columns = max(field.image.shape[0] - window.rows + 1, 0), max(field.image.shape[1] - window.columns + 1, 0)
    if 0 in (rows, columns):
        return np.zeros((rows, columns)), np.zeros((rows, columns))

    def like(cells: Bins, weights: Floats | float, kernel: Floats, reference: Floats) -> Floats:
        rho, total = np.zeros((rows, columns)), np.full((rows, columns), _NOTHING)
        for u, share in enumerate(reference):
            single = ((cells == u) * weights).astype(np.float32)
            mass = cv2.filter2D(single, cv2.CV_32F, kernel, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT)
            mass = np.maximum(mass[:rows, :columns], 0)  # a long kernel goes by a DFT, which rounds
            rho += np.sqrt(share * mass)
            total += mass
        rho /= np.sqrt(total)
        return np.minimum(rho, 1.0, out=rho)

    kernel: Floats = cv2.resize(pattern.kernel, (window.columns, window.rows), interpolation=cv2.INTER_LINEAR)  # type: ignore[assignment]
    edge, strength = orientations(field.gx, field.gy, field.edge_bins)
    return (
        like(field.quantiser(field.image), 1.0, kernel, model.grey),
        like(edge, strength, np.full_like(kernel, 1 / kernel.size), model.gradient),
    )


def _span(first: int, end: int) -> slice:
    """first .. end-1, without what lies before the beginning."""
    return slice(max(first, 0), max(end, 0))


def _counted(cells: Bins, weights: Floats | Gradient, bins: int) -> Floats:
    """(N, bins) histograms of cells (N, rows, columns) with weights, each summing to one; without weight, zeros."""
    count = len(cells)
    cells += np.arange(0, count * bins, bins)[:, None, None]
    mass = np.bincount(cells.ravel(), weights.ravel(), count * bins).reshape(count, bins)
    whole: Floats = mass / np.maximum(mass.sum(axis=1, keepdims=True), _NOTHING)
    return whole


def _thinned(places: Floats, thin: float) -> Floats:
    """As many places as asked for, evenly among those given, as far apart from both ends."""
    count = max(1, round(len(places) / thin))
    if count == len(places):
        return places
    step = (places[-1] - places[0] + 1) / count
    even: Floats = places[0] - 0.5 + step * (np.arange(count) + 0.5)
    return even
