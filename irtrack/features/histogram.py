"""Grey histograms weighted by a kernel, of one window and of many at once, and their likeness.

    p(u) = C sum_i k(|l - l_i| / h) [b(l_i) = u],  C = 1 / sum_i k      (Cheng et al. 2006, eq. 6, 7)

Windows lie on whole pixels (see `irtrack.features.window`), so particles that share a pixel share a
histogram, and each distinct window is worked out once. Pixels outside the frame belong to no bin:
a histogram is that of the visible part, and the visible share of the kernel's mass is given apart.
"""

from __future__ import annotations

import numpy as np

from irsim.types import Floats, Image
from irtrack.features.quantise import Quantiser
from irtrack.features.window import Integers, Window


def gaussian_kernel(window: Window, size: tuple[float, float]) -> Floats:
    """(rows, columns) k(r) = exp(-r^2 / 2), r = |l - l_i| / h, summing to one.

    h = sqrt(hx^2 + hy^2) (Cheng et al. 2006, below eq. 6). The source calls h the size of the
    target's area and does not say whether hx, hy are full or half sizes: with full sizes the
    kernel is nearly a box (.88 at the corner); half sizes are taken (.61).
    """
    x, y = window.offsets()
    h2 = (size[0] / 2) ** 2 + (size[1] / 2) ** 2
    kernel: Floats = np.exp(-(x**2 + y**2) / (2 * h2))
    kernel /= kernel.sum()
    return kernel


def ring_kernel(ring: Window, window: Window) -> Floats:
    """(rows, columns) of the ring: equal weights summing to one, none where the window lies in it."""
    x, y = ring.offsets()
    kernel = np.where((2 * np.abs(x) <= window.columns) & (2 * np.abs(y) <= window.rows), 0.0, 1.0)
    kernel /= max(kernel.sum(), 1.0)
    return kernel


def histogram(
    image: Image, center: tuple[float, float], window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, float]:
    """One window's histogram (bins,), summing to one, and the share of kernel mass in the frame.

    Wholly outside: zeros and 0.
    """
    corner = window.corner(center)
    part, (left, top) = window.inside(corner, (image.shape[0], image.shape[1]))
    if part.rows == 0 or part.columns == 0:
        return np.zeros(quantiser.bins), 0.0
    patch = part.cut(image, (left, top))
    seen = part.cut(kernel, (left - corner[0], top - corner[1]))
    mass = np.bincount(quantiser(patch).ravel(), seen.ravel(), quantiser.bins)
    visible = float(mass.sum())
    return mass / visible, visible


def distinct_histograms(
    image: Image, centers: Floats, window: Window, kernel: Floats, quantiser: Quantiser
) -> tuple[Floats, Floats, Integers]:
    """The histograms of windows at `centers` (N, 2) px, each distinct window once.

    Returns histograms (K, bins), visible shares (K,), and which (N,) of the K is each centre's.
    """
    height, width = image.shape
    # A window wholly outside sees nothing wherever it is: bring it to the frame's edge.
    limits = (np.array([-window.columns, -window.rows]), np.array([width, height]))
    corners = np.clip(window.corners(centers), *limits)
    left, top = corners.min(axis=0).tolist()
    right, bottom = (corners.max(axis=0) + np.array([window.columns, window.rows])).tolist()
    cells = _cells(image, quantiser, left, top, right, bottom)

    keys = (corners[:, 1] - top) * (right - left) + (corners[:, 0] - left)
    taken = np.zeros(cells.size, bool)
    taken[keys] = True
    distinct = np.flatnonzero(taken)
    place = np.empty(cells.size, np.intp)
    place[distinct] = np.arange(distinct.size)

    pixels = (np.arange(window.rows)[:, None] * (right - left) + np.arange(window.columns)).ravel()
    index = cells.ravel().take(distinct[:, None] + pixels)
    index += (np.arange(distinct.size) * (quantiser.bins + 1))[:, None]
    mass = np.bincount(index.ravel(), np.tile(kernel.ravel(), distinct.size), distinct.size * (quantiser.bins + 1))
    mass = mass.reshape(distinct.size, quantiser.bins + 1)[:, :-1]
    visible = mass.sum(axis=1)
    return mass / np.where(visible > 0, visible, 1)[:, None], visible, place[keys]


def _cells(image: Image, quantiser: Quantiser, left: int, top: int, right: int, bottom: int) -> Integers:
    """The bins of a region that may reach over the frame's edge; one bin more for what is outside."""
    height, width = image.shape
    rows, columns = slice(max(top, 0), min(bottom, height)), slice(max(left, 0), min(right, width))
    inside = quantiser(image[rows, columns])
    if left >= 0 and top >= 0 and right <= width and bottom <= height:
        return inside
    cells = np.full((bottom - top, right - left), quantiser.bins, np.intp)
    cells[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left] = inside
    return cells


def bhattacharyya(p: Floats, q: Floats) -> Floats:
    """rho = sum_u sqrt(p(u) q(u)) for p (..., bins) and q (bins,) (Cheng et al. 2006, eq. 8)."""
    rho: Floats = np.sqrt(p) @ np.sqrt(q)
    return np.minimum(rho, 1.0)


def likeness(
    image: Image, centers: Floats, window: Window, kernel: Floats, quantiser: Quantiser, reference: Floats
) -> tuple[Floats, Floats]:
    """rho (N,) of windows at `centers` (N, 2) to a reference (bins,), and visible shares (N,).

    rho is multiplied by the visible share, so that slivers at the frame's edge do not win.
    """
    p, visible, which = distinct_histograms(image, centers, window, kernel, quantiser)
    rho = bhattacharyya(p, reference) * np.minimum(visible, 1.0)
    return rho[which], visible[which]
