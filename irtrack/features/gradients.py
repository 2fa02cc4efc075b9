"""Grey levels and gradient orientations of many windows of different sizes (Li, Li 2014, section 3.3).

    G = sqrt(Gx^2 + Gy^2),  theta = arctan(Gy / Gx),  Gx, Gy from the Sobel operators

A target's window is a pattern of sample positions about its centre. A particle of another size scales the pattern; each
sample is taken at the nearest pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import cv2
import numpy as np
import numpy.typing as npt

from irsim.types import Bools, Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.histogram import TINY, counted, normalised
from irtrack.features.quantiser import Bins, Quantiser, contiguous
from irtrack.features.window import Window

Gradient = npt.NDArray[np.float32]


def sobel(image: Image, left: int, top: int, right: int, bottom: int) -> tuple[Gradient, Gradient]:
    """Return Gx, Gy of the part [top:bottom, left:right] of a frame, (bottom - top, right - left) each.

    The unit is counts times 4, the sum of an operator's positive weights. Beyond the frame its edge pixels are
    repeated.
    """
    height, width = image.shape
    inner_left, inner_top = max(left - 1, 0), max(top - 1, 0)
    around = image[inner_top : min(bottom + 1, height), inner_left : min(right + 1, width)]
    part = np.s_[top - inner_top : bottom - inner_top, left - inner_left : right - inner_left]
    gx = cv2.Sobel(around, cv2.CV_32F, 1, 0, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(around, cv2.CV_32F, 0, 1, borderType=cv2.BORDER_REPLICATE)
    return np.ascontiguousarray(gx[part]), np.ascontiguousarray(gy[part])


def orientations(gx: Gradient, gy: Gradient, bins: int) -> tuple[Bins, Gradient]:
    """Return bins 0 .. bins-1 of theta and magnitudes G, both of the shape of gx and gy.

    Bin u is centred on the direction 2 pi u / bins from +x towards +y, so that upright edges lie in the middle of a
    bin. Directions cover the whole circle: the two sides of a target differ.
    """
    magnitude, angle = _polar(gx, gy)
    angle *= bins / (2 * np.pi)
    angle += 0.5
    cells = angle.astype(np.intp)
    cells[cells >= bins] = 0  # the last half bin before the full circle belongs to the first
    return cells, magnitude


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """Sample positions about a target's centre, at its size in the first frame: x (C,), y (R,) px.

    `kernel` (R, C): weights of grey levels; `edges` (R, C): True where the gradient at the sample is used.
    """

    x: Floats
    y: Floats
    kernel: Floats
    edges: Bools

    @classmethod
    def of(cls, window: Window, most: int) -> Pattern:
        """Return the pattern of a window's pixels, or of an even grid of about `most` where it has more pixels.

        The kernel sums to one: Epanechnikov's g(r) = 1 - r^2 within the ellipse of the window (eq. 4 of Li, Li 2014 is
        illegible; by the text the kernel favours pixels near the centre).
        """
        thinning = max(1.0, (window.rows * window.columns / most) ** 0.5)
        x, y = (_thinned(places, thinning) for places in window.offsets())
        kernel = 1 - (2 * x / window.columns) ** 2 - (2 * y[:, None] / window.rows) ** 2
        kernel = np.maximum(kernel, 0)
        total = kernel.sum()
        kernel = kernel / total if total > 0 else np.full(kernel.shape, 1 / kernel.size)
        return cls(x, y, kernel, np.ones(kernel.shape, bool))


@dataclass(frozen=True, slots=True, eq=False)
class Cues:
    """Histograms of both cues, grey (..., B) and gradient (..., B'), each summing to one, or zero where empty."""

    grey: Floats
    gradient: Floats

    def of(self, window: int) -> Cues:
        """Return the histograms of one of the windows."""
        return Cues(self.grey[window], self.gradient[window])

    def similarity(self, other: Cues) -> tuple[Floats, Floats]:
        """Return the Bhattacharyya coefficients of the histograms of both cues with those of `other` (eq. 8)."""
        return (
            np.minimum(np.sqrt(self.grey) @ np.sqrt(other.grey), 1.0),
            np.minimum(np.sqrt(self.gradient) @ np.sqrt(other.gradient), 1.0),
        )

    def blended(self, other: Cues, rate: float) -> Cues:
        """Return (1 - rate) times these histograms plus `rate` times the others."""
        return Cues((1 - rate) * self.grey + rate * other.grey, (1 - rate) * self.gradient + rate * other.gradient)


@dataclass(frozen=True, slots=True, eq=False)
class CueImage:
    """Frame with the bins of its grey levels and orientations."""

    image: Image
    quantiser: Quantiser
    edge_bins: int

    def windows(self, pattern: Pattern, centers: Floats, scales: Floats) -> tuple[Cues, Floats]:
        """Return cues and visible shares (N,) of windows at `centers` (N, 2) px, `scales` (N, 2) times the first size.

        Grey levels are weighted by the kernel (eq. 3), orientations by their magnitude alone, since a kernel would
        weaken the target's edges. Pixels outside the frame belong to no bin.
        """
        cues = Cues(np.zeros((len(centers), self.quantiser.bins)), np.zeros((len(centers), self.edge_bins)))
        visible = np.zeros(len(centers))
        (self._count if COMPILED else self._count_plain)(pattern, centers, scales, cues, visible)
        return cues, visible

    def _count(self, pattern: Pattern, centers: Floats, scales: Floats, cues: Cues, visible: Floats) -> None:
        image, table = contiguous(self.image), self.quantiser.table(self.image.itemsize)
        centers, scales = np.ascontiguousarray(centers, np.float64), np.ascontiguousarray(scales, np.float64)
        places = image, table, pattern.x, pattern.y, centers, scales
        gx, gy = np.empty((2, len(centers), pattern.kernel.size), np.float32)
        met = kernels.window_gradients(*places, gx, gy)
        strength, angle = _polar(gx[:met], gy[:met]) if met else (gx[:0], gy[:0])
        kernels.window_cues(*places, pattern.kernel, pattern.edges, strength, angle, cues.grey, cues.gradient, visible)

    def _count_plain(self, pattern: Pattern, centers: Floats, scales: Floats, cues: Cues, visible: Floats) -> None:
        rows, columns = self.image.shape
        x, across = _pixels(centers[:, :1] + scales[:, :1] * pattern.x, columns)
        y, down = _pixels(centers[:, 1:] + scales[:, 1:] * pattern.y, rows)
        met = np.flatnonzero(across.any(axis=1) & down.any(axis=1))
        if met.size == 0:
            return
        x, y, seen = x[met], y[met], down[met][:, :, None] & across[met][:, None, :]
        left, top, right, bottom = x.min(), y.min(), x.max() + 1, y.max() + 1
        at = ((y - top) * (right - left))[:, :, None] + (x - left)[:, None, :]
        gx, gy = (each.take(at) for each in sobel(self.image, left, top, right, bottom))
        edge, strength = orientations(gx.reshape(len(met), -1), gy.reshape(len(met), -1), self.edge_bins)
        grey = self.quantiser(self.image[top:bottom, left:right].take(at))
        kernel = pattern.kernel * seen
        edges = strength.reshape(seen.shape) * (pattern.edges & seen)
        cues.grey[met] = normalised(counted(grey, kernel, self.quantiser.bins))
        cues.gradient[met] = normalised(counted(edge.reshape(seen.shape), edges, self.edge_bins))
        visible[met] = kernel.sum(axis=(1, 2)) if not (across.all() and down.all()) else 1.0

    def ring(self, box: tuple[float, float, float, float], margin: int) -> Cues:
        """Return cues of the pixels within `margin` px around a box (cx, cy, w, h), all with the same weight."""
        cx, cy, w, h = box
        left, top = floor(cx - w / 2 + 0.5), floor(cy - h / 2 + 0.5)
        right, bottom = left + max(1, round(w)), top + max(1, round(h))
        rows, columns = self.image.shape
        first_x, first_y = max(left - margin, 0), max(top - margin, 0)
        x = np.arange(first_x, min(right + margin, columns), dtype=np.float64)
        y = np.arange(first_y, min(bottom + margin, rows), dtype=np.float64)
        if 0 in (x.size, y.size):
            return Cues(np.zeros(self.quantiser.bins), np.zeros(self.edge_bins))
        weights = np.ones((y.size, x.size))
        weights[max(top - first_y, 0) : max(bottom - first_y, 0), max(left - first_x, 0) : max(right - first_x, 0)] = 0
        cues, _ = self.windows(Pattern(x, y, weights, weights > 0), np.zeros((1, 2)), np.ones((1, 2)))
        return cues.of(0)

    def similarity_map(self, window: Window, pattern: Pattern, model: Cues) -> tuple[Floats, Floats]:
        """Return rho of both cues, (rows, columns) each, of the window with its corner at each pixel where it fits.

        It equals the similarity of `windows` at scale 1, but only approximately where the pattern leaves out pixels.
        """
        rows, columns = max(self.image.shape[0] - window.rows + 1, 0), max(self.image.shape[1] - window.columns + 1, 0)
        if 0 in (rows, columns):
            return np.zeros((rows, columns)), np.zeros((rows, columns))

        def similarity(cells: Bins, weights: Gradient | float, kernel: Floats, reference: Floats) -> Floats:
            rho, total = np.zeros((rows, columns)), np.full((rows, columns), TINY)
            for u, share in enumerate(reference):
                single = ((cells == u) * weights).astype(np.float32)
                mass = cv2.filter2D(single, cv2.CV_32F, kernel, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT)
                mass = np.maximum(mass[:rows, :columns], 0)  # OpenCV applies a long kernel by a DFT, which rounds
                rho += np.sqrt(share * mass)
                total += mass
            rho /= np.sqrt(total)
            return np.minimum(rho, 1.0, out=rho)

        kernel: Floats = cv2.resize(pattern.kernel, (window.columns, window.rows), interpolation=cv2.INTER_LINEAR)  # type: ignore[assignment]  # OpenCV's stubs know no element types
        edge, strength = orientations(*sobel(self.image, 0, 0, *self.image.shape[::-1]), self.edge_bins)
        return (
            similarity(self.quantiser(self.image), 1.0, kernel, model.grey),
            similarity(edge, strength, np.full_like(kernel, 1 / kernel.size), model.gradient),
        )


def _polar(gx: Gradient, gy: Gradient) -> tuple[Gradient, Gradient]:
    """Return magnitudes G and directions theta, 0 .. 2 pi from +x towards +y."""
    magnitude, angle = cv2.cartToPolar(gx, gy)
    return magnitude, angle  # type: ignore[return-value]  # OpenCV's stubs know no element types


def _pixels(places: Floats, edge: int) -> tuple[Bins, Bools]:
    """Return the pixel of each position on one axis (0 where outside the frame), and True where it is inside."""
    at = np.floor(places + 0.5)
    within = (at >= 0) & (at < edge)
    return np.where(within, at, 0).astype(np.intp), within


def _thinned(places: Floats, thinning: float) -> Floats:
    """Return positions about `thinning` px apart, spread evenly between both ends."""
    count = max(1, round(len(places) / thinning))
    if count == len(places):
        return places
    step = (places[-1] - places[0] + 1) / count
    even: Floats = places[0] - 0.5 + step * (np.arange(count) + 0.5)
    return even
