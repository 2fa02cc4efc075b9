"""Mean shift: windows moved to the local maximum of their similarity to a reference histogram.

    p(u) = C sum_i k(r_i^2) [b(x_i) = u],  r_i^2 = ((x_i - y) / h)^2 over both axes        (eq. 3, 4)
    w_i  = sqrt(q(b(x_i)) / p(b(x_i)))                                                     (eq. 10)
    y   <- sum_i x_i w_i g(r_i^2) / sum_i w_i g(r_i^2),  g = -k'                           (eq. 13)

D. Comaniciu, V. Ramesh, P. Meer, "Kernel-Based Object Tracking", IEEE TPAMI 25(5), 2003. The profile is
Epanechnikov's, k(r^2) = max(0, 1 - r^2), so g is flat within the window's ellipse; the edge of g is a ramp one pixel
wide, since pixels that enter at a sharp edge would attract the window. The paper halves a step that lowers the
similarity; this module does not, as such steps almost never occur. Centres lie anywhere between pixels. Pixels outside
the frame do not count.

The window should fit the target: a larger window contains the whole target at many positions, and stops off centre.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irsim.types import Box, Floats, Image
from irtrack._native import COMPILED, kernels
from irtrack.features.histogram import TINY, bhattacharyya, counted
from irtrack.features.quantiser import Bins, Quantiser, contiguous

Bandwidth = tuple[float, float]
"""Bandwidths h on both axes (x, y), px: the semi-axes of the window's ellipse."""
LEAST_BANDWIDTH = 1.0
"""Least bandwidth, px: a narrower window may fall between the pixels; here k is at least .5 at the nearest pixel."""
_PIXELS_AT_ONCE = 500_000
"""Number of pixels that the Python equivalent of the C kernel processes at once: some tens of megabytes."""


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Modes reached by N windows.

    centers  (N, 2) px;  rho  (N,) similarity of the visible part of the window to the reference, 0 .. 1
    visible  (N,) share of the kernel's mass inside the frame
    """

    centers: Floats
    rho: Floats
    visible: Floats


def bandwidth(box: Box, scale: float = 1.0) -> Bandwidth:
    """Return the bandwidth of a box: half its sides times a scale, at least `LEAST_BANDWIDTH`."""
    return max(scale * box.w / 2, LEAST_BANDWIDTH), max(scale * box.h / 2, LEAST_BANDWIDTH)


def kernel_histogram(
    image: Image, center: tuple[float, float], h: Bandwidth, quantiser: Quantiser
) -> tuple[Floats, float]:
    """Return the histogram p (bins,) about a centre (eq. 3, 4), summing to one, and the visible share of the kernel.

    A window wholly outside the frame gives zeros and 0.
    """
    mass, visible = _View.of(image, np.array([center]), h, quantiser).masses(quantiser.bins)
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
) -> Modes:
    """Return the modes of windows at `centers` (N, 2) px moved by eq. 13 until a step is shorter than `eps` px.

    At most `iterations` steps (20: Comaniciu, Meer 2002, section 6). A window that contains no grey level of the
    reference (bins,) stays where it is.
    """
    centers = np.array(centers, dtype=np.float64, order="C")
    mass, visible = np.empty((len(centers), quantiser.bins)), np.empty(len(centers))
    if COMPILED:
        pixels, table = contiguous(image), quantiser.table(image.itemsize)
        model = np.ascontiguousarray(reference, np.float64)
        kernels.mean_shift(pixels, table, *h, model, int(iterations), eps, centers, mass, visible)
    else:
        together = max(int(_PIXELS_AT_ONCE / (4 * (h[0] + 2) * (h[1] + 2))), 1)
        for part in (slice(i, i + together) for i in range(0, len(centers), together)):
            _mean_shift_plain(image, centers[part], h, quantiser, reference, iterations, eps)
            mass[part], visible[part] = _View.of(image, centers[part], h, quantiser).masses(quantiser.bins)
    rho = bhattacharyya(mass / np.where(visible > 0, visible, 1.0)[:, None], reference)
    return Modes(centers, rho, visible)


def _mean_shift_plain(
    image: Image, centers: Floats, h: Bandwidth, quantiser: Quantiser, reference: Floats, iterations: int, eps: float
) -> None:
    """Move the centres (N, 2) in place."""
    moving = np.arange(len(centers))
    for _ in range(iterations):
        view = _View.of(image, centers[moving], h, quantiser)
        mass, _ = view.masses(quantiser.bins)
        ratio = np.sqrt(np.divide(reference, mass, out=np.zeros_like(mass), where=mass > 0))
        ratio = np.concatenate([ratio, np.zeros((len(ratio), 1))], axis=1)  # pixels outside the frame have weight 0
        pull = np.take_along_axis(ratio, view.bins, axis=1) * view.g
        total = pull.sum(axis=1)
        total[total == 0] = np.inf
        step = np.stack([(pull * view.x).sum(axis=1), (pull * view.y).sum(axis=1)], axis=1) / total[:, None]
        centers[moving] += step
        moving = moving[np.hypot(step[:, 0], step[:, 1]) >= eps]
        if moving.size == 0:
            break


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """P pixels about each of N centres, with their bins and kernel weights.

    x, y   (N, P) px from the centre;  bins  (N, P), the bin `bins` for pixels outside the frame
    k, g   (N, P) the kernel's profile and its slope
    """

    x: Floats
    y: Floats
    bins: Bins
    k: Floats
    g: Floats

    @classmethod
    def of(cls, image: Image, centers: Floats, h: Bandwidth, quantiser: Quantiser) -> _View:
        rows, columns = image.shape
        # The ramp of g ends half a pixel beyond h, and a centre lies up to half a pixel from its nearest pixel.
        x, y = (np.arange(-int(side + 1), int(side + 1) + 1) for side in h)
        middle = np.floor(centers + 0.5)
        x, y = middle[:, :1] + x, middle[:, 1:] + y
        off_x, off_y = (x - centers[:, :1])[:, None, :], (y - centers[:, 1:])[:, :, None]
        r2 = ((off_x / h[0]) ** 2 + (off_y / h[1]) ** 2).reshape(len(centers), -1)
        inside = ((y >= 0) & (y < rows))[:, :, None] & ((x >= 0) & (x < columns))[:, None, :]
        at_y, at_x = np.clip(y, 0, rows - 1).astype(np.intp), np.clip(x, 0, columns - 1).astype(np.intp)
        cells = np.where(inside, quantiser(image[at_y[:, :, None], at_x[:, None, :]]), quantiser.bins)
        return cls(
            x=np.broadcast_to(off_x, cells.shape).reshape(r2.shape),
            y=np.broadcast_to(off_y, cells.shape).reshape(r2.shape),
            bins=cells.reshape(r2.shape),
            k=np.maximum(1 - r2, 0),
            g=np.clip((1 - np.sqrt(r2)) * np.sqrt(h[0] * h[1]) + 0.5, 0, 1),
        )

    def masses(self, bins: int) -> tuple[Floats, Floats]:
        """Return the share of the kernel's mass in each bin (N, bins), and its visible share (N,)."""
        mass = counted(self.bins, self.k, bins + 1)
        inside: Floats = mass[:, :-1] / mass.sum(axis=1, keepdims=True)
        return inside, inside.sum(axis=1)


def back_projection(image: Image, quantiser: Quantiser, reference: Floats) -> Floats:
    """Return the back projection (rows, columns), 0 .. 1: the weight of each pixel's level in the reference (bins,).

    q(b(x)) / max q (Bradski, "Computer Vision Face Tracking for Use in a Perceptual User Interface", Intel Technology
    Journal Q2, 1998); mean shift and CamShift of that paper search this picture.
    """
    shares: Floats = (reference / max(float(reference.max()), TINY)).take(quantiser(image))
    return shares
