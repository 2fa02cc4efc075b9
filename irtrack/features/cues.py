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

from irsim.types import Bools, Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.gradients import Gradient, orientations, polar, sobel
from irtrack.features.quantise import Bins, Quantiser, contiguous
from irtrack.features.window import Window

_NOTHING = float(np.finfo(np.float64).tiny)
"""Divides an empty histogram, which stays zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """Places about a target's centre, at its first size: x (C,), y (R,) px.

    kernel (R, C): what grey levels count there; edges (R, C): whether gradients do.
    """

    x: Floats
    y: Floats
    kernel: Floats
    edges: Bools

    @classmethod
    def of(cls, window: Window, most: int) -> Pattern:
        """The window's pixels, or where they are more than about `most`, an even grid of places among them.

        The kernel sums to one. It is g(r) = 1 - r^2 within the ellipse of the window, 0 outside (Li, Li 2014, eq. 4
        is unreadable; it is said to favour places near the centre; this is Epanechnikov's).
        """
        thin = max(1.0, (window.rows * window.columns / most) ** 0.5)
        offset_x, offset_y = window.offsets()
        x, y = _thinned(offset_x[0], thin), _thinned(offset_y[:, 0], thin)
        kernel = 1 - (2 * x / window.columns) ** 2 - (2 * y[:, None] / window.rows) ** 2
        kernel = np.maximum(kernel, 0)
        total = kernel.sum()
        kernel = kernel / total if total > 0 else np.full(kernel.shape, 1 / kernel.size)
        return cls(x, y, kernel, np.ones(kernel.shape, bool))


@dataclass(frozen=True, slots=True, eq=False)
class Cue:
    """Histograms of both cues, each summing to one or empty: grey (..., B), gradient (..., B')."""

    grey: Floats
    gradient: Floats

    def of(self, window: int) -> Cue:
        """Those of one of many windows."""
        return Cue(self.grey[window], self.gradient[window])

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
    """A frame, and what its cues are counted by."""

    image: Image
    quantiser: Quantiser
    edge_bins: int

    def windows(self, pattern: Pattern, centers: Floats, scales: Floats) -> tuple[Cue, Floats]:
        """Cues of windows at `centers` (N, 2) px of `scales` (N, 2) times the first size, and visible shares (N,).

        Grey levels count by the kernel (eq. 3), orientations by their magnitude alone: a kernel that
        fades towards the rim would leave out the very edges. What is outside the frame belongs to no bin.
        """
        return (self._windows if COMPILED else self._windows_plain)(pattern, centers, scales)

    def _windows(self, pattern: Pattern, centers: Floats, scales: Floats) -> tuple[Cue, Floats]:
        count = len(centers)
        image, table = contiguous(self.image), self.quantiser.table(self.image.itemsize)
        centers, scales = np.ascontiguousarray(centers, np.float64), np.ascontiguousarray(scales, np.float64)
        sights = image, table, pattern.x, pattern.y, centers, scales
        gx, gy = np.empty((2, count, pattern.kernel.size), np.float32)
        met = kernels.window_gradients(*sights, gx, gy)
        strength, angle = polar(gx[:met], gy[:met])
        cue, visible = self._empty(count), np.empty(count)
        kernels.window_cues(*sights, pattern.kernel, pattern.edges, strength, angle, cue.grey, cue.gradient, visible)
        return cue, visible

    def _windows_plain(self, pattern: Pattern, centers: Floats, scales: Floats) -> tuple[Cue, Floats]:
        rows, columns = self.image.shape
        x, across = _pixels(centers[:, :1] + scales[:, :1] * pattern.x, columns)
        y, down = _pixels(centers[:, 1:] + scales[:, 1:] * pattern.y, rows)
        cue, visible = self._empty(len(x)), np.zeros(len(x))
        # Stray particles lie far outside, and may be most of them: they cost nothing.
        met = np.flatnonzero(across.any(axis=1) & down.any(axis=1))
        if met.size == 0:
            return cue, visible
        if across.all() and down.all():
            kernel = np.broadcast_to(pattern.kernel, (len(x), *pattern.kernel.shape))
            return self._cues(x, y, kernel, pattern.edges), np.ones(len(x))
        seen = down[met][:, :, None] & across[met][:, None, :]
        kernel = pattern.kernel * seen
        some = self._cues(x[met], y[met], kernel, pattern.edges & seen)
        cue.grey[met], cue.gradient[met] = some.grey, some.gradient
        visible[met] = kernel.sum(axis=(1, 2))
        return cue, visible

    def _empty(self, count: int) -> Cue:
        return Cue(np.zeros((count, self.quantiser.bins)), np.zeros((count, self.edge_bins)))

    def _cues(self, x: Bins, y: Bins, kernel: Floats, edges: Bools) -> Cue:
        """Of windows (N, R, C) with their places x (N, C), y (N, R), all in the frame."""
        left, top, right, bottom = x.min(), y.min(), x.max() + 1, y.max() + 1
        at = ((y - top) * (right - left))[:, :, None] + (x - left)[:, None, :]
        gx, gy = sobel(self.image, left, top, right, bottom)
        edge, strength = orientations(gx.take(at), gy.take(at), self.edge_bins)
        grey = self.quantiser(self.image[top:bottom, left:right].take(at))
        return Cue(_counted(grey, kernel, self.quantiser.bins), _counted(edge, strength * edges, self.edge_bins))

    def ring(self, box: tuple[float, float, float, float], margin: int) -> Cue:
        """Cues of what lies within `margin` px around a box (cx, cy, w, h); each pixel counts alike."""
        cx, cy, w, h = box
        left, top = floor(cx - w / 2 + 0.5), floor(cy - h / 2 + 0.5)
        right, bottom = left + max(1, round(w)), top + max(1, round(h))
        rows, columns = self.image.shape
        first_x, first_y = max(left - margin, 0), max(top - margin, 0)
        x = np.arange(first_x, min(right + margin, columns), dtype=np.float64)
        y = np.arange(first_y, min(bottom + margin, rows), dtype=np.float64)
        if 0 in (x.size, y.size):
            return self._empty(1).of(0)
        weights = np.ones((y.size, x.size))
        weights[_span(top - first_y, bottom - first_y), _span(left - first_x, right - first_x)] = 0
        cue, _ = self.windows(Pattern(x, y, weights, weights > 0), np.zeros((1, 2)), np.ones((1, 2)))
        return cue.of(0)


def _pixels(places: Floats, edge: int) -> tuple[Bins, Bools]:
    """The pixels of places on one axis, and which lie within its edge; of those that do not the first pixel."""
    at = np.floor(places + 0.5)
    within = (at >= 0) & (at < edge)
    return np.where(within, at, 0).astype(np.intp), within


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

    kernel: Floats = cv2.resize(pattern.kernel, (window.columns, window.rows), interpolation=cv2.INTER_LINEAR)  # type: ignore[assignment]  # OpenCV's stubs know no element types
    edge, strength = orientations(*sobel(field.image, 0, 0, *field.image.shape[::-1]), field.edge_bins)
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
