"""Mean shift: windows climb to where the grey levels are most like a reference.

    p(u) = C sum_i k(r_i^2) [b(x_i) = u],  r_i^2 = ((x_i - y) / h)^2 over both axes        (eq. 3, 4)
    w_i  = sqrt(q(b(x_i)) / p(b(x_i)))                                                     (eq. 10)
    y   <- sum_i x_i w_i g(r_i^2) / sum_i w_i g(r_i^2),  g = -k'                           (eq. 13)

D. Comaniciu, V. Ramesh, P. Meer, "Kernel-Based Object Tracking", IEEE TPAMI 25(5), 2003. The profile
is Epanechnikov's, k(r^2) = max(0, 1 - r^2), so g is flat within the window's ellipse. A pixel is an
area: the edge of g is a ramp one pixel wide, else the window would be drawn to whichever pixels have
just come in. The paper halves a step that lowers the likeness and finds that it almost never
happens; it is left out here. Centres lie anywhere between pixels, so a shift is as fine as the
picture allows. Pixels outside the frame do not count.

The window should fit the target: one that holds it with room to spare sees it whole wherever it is,
steps shrink with the cube of the offset, and it stops short by a part of that room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Box, Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.histogram import bhattacharyya
from irtrack.features.quantise import Bins, Quantiser, contiguous

Bandwidth = tuple[float, float]
"""h of both axes (x, y), px: half the sizes of the window's ellipse."""

LEAST_BANDWIDTH = 1.0
"""px. A narrower window may fall between the pixels; at this one k is at least .5 at the nearest."""


_PIXELS_AT_ONCE = 500_000
"""Pixels of windows moved together: some tens of megabytes."""


@dataclass(frozen=True, slots=True, eq=False)
class Shifted:
    """Where N windows came to rest.

    centers  (N, 2) px;  rho  (N,) likeness to the reference there, 0 .. 1, of the visible part
    visible  (N,) share of the kernel's mass that lies in the frame
    """

    centers: Floats
    rho: Floats
    visible: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """The P pixels about each of N centres.

    x, y   (N, P) px from the centre
    bins   (N, P), one bin more for what is outside the frame
    k, g   (N, P) the kernel's profile and its slope
    """

    x: Floats
    y: Floats
    bins: Bins
    k: Floats
    g: Floats

    def masses(self, bins: int) -> tuple[Floats, Floats]:
        """(N, bins) the kernel's mass in each bin, over the whole window's, and its visible share (N,)."""
        count = len(self.bins)
        cells = self.bins + np.arange(0, count * (bins + 1), bins + 1)[:, None]
        mass = np.bincount(cells.ravel(), self.k.ravel(), count * (bins + 1)).reshape(count, bins + 1)
        inside: Floats = mass[:, :-1] / mass.sum(axis=1, keepdims=True)
        return inside, inside.sum(axis=1)


def bandwidth(box: Box, scale: float = 1.0) -> Bandwidth:
    """The bandwidth of a box: its half sizes times a scale, at least `LEAST_BANDWIDTH`."""
    return max(scale * box.w / 2, LEAST_BANDWIDTH), max(scale * box.h / 2, LEAST_BANDWIDTH)


def kernel_histogram(
    image: Image, center: tuple[float, float], h: Bandwidth, quantiser: Quantiser
) -> tuple[Floats, float]:
    """p (bins,) about one centre (eq. 3, 4), summing to one, and the visible share of the kernel.

    Wholly outside the frame: zeros and 0.
    """
    mass, visible = _view(image, np.array([center]), h, quantiser).masses(quantiser.bins)
    share = float(visible[0])
    return (mass[0] / share if share > 0 else mass[0]), share


def mean_shift(
    image: Image,
    centers: Floats,
    h: Bandwidth,
    quantiser: Quantiser,
    reference: Floats,
    iterations: int = 20,
    eps: float = 0.1,
) -> Shifted:
    """Windows at `centers` (N, 2) px moved by eq. 13 until a step is shorter than `eps` px.

    A window stops after `iterations` steps (20: Comaniciu, Meer 2002, section 6), and stays where
    it is while it sees no grey level of the reference (bins,).
    """
    centers = np.array(centers, dtype=np.float64, order="C")
    climb = _climbed if COMPILED else _climbed_plain
    mass, visible = climb(image, centers, h, quantiser, reference, iterations, eps)
    rho = bhattacharyya(mass / np.where(visible > 0, visible, 1.0)[:, None], reference)
    return Shifted(centers, rho, visible)


def _climbed(
    image: Image, centers: Floats, h: Bandwidth, quantiser: Quantiser, reference: Floats, iterations: int, eps: float
) -> tuple[Floats, Floats]:
    mass, visible = np.empty((len(centers), quantiser.bins)), np.empty(len(centers))
    pixels, table = contiguous(image), quantiser.table(image.itemsize)
    reference = np.ascontiguousarray(reference, np.float64)
    kernels.mean_shift(pixels, table, *h, reference, int(iterations), eps, centers, mass, visible)
    return mass, visible


def _climbed_plain(
    image: Image, centers: Floats, h: Bandwidth, quantiser: Quantiser, reference: Floats, iterations: int, eps: float
) -> tuple[Floats, Floats]:
    """Moves the centres (N, 2); the mass (N, bins) in each bin where they rest, its visible shares (N,)."""
    together = max(int(_PIXELS_AT_ONCE / (4 * (h[0] + 2) * (h[1] + 2))), 1)
    if len(centers) > together:
        parts = [
            _climbed_plain(image, centers[i : i + together], h, quantiser, reference, iterations, eps)
            for i in range(0, len(centers), together)
        ]
        return np.concatenate([mass for mass, _ in parts]), np.concatenate([visible for _, visible in parts])
    moving = np.arange(len(centers))
    for _ in range(iterations):
        view = _view(image, centers[moving], h, quantiser)
        pull = _pull(view, reference)
        total = pull.sum(axis=1)
        total[total == 0] = np.inf
        step = np.stack([(pull * view.x).sum(axis=1), (pull * view.y).sum(axis=1)], axis=1) / total[:, None]
        centers[moving] += step
        moving = moving[np.hypot(step[:, 0], step[:, 1]) >= eps]
        if moving.size == 0:
            break
    return _view(image, centers, h, quantiser).masses(quantiser.bins)


def back_projection(image: Image, quantiser: Quantiser, reference: Floats) -> Floats:
    """(rows, columns) in 0 .. 1: how much each pixel's grey level belongs to the reference (bins,).

    q(b(x)) / max q (Bradski, "Computer Vision Face Tracking for Use in a Perceptual User
    Interface", Intel Technology Journal Q2, 1998); its mean shift and CamShift climb this picture.
    """
    shares: Floats = (reference / max(float(reference.max()), np.finfo(np.float64).tiny)).take(quantiser(image))
    return shares


def _pull(view: _View, reference: Floats) -> Floats:
    """(N, P) w g of each pixel (eq. 10, 13); none from pixels outside the frame."""
    mass, _ = view.masses(len(reference))
    ratio = np.sqrt(np.divide(reference, mass, out=np.zeros_like(mass), where=mass > 0))
    ratio = np.concatenate([ratio, np.zeros((len(ratio), 1))], axis=1)
    pull: Floats = np.take_along_axis(ratio, view.bins, axis=1) * view.g
    return pull


def _view(image: Image, centers: Floats, h: Bandwidth, quantiser: Quantiser) -> _View:
    rows, columns = image.shape
    # The ramp of g ends half a pixel beyond h, and a centre lies up to half a pixel from the middle one.
    x, y = (np.arange(-int(side + 1), int(side + 1) + 1) for side in h)
    middle = np.floor(centers + 0.5)
    x, y = middle[:, :1] + x, middle[:, 1:] + y
    off_x, off_y = (x - centers[:, :1])[:, None, :], (y - centers[:, 1:])[:, :, None]
    r2 = ((off_x / h[0]) ** 2 + (off_y / h[1]) ** 2).reshape(len(centers), -1)
    inside = ((y >= 0) & (y < rows))[:, :, None] & ((x >= 0) & (x < columns))[:, None, :]
    pixels = image[
        np.clip(y, 0, rows - 1).astype(np.intp)[:, :, None], np.clip(x, 0, columns - 1).astype(np.intp)[:, None, :]
    ]
    shape = inside.shape
    return _View(
        x=np.broadcast_to(off_x, shape).reshape(r2.shape),
        y=np.broadcast_to(off_y, shape).reshape(r2.shape),
        bins=np.where(inside, quantiser(pixels), quantiser.bins).reshape(r2.shape),
        k=np.maximum(1 - r2, 0),
        g=np.clip((1 - np.sqrt(r2)) * np.sqrt(h[0] * h[1]) + 0.5, 0, 1),
    )
