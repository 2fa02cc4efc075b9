"""Grey histograms weighted by a kernel, of one window and of many at once, and their likeness.

    p(u) = C sum_i k(|l - l_i| / h) [b(l_i) = u],  C = 1 / sum_i k      (Cheng et al. 2006, eq. 6, 7)

Windows lie on whole pixels (see `irtrack.features.window`), so particles that share a pixel share a
histogram, and each distinct window is worked out once. Pixels outside the frame belong to no bin:
a histogram is that of the visible part, and the visible share of the kernel's mass is given apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Floats, Image
from irtrack._native import COMPILED
from irtrack._native import kernels as compiled
from irtrack.features.highpass import HighPassed
from irtrack.features.quantise import Bins, Quantiser, contiguous
from irtrack.features.window import Integers, Window

_NOTHING = float(np.finfo(np.float64).tiny)
"""Divides an empty histogram, which stays zero."""
Picture = Image | HighPassed
_PIXELS_AT_ONCE = 16384
"""Pixels of windows counted together: arrays of 128 kB stay in the cache and cost no page faults."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A place looked at: its histogram (bins,), its likeness to the reference, that of the ring around it."""

    histogram: Floats
    score: float
    floor: float


@dataclass(frozen=True, slots=True, eq=False)
class Surround:
    """A window and the ring around it, counted in one go.

    outer   the window of both, with the target's centre
    first   (rows, columns) of the outer window: where the bins begin, 0 for the target's own pixels, those of the
            ring's pixels behind them
    kernel  (rows, columns), summing to one over each of the two; the ring's is flat
    """

    outer: Window
    first: Bins
    kernel: Floats
    quantiser: Quantiser

    @classmethod
    def of(cls, window: Window, kernel: Floats, margin: tuple[int, int], quantiser: Quantiser) -> Surround:
        """A ring `margin` (x, y) px wide around a window with its kernel."""
        x, y = margin
        shape = (window.rows + 2 * y, window.columns + 2 * x)
        middle = slice(y, y + window.rows), slice(x, x + window.columns)
        first = np.full(shape, quantiser.bins + 1, np.intp)
        first[middle] = 0
        both = np.full(shape, 1 / np.count_nonzero(first))
        both[middle] = kernel
        return cls(Window(shape[1], shape[0], window.phase), first, both, quantiser)

    def histograms(self, image: Picture, center: tuple[float, float]) -> tuple[Floats, Floats]:
        """(2, bins) histograms of the target's window and of the ring, each summing to one, and their
        visible shares (2,). Wholly outside: zeros and 0."""
        left, top = self.outer.corner(center)
        return (self._counted if COMPILED else self._counted_plain)(image, left, top)

    def judge(self, image: Picture, center: tuple[float, float], reference: Floats) -> Judged:
        """How like a reference (bins,) a place is, and the ring around it; what the frame's edge cuts off counts
        against the place, as in `likeness`."""
        histograms, visible = self.histograms(image, center)
        score, floor = bhattacharyya(histograms, reference).tolist()
        return Judged(histograms[0], score * float(visible[0]), floor)

    def _counted(self, image: Picture, left: int, top: int) -> tuple[Floats, Floats]:
        pixels, x, y = _part(image, left, top, left + self.outer.columns, top + self.outer.rows)
        histograms, visible = np.empty((2, self.quantiser.bins)), np.empty(2)
        table = self.quantiser.table(pixels.itemsize)
        compiled.surround_histograms(pixels, table, left - x, top - y, self.first, self.kernel, histograms, visible)
        return histograms, visible

    def _counted_plain(self, image: Picture, left: int, top: int) -> tuple[Floats, Floats]:
        cells = _cells(image, self.quantiser, left, top, left + self.outer.columns, top + self.outer.rows)
        cells += self.first
        held = self.quantiser.bins + 1
        mass = np.bincount(cells.ravel(), self.kernel.ravel(), 2 * held).reshape(2, held)[:, :-1]
        visible = mass.sum(axis=1)
        return mass / np.maximum(visible, _NOTHING)[:, None], visible


def gaussian_kernel(window: Window, h: float) -> Floats:
    """(rows, columns) k(r) = exp(-r^2 / 2), r = |l - l_i| / h, h in px, summing to one."""
    x, y = window.offsets()
    kernel: Floats = np.exp(-(x**2 + y**2) / (2 * h**2))
    kernel /= kernel.sum()
    return kernel


def epanechnikov_kernel(window: Window) -> Floats:
    """(rows, columns) k = max(0, 1 - r^2), r^2 = (dx / hx)^2 + (dy / hy)^2, summing to one.

    hx, hy are half the window's sizes, at least 1 px: a narrower kernel may fall between the pixels.
    """
    x, y = window.offsets()
    kernel: Floats = np.maximum(1 - (x / max(window.columns / 2, 1)) ** 2 - (y / max(window.rows / 2, 1)) ** 2, 0)
    kernel /= kernel.sum()
    return kernel


def histogram(
    image: Image, center: tuple[float, float], window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, float]:
    """One window's histogram (bins,), summing to one, and the share of kernel mass in the frame.

    Wholly outside: zeros and 0.
    """
    left, top = window.corner(center)
    cells = _cells(image, quantiser, left, top, left + window.columns, top + window.rows)
    mass = _masses(cells[None], kernel.reshape(1, -1), quantiser.bins)[0, :-1]
    visible = float(mass.sum())
    return mass / max(visible, _NOTHING), visible


def repeated(kernel: Floats) -> Floats:
    """(K, rows * columns) a kernel for each of the windows that `likeness` counts at once, written out only once."""
    return kernel.reshape(1, -1).repeat(max(1, _PIXELS_AT_ONCE // kernel.size), axis=0)


def likeness(
    image: Picture, centers: Floats, window: Window, kernels: Floats, quantiser: Quantiser, reference: Floats
) -> tuple[Floats, Floats]:
    """rho (N,) of windows at `centers` (N, 2) px to a reference (bins,), and visible shares (N,).

    kernels: the window's kernel, `repeated`. rho is multiplied by the visible share, so that slivers at the frame's
    edge do not win.
    """
    return (_likeness if COMPILED else _likeness_plain)(image, centers, window, kernels, quantiser, reference)


def _likeness(
    image: Picture, centers: Floats, window: Window, kernels: Floats, quantiser: Quantiser, reference: Floats
) -> tuple[Floats, Floats]:
    height, width = image.shape
    corners, keys = np.empty((len(centers), 2), np.intp), np.empty(len(centers), np.intp)
    centers = np.ascontiguousarray(centers, np.float64)
    distinct, left, top, right, bottom = compiled.distinct_windows(
        centers, *window.reach, window.columns, window.rows, width, height, corners, keys
    )
    right, bottom = right + window.columns, bottom + window.rows
    pixels, x, y = _part(image, left, top, right, bottom)
    corners = corners[:distinct]
    if x or y:
        corners -= (x, y)
    inside = left >= 0 and top >= 0 and right <= width and bottom <= height
    rho, visible = np.empty(distinct), None if inside else np.empty(distinct)
    kernel, table = kernels[0].reshape(window.rows, window.columns), quantiser.table(pixels.itemsize)
    for start in range(0, distinct, len(kernels)):
        some = slice(start, min(start + len(kernels), distinct))
        mass = np.empty((some.stop - start, quantiser.bins + 1))
        compiled.window_masses(pixels, table, corners[some], kernel, mass)
        _judged(mass, reference, some, rho, visible)
    if visible is not None:
        return rho.take(keys), visible.take(keys)
    whole = np.empty(len(keys))
    whole.fill(1)  # np.ones takes a microsecond, a fiftieth of a step of `grey_pf`
    return rho.take(keys), whole


def _likeness_plain(
    image: Picture, centers: Floats, window: Window, kernels: Floats, quantiser: Quantiser, reference: Floats
) -> tuple[Floats, Floats]:
    height, width = image.shape
    corners = window.corners(centers).T
    left, top, right, bottom = _bounds(corners)
    if left < -window.columns or top < -window.rows or right > width or bottom > height:
        # A window wholly outside sees nothing wherever it is: bring it to the frame's edge.
        corners = np.clip(corners, [[-window.columns], [-window.rows]], [[width], [height]])
        left, top, right, bottom = _bounds(corners)
    cells = _cells(image, quantiser, left, top, right + window.columns, bottom + window.rows)

    # A window is known by where its first pixel lies in the region, row after row.
    x, y = corners
    keys = y * cells.shape[1]
    keys += x
    keys -= top * cells.shape[1] + left
    taken = np.zeros((bottom - top) * cells.shape[1] + right - left + 1, bool)
    taken[keys] = True
    (distinct,) = taken.nonzero()
    inside = left >= 0 and top >= 0 and right + window.columns <= width and bottom + window.rows <= height
    rho, visible = np.empty(taken.size), None if inside else np.empty(taken.size)
    down, on = cells.strides
    windows: Bins = np.ndarray((taken.size, window.rows, window.columns), cells.dtype, cells, 0, (on, down, on))
    for start in range(0, distinct.size, len(kernels)):
        some = distinct[start : start + len(kernels)]
        mass = _masses(windows[some], kernels[: some.size], quantiser.bins)
        _judged(mass, reference, some, rho, visible)
    return rho[keys], np.ones(len(keys)) if visible is None else visible[keys]


def _judged(mass: Floats, reference: Floats, some: slice | Bins, rho: Floats, visible: Floats | None) -> None:
    """Writes rho and the visible shares of some windows with their mass in each bin."""
    rho[some] = bhattacharyya(mass, reference)
    if visible is not None:
        # With p = mass / visible: rho(p, q) visible = rho(mass, q) sqrt(visible).
        visible[some] = np.minimum(mass[:, :-1].sum(axis=1), 1.0)
        rho[some] *= np.sqrt(visible[some])


def _part(image: Picture, left: int, top: int, right: int, bottom: int) -> tuple[Image, int, int]:
    """Pixels of the frame among which a region's are, and the place (x, y) of the first of them."""
    if isinstance(image, HighPassed):
        height, width = image.shape
        x, y = min(max(left, 0), width), min(max(top, 0), height)
        return image[y : max(min(bottom, height), y), x : max(min(right, width), x)], x, y
    return contiguous(image), 0, 0


def _bounds(corners: Integers) -> tuple[int, int, int, int]:
    """(left, top, right, bottom), the least and the largest of corners (2, N)."""
    left, top = np.minimum.reduce(corners, axis=1).tolist()
    right, bottom = np.maximum.reduce(corners, axis=1).tolist()
    return left, top, right, bottom


def _masses(windows: Bins, weights: Floats, bins: int) -> Floats:
    """The kernel's mass in each bin (K, bins + 1) of windows (K, rows, columns) with weights (K, pixels).

    The last bin holds what lies outside the frame; the sums over the others are the visible shares. The windows are
    overwritten.
    """
    count = len(windows)
    index = windows.reshape(weights.shape)
    index += np.arange(0, count * (bins + 1), bins + 1)[:, None]
    mass: Floats = np.bincount(index.ravel(), weights.ravel(), count * (bins + 1)).astype(np.float64, copy=False)
    return mass.reshape(count, bins + 1)


def _cells(image: Picture, quantiser: Quantiser, left: int, top: int, right: int, bottom: int) -> Bins:
    """The bins of a region that may reach over the frame's edge; one bin more for what is outside."""
    height, width = image.shape
    if left >= 0 and top >= 0 and right <= width and bottom <= height:
        return quantiser(image[top:bottom, left:right])
    rows = slice(min(max(top, 0), height), max(min(bottom, height), 0))
    columns = slice(min(max(left, 0), width), max(min(right, width), 0))
    cells = np.full((bottom - top, right - left), quantiser.bins, np.intp)
    cells[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = quantiser(
        image[rows, columns]
    )
    return cells


def bhattacharyya(p: Floats, q: Floats) -> Floats:
    """rho = sum_u sqrt(p(u) q(u)) for p (..., bins) and q (bins,) (Cheng et al. 2006, eq. 8).

    p may have more bins than q, such as one for what is outside the frame: they count for nothing, and cutting them
    off first would cost a copy. ValueError where it has fewer.
    """
    if COMPILED:
        rho: Floats = np.empty(p.shape[:-1])
        compiled.bhattacharyya(np.ascontiguousarray(p, np.float64), np.ascontiguousarray(q, np.float64), rho)
        return rho if rho.ndim else rho[()]
    return _bhattacharyya_plain(p, q)


def _bhattacharyya_plain(p: Floats, q: Floats) -> Floats:
    rho: Floats = np.sqrt(p)[..., : len(q)] @ np.sqrt(q)
    return np.minimum(rho, 1.0)
