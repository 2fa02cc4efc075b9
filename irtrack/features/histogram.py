"""Kernel-weighted grey histograms of windows, and measures of their similarity.

    p(u) = C sum_i k(|l - l_i| / h) [b(l_i) = u],  C = 1 / sum_i k      (Cheng et al. 2006, eq. 6, 7)

Windows lie on whole pixels (see `irtrack.features.window`), and each distinct window is counted once for all particles.
Pixels outside the frame belong to no bin. A histogram is that of the visible part; the visible share of the kernel's
mass is returned beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from irsim.types import Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.highpass import HighPassedFrame
from irtrack.features.quantiser import Bins, Quantiser, contiguous
from irtrack.features.window import Window

Picture = Image | HighPassedFrame
Distance = Literal["bhattacharyya", "kullback_leibler", "variance_ratio"]

TINY = float(np.finfo(np.float64).tiny)
"""Least divisor of a histogram, so that an empty one stays zero."""
FLOOR = 1e-3
"""Least share of a bin whose logarithm is taken: delta of Collins et al. 2005, section 2.2."""
_UNWANTED = np.empty(0)


def gaussian_kernel(window: Window, h: float) -> Floats:
    """Return k(r) = exp(-r^2 / 2), r = |l - l_i| / h, h in px; (rows, columns), summing to one."""
    x, y = window.offsets()
    kernel: Floats = np.exp(-(x**2 + y[:, None] ** 2) / (2 * h**2))
    kernel /= kernel.sum()
    return kernel


def epanechnikov_kernel(window: Window) -> Floats:
    """Return k = max(0, 1 - r^2), r^2 = (dx / hx)^2 + (dy / hy)^2; (rows, columns), summing to one.

    hx, hy are half the window's sides, at least 1 px: a narrower kernel may fall between the pixels.
    """
    x, y = window.offsets()
    hx, hy = max(window.columns / 2, 1), max(window.rows / 2, 1)
    kernel: Floats = np.maximum(1 - (x / hx) ** 2 - (y[:, None] / hy) ** 2, 0)
    kernel /= kernel.sum()
    return kernel


def counted(cells: Bins, weights: npt.NDArray[Any], bins: int) -> Floats:
    """Return the total weight in each bin, (N, bins), of N sets of bin indices (N, ...) with broadcast weights."""
    count = len(cells)
    own = cells + np.arange(0, count * bins, bins).reshape(-1, *[1] * (cells.ndim - 1))
    every = np.broadcast_to(weights, own.shape)
    mass: Floats = np.bincount(own.ravel(), every.ravel(), count * bins).astype(np.float64, copy=False)
    return mass.reshape(count, bins)


def normalised(mass: Floats) -> Floats:
    """Return histograms (..., bins) divided by their sums; an empty one stays zero."""
    whole: Floats = mass / np.maximum(mass.sum(axis=-1, keepdims=True), TINY)
    return whole


def histogram(
    image: Picture, center: tuple[float, float], window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, float]:
    """Return one window's histogram (bins,), summing to one, and the visible share of the kernel.

    A window wholly outside the frame gives zeros and 0.
    """
    left, top = window.corner(center)
    cells = _cells(image, quantiser, left, top, left + window.columns, top + window.rows)
    mass = counted(cells[None], kernel, quantiser.bins + 1)[0, :-1]
    return normalised(mass), float(mass.sum())


def similarity(
    image: Picture, centers: Floats, window: Window, kernel: Floats, quantiser: Quantiser, reference: Floats
) -> tuple[Floats, Floats]:
    """Return rho (N,) of windows at `centers` (N, 2) px to a reference (bins,), and their visible shares (N,).

    rho is multiplied by the visible share, so that windows mostly outside the frame do not score high.
    """
    mass, windows, inside = (_masses if COMPILED else _masses_plain)(image, centers, window, kernel, quantiser)
    rho = bhattacharyya(mass, reference)
    if inside:
        return rho.take(windows), np.ones(len(windows))
    # With p = mass / visible: rho(p, q) visible = rho(mass, q) sqrt(visible).
    shares = np.minimum(mass[:, :-1].sum(axis=1), 1.0)
    rho *= np.sqrt(shares)
    return rho.take(windows), shares.take(windows)


def _masses(
    image: Picture, centers: Floats, window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, Bins, bool]:
    """Return masses (n, bins + 1) of distinct windows, the window index of each centre (N,), and whether all windows
    are inside the frame.

    The last bin holds the pixels outside the frame.
    """
    height, width = image.shape
    corners, windows = np.empty((len(centers), 2), np.intp), np.empty(len(centers), np.intp)
    centers = np.ascontiguousarray(centers, np.float64)
    distinct, left, top, right, bottom = kernels.distinct_windows(
        centers, *window.corner_offset, window.columns, window.rows, width, height, corners, windows
    )
    right, bottom = right + window.columns, bottom + window.rows
    pixels, x, y = _part(image, left, top, right, bottom)
    corners = corners[:distinct]
    if x or y:
        corners -= (x, y)
    mass = np.empty((distinct, quantiser.bins + 1))
    kernels.window_histograms(pixels, quantiser.table(pixels.itemsize), corners, kernel, mass, _UNWANTED)
    return mass, windows, left >= 0 and top >= 0 and right <= width and bottom <= height


def _masses_plain(
    image: Picture, centers: Floats, window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, Bins, bool]:
    height, width = image.shape
    corners = np.floor(np.nan_to_num(centers, nan=-np.inf) - np.array(window.corner_offset))
    # A window wholly outside the frame is moved to just outside the edge, where it still contains no pixel.
    corners = np.clip(corners, (-window.columns, -window.rows), (width, height)).astype(np.intp)
    distinct, windows = np.unique(corners[:, ::-1], axis=0, return_inverse=True)
    y, x = distinct[:, :1] + np.arange(window.rows), distinct[:, 1:] + np.arange(window.columns)
    left, top, right, bottom = int(x.min()), int(y.min()), int(x.max()) + 1, int(y.max()) + 1
    cells = _cells(image, quantiser, left, top, right, bottom)
    places = ((y - top) * cells.shape[1])[:, :, None] + (x - left)[:, None, :]
    mass = counted(cells.take(places), kernel, quantiser.bins + 1)
    return mass, windows.ravel(), left >= 0 and top >= 0 and right <= width and bottom <= height


@dataclass(frozen=True, slots=True, eq=False)
class MatchScore:
    """Match of the window at a position with the reference: histogram (bins,), rho, and rho of the local background."""

    histogram: Floats
    score: float
    background_score: float


@dataclass(frozen=True, slots=True, eq=False)
class LocalBackground:
    """Window and the ring around it, the local background, whose histograms are counted together.

    outer    window that covers both, with the target's centre
    kernels  (2, rows, columns): kernel of the target, 0 on the ring; kernel of the ring, flat, 0 on the target; each
             sums to one
    """

    outer: Window
    kernels: Floats
    quantiser: Quantiser

    @classmethod
    def of(cls, window: Window, kernel: Floats, margin: tuple[int, int], quantiser: Quantiser) -> LocalBackground:
        """Return the local background of a window with its kernel, a ring `margin` (x, y) px wide."""
        x, y = margin
        shape = (window.rows + 2 * y, window.columns + 2 * x)
        middle = slice(y, y + window.rows), slice(x, x + window.columns)
        target, ring = np.zeros(shape), np.ones(shape)
        ring[middle] = 0
        ring *= 1 / np.count_nonzero(ring)
        target[middle] = kernel
        return cls(Window(shape[1], shape[0], window.phase), np.stack([target, ring]), quantiser)

    def histograms(self, image: Picture, center: tuple[float, float]) -> tuple[Floats, Floats]:
        """Return the histograms (2, bins) of the window and the ring, summing to one, and their visible shares (2,).

        A window wholly outside the frame gives zeros and 0.
        """
        mass, visible = (self._counted if COMPILED else self._counted_plain)(image, *self.outer.corner(center))
        return mass[:, :-1], visible

    def score(self, image: Picture, center: tuple[float, float], reference: Floats) -> MatchScore:
        """Return the match of the window at `center` with a reference (bins,); its rho is multiplied by the visible
        share."""
        mass, visible = (self._counted if COMPILED else self._counted_plain)(image, *self.outer.corner(center))
        score, background = bhattacharyya(mass, reference).tolist()
        return MatchScore(mass[0, :-1], score * float(visible[0]), background)

    def _counted(self, image: Picture, left: int, top: int) -> tuple[Floats, Floats]:
        """Return histograms (2, bins + 1) and visible shares (2,); the last bin holds pixels outside the frame."""
        rows, columns = self.outer.rows, self.outer.columns
        height, width = image.shape
        if not (-columns <= left <= width and -rows <= top <= height):  # moved to just outside the edge
            left, top = min(max(left, -columns), width), min(max(top, -rows), height)
        pixels, x, y = _part(image, left, top, left + columns, top + rows)
        mass, visible = np.empty((2, self.quantiser.bins + 1)), np.empty(2)
        corner = np.array([[left - x, top - y]], np.intp)
        table = self.quantiser.table(pixels.itemsize)
        kernels.window_histograms(pixels, table, corner, self.kernels, mass, visible)
        return mass, visible

    def _counted_plain(self, image: Picture, left: int, top: int) -> tuple[Floats, Floats]:
        cells = _cells(image, self.quantiser, left, top, left + self.outer.columns, top + self.outer.rows)
        mass = counted(np.stack([cells, cells]), self.kernels, self.quantiser.bins + 1)
        visible = mass[:, :-1].sum(axis=1)
        mass[:, :-1] = normalised(mass[:, :-1])
        return mass, visible


def _part(image: Picture, left: int, top: int, right: int, bottom: int) -> tuple[Image, int, int]:
    """Return pixels of the frame that contain a region, and the position (x, y) of the first pixel."""
    if isinstance(image, HighPassedFrame):
        height, width = image.shape
        x, y = min(max(left, 0), width), min(max(top, 0), height)
        return image[y : max(min(bottom, height), y), x : max(min(right, width), x)], x, y
    return contiguous(image), 0, 0


def _cells(image: Picture, quantiser: Quantiser, left: int, top: int, right: int, bottom: int) -> Bins:
    """Return the bins of a region that may reach beyond the frame; pixels outside have the bin `bins`."""
    height, width = image.shape
    if left >= 0 and top >= 0 and right <= width and bottom <= height:
        return quantiser(image[top:bottom, left:right])
    rows = slice(min(max(top, 0), height), max(min(bottom, height), 0))
    columns = slice(min(max(left, 0), width), max(min(right, width), 0))
    cells = np.full((bottom - top, right - left), quantiser.bins, np.intp)
    inside = cells[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    inside[:] = quantiser(image[rows, columns])
    return cells


def bhattacharyya(p: Floats, q: Floats) -> Floats:
    """Return rho = sum_u sqrt(p(u) q(u)) of p (..., bins) and q (bins,) (Cheng et al. 2006, eq. 8).

    Further bins of p, such as that of pixels outside the frame, are ignored; ValueError where p has fewer bins than q.
    """
    if COMPILED:
        rho: Floats = np.empty(p.shape[:-1])
        kernels.bhattacharyya(np.ascontiguousarray(p, np.float64), np.ascontiguousarray(q, np.float64), rho)
        return rho if rho.ndim else rho[()]
    return _bhattacharyya_plain(p, q)


def _bhattacharyya_plain(p: Floats, q: Floats) -> Floats:
    rho: Floats = np.sqrt(p)[..., : len(q)] @ np.sqrt(q)
    return np.minimum(rho, 1.0)


def bhattacharyya_distance(q: Floats, b: Floats) -> float:
    """Return sqrt(1 - rho(q, b)), 0 .. 1 (Comaniciu et al. 2003, eq. 6)."""
    return float(np.sqrt(1 - bhattacharyya(q, b)))


def kullback_leibler(q: Floats, b: Floats, floor: float = FLOOR) -> float:
    """Return sum q ln(q / b), where shares below `floor` are raised to it in the logarithm; at least 0."""
    return max(float(q @ _log_ratio(q, b, floor)), 0.0)


def variance_ratio(q: Floats, b: Floats) -> float:
    """Return var(L; (q + b) / 2) / (var(L; q) + var(L; b)), L = ln(q / b); 0 where q and b are equal.

    R. Collins, Y. Liu, M. Leordeanu, "Online Selection of Discriminative Tracking Features", IEEE TPAMI 27(10), 2005,
    eq. 2 to 4.
    """
    ratio = _log_ratio(q, b)

    def variance(p: Floats) -> float:
        return max(float(p @ ratio**2) - float(p @ ratio) ** 2, 0.0)

    between, within = variance((q + b) / 2), variance(q) + variance(b)
    return between / max(within, FLOOR) if between > 0 else 0.0


def _log_ratio(q: Floats, b: Floats, floor: float = FLOOR) -> Floats:
    ratio: Floats = np.log(np.maximum(q, floor) / np.maximum(b, floor))
    return ratio


DISTANCES: dict[Distance, Callable[[Floats, Floats], float]] = {
    "bhattacharyya": bhattacharyya_distance,
    "kullback_leibler": kullback_leibler,
    "variance_ratio": variance_ratio,
}
"""Measures of the difference of two histograms q and b, (bins,) each."""
